/* Volumes to time the programs on, as raw 32-bit floats, x fastest, on stdout:  field NAME SIDE [MARGIN]
 *
 *   waves       the test signal of Marschner and Lobb 1994 with a ball of noise in the middle: no two voxels alike
 *   smoke       six balls eaten away by noise, 0 around them
 *   extinction  what waves is taken to, for programs without transfer functions, by the lines on stdin: value, red, green,
 *               blue, extinction; the extinction is linear in between and divided by the greatest
 *
 * With MARGIN the outermost voxels become 0 and MARGIN more zeros are put around them on every side: the same field
 * between SIDE^3 and (SIDE + 2 MARGIN)^3 voxels, whatever MARGIN is. */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/fmath.h"

static const double PI = 3.14159265358979323846;

static double clamp01(double v) { return v < 0 ? 0 : v > 1 ? 1 : v; }

static double corner_noise(int x, int y, int z)
{
    uint32_t h = (uint32_t)x * 0x8da6b343u ^ (uint32_t)y * 0xd8163841u ^ (uint32_t)z * 0xcb1ab31fu;
    h = (h ^ h >> 15) * 0x2c1b3c6du;
    h = (h ^ h >> 12) * 0x297a2d39u;
    h ^= h >> 15;
    return (h >> 8) / 16777216.0;
}

/* Noise at the integers, in [0, 1), with smooth steps between. */
static double value_noise(double x, double y, double z)
{
    double fx = floor(x), fy = floor(y), fz = floor(z), u = x - fx, v = y - fy, w = z - fz, sum = 0;
    u = u * u * (3 - 2 * u);
    v = v * v * (3 - 2 * v);
    w = w * w * (3 - 2 * w);
    for (int corner = 0; corner < 8; corner++) {
        int a = corner & 1, b = corner >> 1 & 1, c = corner >> 2;
        sum += corner_noise((int)fx + a, (int)fy + b, (int)fz + c) * (a ? u : 1 - u) * (b ? v : 1 - v) * (c ? w : 1 - w);
    }
    return sum;
}

static double fractal_noise(double x, double y, double z, int octaves)
{
    double sum = 0, weight = 0.5;
    for (; octaves > 0; octaves--, weight *= 0.5) {
        sum += weight * value_noise(x, y, z);
        x = x * 2.03 + 17.1;
        y = y * 2.03 + 5.3;
        z = z * 2.03 + 11.7;
    }
    return sum;
}

/* Fields over x, y, z in [-1, 1]. */
typedef double Field(double x, double y, double z);

static double waves(double x, double y, double z)
{
    double r = sqrt(x * x + y * y), d = sqrt(x * x + y * y + z * z);
    double signal = (1 - vol_sin(PI * z / 2) + 0.25 * (1 + vol_cos(12 * PI * vol_cos(PI * r / 2)))) / 2.5;
    double ball = clamp01((0.75 - d) * 8);
    if (ball > 0)
        signal = signal * (1 - 0.6 * ball) + 0.6 * ball * fractal_noise(x * 9, y * 9, z * 9, 4);
    return clamp01(signal);
}

static double smoke(double x, double y, double z)
{
    static const double balls[6][4] = {/* centre, radius */
                                       {0.00, -0.10, 0.00, 0.52}, {0.42, 0.10, 0.10, 0.36}, {-0.40, 0.05, -0.12, 0.38},
                                       {0.05, 0.40, 0.05, 0.34},  {-0.10, -0.50, 0.22, 0.32}, {0.18, 0.05, -0.48, 0.30}};
    double inside = -1;
    for (int i = 0; i < 6; i++) {
        double dx = x - balls[i][0], dy = y - balls[i][1], dz = z - balls[i][2];
        inside = fmax(inside, 1 - sqrt(dx * dx + dy * dy + dz * dz) / balls[i][3]);
    }
    if (inside < -0.35)
        return 0;
    double noise = fractal_noise(x * 6 + 3, y * 6 + 3, z * 6 + 3, 6);
    return clamp01((inside * 0.9 + (noise - 0.5) * 1.6 - 0.02) * 1.5);
}

static struct {
    double value, extinction;
} nodes[64];
static int node_count;

static void read_nodes(void)
{
    double greatest = 0;
    while (node_count < 64 && scanf("%lf %*f %*f %*f %lf", &nodes[node_count].value, &nodes[node_count].extinction) == 2)
        greatest = fmax(greatest, nodes[node_count++].extinction);
    for (int i = 0; i < node_count; i++)
        nodes[i].extinction /= greatest;
}

static double extinction(double x, double y, double z)
{
    double value = waves(x, y, z);
    int i = 1;
    while (i < node_count - 1 && value > nodes[i].value)
        i++;
    double t = (value - nodes[i - 1].value) / (nodes[i].value - nodes[i - 1].value);
    return nodes[i - 1].extinction + clamp01(t) * (nodes[i].extinction - nodes[i - 1].extinction);
}

static Field *field_named(const char *name)
{
    if (strcmp(name, "waves") == 0)
        return waves;
    if (strcmp(name, "smoke") == 0)
        return smoke;
    return strcmp(name, "extinction") == 0 ? extinction : NULL;
}

int main(int argc, char **argv)
{
    Field *field = argc > 1 ? field_named(argv[1]) : NULL;
    long side = argc > 2 ? strtol(argv[2], NULL, 10) : 0, margin = argc > 3 ? strtol(argv[3], NULL, 10) : 0;
    if (!field || argc > 4 || side < 2 || side > 2048 || margin < 0 || margin > 2048) {
        fprintf(stderr, "usage: field waves|smoke|extinction SIDE [MARGIN]\n");
        return 2;
    }
    if (field == extinction) {
        read_nodes();
        if (node_count < 2) {
            fprintf(stderr, "field: fewer than two nodes on stdin\n");
            return 2;
        }
    }
    /* Without a margin what is kept are all voxels, with one those from 1 to SIDE - 2. */
    long first = argc > 3, last = side - 1 - first, all = side + 2 * margin;
    float *row = calloc((size_t)all, sizeof *row);
    if (!row)
        return 1;
    for (long k = -margin; k < side + margin; k++)
        for (long j = -margin; j < side + margin; j++) {
            double scale = 2 / (double)(side - 1), y = (double)j * scale - 1, z = (double)k * scale - 1;
            int inside = j >= first && j <= last && k >= first && k <= last;
            for (long i = first; i <= last; i++)
                row[i + margin] = inside ? (float)field((double)i * scale - 1, y, z) : 0;
            if (fwrite(row, sizeof *row, (size_t)all, stdout) != (size_t)all)
                return 1;
        }
    free(row);
    return fflush(stdout) != 0;
}
