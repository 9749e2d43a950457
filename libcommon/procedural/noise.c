/* Gradient noise after Perlin: at each point of the integer lattice a gradient g is chosen by a hash of the point;
 * the value at x blends the eight linear functions g . (x - corner) of the cell with the quintic 6t^5 - 15t^4 +
 * 10t^3, whose first and second derivatives vanish at 0 and 1: the sum is C2.
 *
 * The gradients are the 12 midpoints of a cube's edges, (+-1, +-1, 0) and its permutations.  With the most
 * favourable choice of all eight the sum exceeds 1 by a few hundredths in the middle of a cell: clamped there. */
#include "procedural/noise.h"

#include <math.h>

/* Finaliser of SplitMix64 (Steele, Lea and Flood 2014): every input bit reaches every output bit. */
static uint64_t mix(uint64_t h)
{
    h = (h ^ (h >> 30)) * UINT64_C(0xbf58476d1ce4e5b9);
    h = (h ^ (h >> 27)) * UINT64_C(0x94d049bb133111eb);
    return h ^ (h >> 31);
}

static uint64_t hash_point(uint64_t seed, int64_t i, int64_t j, int64_t k)
{
    uint64_t h = mix(seed + UINT64_C(0x9e3779b97f4a7c15));
    h = mix(h ^ (uint64_t)i);
    h = mix(h + UINT64_C(0x9e3779b97f4a7c15) * (uint64_t)j);
    return mix(h + UINT64_C(0xc2b2ae3d27d4eb4f) * (uint64_t)k);
}

/* g . d for the gradient that the hash picks. */
static double gradient_dot(uint64_t h, double dx, double dy, double dz)
{
    unsigned pick = (unsigned)(((h >> 32) * 12) >> 32); /* 0..11, even to 2^-28 */
    double a = pick < 8 ? dx : dy, b = pick < 4 ? dy : dz;
    return (pick & 1 ? -a : a) + (pick & 2 ? -b : b);
}

static double fade(double t) { return t * t * t * (t * (t * 6 - 15) + 10); }
static double mixed(double a, double b, double t) { return a + t * (b - a); }

double vol_noise(uint64_t seed, VolVec3 x)
{
    const double limit = 4503599627370496.0;
    if (!(fabs(x.x) < limit && fabs(x.y) < limit && fabs(x.z) < limit))
        return 0;
    double fx = floor(x.x), fy = floor(x.y), fz = floor(x.z);
    double dx = x.x - fx, dy = x.y - fy, dz = x.z - fz;
    int64_t i = (int64_t)fx, j = (int64_t)fy, k = (int64_t)fz;

    double corner[8];
    for (int c = 0; c < 8; c++) {
        int a = c & 1, b = c >> 1 & 1, d = c >> 2;
        corner[c] = gradient_dot(hash_point(seed, i + a, j + b, k + d), dx - a, dy - b, dz - d);
    }
    double u = fade(dx), v = fade(dy), w = fade(dz);
    double near_z = mixed(mixed(corner[0], corner[1], u), mixed(corner[2], corner[3], u), v);
    double far_z = mixed(mixed(corner[4], corner[5], u), mixed(corner[6], corner[7], u), v);
    return fmin(1, fmax(-1, mixed(near_z, far_z, w)));
}

double vol_fbm(uint64_t seed, VolVec3 x, int octaves, double lacunarity, double gain)
{
    double sum = 0, weights = 0, weight = 1, frequency = 1;
    for (int i = 0; i < octaves; i++) {
        sum += weight * vol_noise(seed + (uint64_t)i * UINT64_C(0x632be59bd9b4e019), vol_scale(x, frequency));
        weights += fabs(weight);
        weight *= gain;
        frequency *= lacunarity;
    }
    return weights > 0 ? sum / weights : 0;
}
