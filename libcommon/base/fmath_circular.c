/* sin, cos, tan, asin, acos, atan2.  (The rest: fmath.c.)
 *
 * x is reduced to r = x - n pi/2, |r| <= pi/4, in double-double: for |x| up to 2^20 with pi/2 in three parts, beyond that
 * by multiplying the integer x 2^e with the bits of 2/pi that matter (Payne and Hanek 1983), so that every finite x
 * comes out right.  The inverse functions turn a rough guess a into theta by one exact step,
 *
 *   tan(theta - a) = (y cos a - x sin a) / (x cos a + y sin a),
 *
 * which needs no table: with a guess good to 0.004 four terms of the arc tangent's series are enough. */
#include "base/fmath.h"

#include <stdbool.h>
#include <stdint.h>
#include <string.h>

#include "base/dd.h"

/* pi/2 = A + B + C to 159 bits. */
#define HALF_PI_A 0x1.921fb54442d18p+0
#define HALF_PI_B 0x1.1a62633145c07p-54
#define HALF_PI_C (-0x1.f1976b7ed8fbcp-110)
#define TWO_OVER_PI 0x1.45f306dc9c883p-1

static const VolDd pi = {2 * HALF_PI_A, 2 * HALF_PI_B}, half_pi = {HALF_PI_A, HALF_PI_B};

/* ---- argument reduction ---- */

static VolDd reduce_small(double x, unsigned *quadrant)
{
    double n = nearbyint(x * TWO_OVER_PI);
    *quadrant = (unsigned)(int)n;
    VolDd a = vol_dd_product(-n, HALF_PI_A), b = vol_dd_product(-n, HALF_PI_B);
    VolDd r = vol_dd_sum(x, a.hi); /* exact; what follows is small beside it, unless x is near a multiple of pi/2 */
    r = vol_dd_add(r, (VolDd){a.lo, 0});
    r = vol_dd_add(r, b);
    return vol_dd_add(r, (VolDd){-n * HALF_PI_C, 0});
}

/* The first 1280 bits of 2/pi after the binary point. */
static const uint64_t two_over_pi_bits[] = {
    UINT64_C(0xa2f9836e4e441529), UINT64_C(0xfc2757d1f534ddc0), UINT64_C(0xdb6295993c439041), UINT64_C(0xfe5163abdebbc561),
    UINT64_C(0xb7246e3a424dd2e0), UINT64_C(0x06492eea09d1921c), UINT64_C(0xfe1deb1cb129a73e), UINT64_C(0xe88235f52ebb4484),
    UINT64_C(0xe99c7026b45f7e41), UINT64_C(0x3991d639835339f4), UINT64_C(0x9c845f8bbdf9283b), UINT64_C(0x1ff897ffde05980f),
    UINT64_C(0xef2f118b5a0a6d1f), UINT64_C(0x6d367ecf27cb09b7), UINT64_C(0x4f463f669e5fea2d), UINT64_C(0x7527bac7ebe5f17b),
    UINT64_C(0x3d0739f78a5292ea), UINT64_C(0x6bfb5fb11f8d5d08), UINT64_C(0x56033046fc7b6bab), UINT64_C(0xf0cfbc209af4361d),
};

/* 64 bits of 2/pi, the first of weight 2^-(1+start); start may be negative (zeros before the point). */
static uint64_t bits_from(int start)
{
    enum { WORDS = sizeof two_over_pi_bits / sizeof *two_over_pi_bits };
    int word = start >= 0 ? start / 64 : -((63 - start) / 64), shift = start - 64 * word;
    uint64_t first = word >= 0 && word < WORDS ? two_over_pi_bits[word] : 0;
    uint64_t second = word + 1 >= 0 && word + 1 < WORDS ? two_over_pi_bits[word + 1] : 0;
    return shift ? first << shift | second >> (64 - shift) : first;
}

/* x 2/pi modulo 4, in units of 2^-190: x = M 2^e with M an integer of 53 bits.  Bits of 2/pi whose product with x is a
 * multiple of 4 are left out; 192 bits follow, so at least 128 bits of the fraction are right. */
static void fraction_of_quadrant(double x, uint64_t out[3])
{
    __extension__ typedef unsigned __int128 Wide;
    uint64_t bits;
    memcpy(&bits, &x, sizeof bits);
    int e = (int)(bits >> 52 & 0x7ff) - 1075;
    uint64_t m = (bits & UINT64_C(0x000fffffffffffff)) | UINT64_C(0x0010000000000000);
    int start = e - 2; /* the bit of weight 2^-(1+start) times 2^e is 2 */
    uint64_t p0 = bits_from(start), p1 = bits_from(start + 64), p2 = bits_from(start + 128);
    Wide low = (Wide)m * p2, middle = (Wide)m * p1 + (uint64_t)(low >> 64);
    out[2] = (uint64_t)low;
    out[1] = (uint64_t)middle;
    out[0] = m * p0 + (uint64_t)(middle >> 64);
}

static VolDd reduce_large(double x, unsigned *quadrant)
{
    uint64_t f[3];
    fraction_of_quadrant(fabs(x), f);
    /* f is a number in [0, 4) with its point after two bits; take the nearest integer off, leaving |fraction| <= 1/2. */
    unsigned n = (unsigned)(f[0] >> 62);
    bool up = f[0] >> 61 & 1;
    uint64_t a = f[0] << 2 | f[1] >> 62, b = f[1] << 2 | f[2] >> 62;
    if (up) { /* fraction - 1, negated: the complement */
        n++;
        a = ~a;
        b = ~b;
    }
    /* Pieces of 32 bits convert exactly. */
    VolDd r = vol_dd_quick_sum((double)(a >> 32) * 0x1p-32, (double)(a & 0xffffffff) * 0x1p-64);
    r = vol_dd_add(r, vol_dd_quick_sum((double)(b >> 32) * 0x1p-96, (double)(b & 0xffffffff) * 0x1p-128));
    r = vol_dd_mul(r, half_pi);
    if (up != (x < 0))
        r = vol_dd_negate(r);
    *quadrant = x < 0 ? 0u - n : n;
    return r;
}

static VolDd reduce(double x, unsigned *quadrant)
{
    return fabs(x) < 0x1p20 ? reduce_small(x, quadrant) : reduce_large(x, quadrant);
}

/* ---- sine and cosine of |r| <= pi/4 ---- */

static double horner(const double *c, int count, double z)
{
    double sum = c[count - 1];
    for (int i = count - 2; i >= 0; i--)
        sum = sum * z + c[i];
    return sum;
}

/* r (1 - z (1/3! - z (1/5! - z (1/7! ...)))), z = r^2. */
static VolDd sine_near_zero(VolDd r)
{
    static const double c[] = {-0x1.a01a01a01a01ap-13, 0x1.71de3a556c734p-19, -0x1.ae64567f544e4p-26,
                               0x1.6124613a86d09p-33, -0x1.ae7f3e733b81fp-41, 0x1.952c77030ad4ap-49,
                               -0x1.2f49b46814157p-57, 0x1.71b8ef6dcf572p-66};
    static const VolDd sixth = {-0x1.5555555555555p-3, -0x1.5555555555555p-57};
    static const VolDd fifth = {0x1.1111111111111p-7, 0x1.1111111111111p-63}; /* 1/5! */
    VolDd z = vol_dd_mul(r, r);
    VolDd sum = vol_dd_quick_sum(fifth.hi, fifth.lo + z.hi * horner(c, sizeof c / sizeof *c, z.hi));
    sum = vol_dd_add(sixth, vol_dd_mul(z, sum));
    return vol_dd_add(r, vol_dd_mul(r, vol_dd_mul(z, sum)));
}

static VolDd cosine_near_zero(VolDd r)
{
    static const double c[] = {-0x1.6c16c16c16c17p-10, 0x1.a01a01a01a01ap-16, -0x1.27e4fb7789f5cp-22,
                               0x1.1eed8eff8d898p-29, -0x1.93974a8c07c9dp-37, 0x1.ae7f3e733b81fp-45,
                               -0x1.6827863b97d97p-53, 0x1.e542ba4020225p-62};
    static const VolDd fourth = {0x1.5555555555555p-5, 0x1.5555555555555p-59}; /* 1/4! */
    VolDd z = vol_dd_mul(r, r);
    VolDd sum = vol_dd_quick_sum(fourth.hi, fourth.lo + z.hi * horner(c, sizeof c / sizeof *c, z.hi));
    sum = vol_dd_add((VolDd){-0.5, 0}, vol_dd_mul(z, sum));
    return vol_dd_add((VolDd){1, 0}, vol_dd_mul(z, sum));
}

double vol_sin(double x)
{
    if (!isfinite(x) || fabs(x) < 0x1p-27)
        return x - x == 0 ? x : NAN;
    unsigned quadrant;
    VolDd r = reduce(x, &quadrant);
    r = quadrant & 1 ? cosine_near_zero(r) : sine_near_zero(r);
    return quadrant & 2 ? -r.hi : r.hi;
}

double vol_cos(double x)
{
    if (!isfinite(x))
        return NAN;
    unsigned quadrant;
    VolDd r = reduce(x, &quadrant);
    r = quadrant & 1 ? sine_near_zero(r) : cosine_near_zero(r);
    return (quadrant + 1) & 2 ? -r.hi : r.hi;
}

double vol_tan(double x)
{
    if (!isfinite(x) || fabs(x) < 0x1p-27)
        return x - x == 0 ? x : NAN;
    unsigned quadrant;
    VolDd r = reduce(x, &quadrant);
    VolDd s = sine_near_zero(r), c = cosine_near_zero(r);
    return quadrant & 1 ? vol_dd_div(vol_dd_negate(c), s).hi : vol_dd_div(s, c).hi;
}

/* ---- inverse functions ---- */

/* Angle of (x, y) in the first octant: 0 < y <= x, neither more than 2^30 times the other. */
static VolDd octant_angle(VolDd y, VolDd x)
{
    double t = y.hi / x.hi;
    VolDd guess = {t * (0x1.921fb54442d18p-1 + 0.273 * (1 - t)), 0}; /* within 0.004 */
    VolDd s = sine_near_zero(guess), c = cosine_near_zero(guess);
    VolDd across = vol_dd_add(vol_dd_mul(y, c), vol_dd_negate(vol_dd_mul(x, s)));
    VolDd along = vol_dd_add(vol_dd_mul(x, c), vol_dd_mul(y, s));
    VolDd d = vol_dd_div(across, along);
    double z = d.hi * d.hi;
    d = vol_dd_quick_sum(d.hi, d.lo - d.hi * z * (1.0 / 3 - z * (1.0 / 5 - z * (1.0 / 7 - z / 9))));
    return vol_dd_add(guess, d);
}

/* Angle in (0, pi/2) of y > 0, x > 0 within 2^30 of each other. */
static VolDd quadrant_angle(VolDd y, VolDd x)
{
    if (y.hi <= x.hi)
        return octant_angle(y, x);
    return vol_dd_add(half_pi, vol_dd_negate(octant_angle(x, y)));
}

/* 2^-k for the largest of two positive numbers in [2^k, 2^(k+1)); exact for both. */
static double scale_of(double y, double x)
{
    double largest = fmax(y, x);
    uint64_t bits;
    memcpy(&bits, &largest, sizeof bits);
    uint64_t exponent = bits >> 52;
    if (exponent > 2044)
        return 0x1p-1022;
    if (exponent < 2)
        return 0x1p1021;
    bits = (2046 - exponent) << 52;
    memcpy(&largest, &bits, sizeof largest);
    return largest;
}

static double atan2_of_edges(double y, double x) /* one of them 0 or infinite, both >= 0 apart from the sign of x */
{
    double a;
    if (isinf(y))
        a = isinf(x) ? (x > 0 ? 0x1.921fb54442d18p-1 : 0x1.2d97c7f3321d2p+1) : HALF_PI_A;
    else if (y == 0 || isinf(x))
        a = signbit(x) ? pi.hi : 0;
    else
        a = HALF_PI_A; /* x is 0 */
    return a;
}

double vol_atan2(double y, double x)
{
    if (isnan(x) || isnan(y))
        return x + y;
    double up = fabs(y), right = fabs(x);
    if (up == 0 || right == 0 || isinf(up) || isinf(right))
        return copysign(atan2_of_edges(up, x), y);
    VolDd angle;
    if (up < 0x1p-29 * right) /* the angle is the quotient to the last bit */
        angle = (VolDd){up / right, 0};
    else if (right < 0x1p-29 * up)
        angle = vol_dd_add(half_pi, (VolDd){-(right / up), 0});
    else {
        double scale = scale_of(up, right);
        angle = quadrant_angle((VolDd){up * scale, 0}, (VolDd){right * scale, 0});
    }
    if (x < 0)
        angle = vol_dd_add(pi, vol_dd_negate(angle));
    return copysign(angle.hi, y);
}

/* sqrt(1 - x^2) for |x| < 1. */
static VolDd other_leg(double x)
{
    return vol_dd_sqrt(vol_dd_mul(vol_dd_sum(1, x), vol_dd_sum(1, -x)));
}

double vol_asin(double x)
{
    if (!(fabs(x) <= 1))
        return NAN;
    if (fabs(x) < 0x1p-27)
        return x;
    if (fabs(x) == 1)
        return copysign(HALF_PI_A, x);
    return copysign(quadrant_angle((VolDd){fabs(x), 0}, other_leg(x)).hi, x);
}

double vol_acos(double x)
{
    if (!(fabs(x) <= 1))
        return NAN;
    if (fabs(x) == 1)
        return x > 0 ? 0 : pi.hi;
    if (fabs(x) < 0x1p-29)
        return vol_dd_add(half_pi, (VolDd){-x, 0}).hi;
    VolDd angle = quadrant_angle(other_leg(x), (VolDd){fabs(x), 0});
    return x > 0 ? angle.hi : vol_dd_add(pi, vol_dd_negate(angle)).hi;
}
