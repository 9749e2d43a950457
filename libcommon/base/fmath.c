/* exp, expm1, log, log1p, pow, cbrt.  (Circular functions: fmath_circular.c.)
 *
 * Each function reduces its argument exactly or in double-double (dd.h), sums the leading terms of a Taylor series in
 * double-double and the small rest in double, and rounds once at the end, so the error is little more than half an ulp.
 *
 *   exp x = 2^k exp r,  k = round(x / ln 2),  r = x - k ln 2,  |r| <= ln 2 / 2
 *   log x = k ln 2 + 2 atanh s,  x = 2^k m,  m in [sqrt 1/2, sqrt 2),  s = (m-1)/(m+1),  |s| <= 0.1716
 *   x^y   = exp(y log x), the logarithm to about 2^-67 so that y log x <= 745 keeps 2^-57 */
#include "base/fmath.h"

#include <stdbool.h>
#include <stdint.h>
#include <string.h>

#include "base/dd.h"

/* ln 2 in three parts; the first has 11 trailing zero bits, so that k times it is exact for |k| < 2^11. */
#define LN2_A 0x1.62e42fefa3800p-1
#define LN2_B 0x1.ef35793c76730p-45
#define LN2_C (0x1.f97b57a079a19p-103)
#define LOG2_E 0x1.71547652b82fep+0

static uint64_t bits_of(double x)
{
    uint64_t bits;
    memcpy(&bits, &x, sizeof bits);
    return bits;
}

static double from_bits(uint64_t bits)
{
    double x;
    memcpy(&x, &bits, sizeof x);
    return x;
}

static double power_of_two(int k) { return from_bits((uint64_t)(k + 1023) << 52); } /* -1022 <= k <= 1023 */

/* x 2^k for |k| <= 2200, rounded once. */
static double times_power(double x, int k)
{
    if (k >= -1022 && k <= 1023)
        return x * power_of_two(k);
    int half = k < 0 ? -600 : 600; /* x is near 1: no rounding in the first step */
    x *= power_of_two(half);
    k -= half;
    if (k < -1022 || k > 1023) {
        x *= power_of_two(half);
        k -= half;
    }
    return x * power_of_two(k);
}

/* x = 2^k m with m in [1, 2); x positive and finite. */
static double split(double x, int *k)
{
    int shift = 0;
    if (x < 0x1p-1022) { /* denormal */
        x *= 0x1p54;
        shift = 54;
    }
    uint64_t bits = bits_of(x);
    *k = (int)(bits >> 52) - 1023 - shift;
    return from_bits((bits & UINT64_C(0x000fffffffffffff)) | UINT64_C(0x3ff0000000000000));
}

/* ---- exponential ---- */

/* exp(r) - 1 for |r| <= 0.35: r + r^2/2 in double-double, r^3/3! .. r^14/14! in double. */
static VolDd expm1_near_zero(VolDd r)
{
    static const double c[] = {0x1.5555555555555p-3, 0x1.5555555555555p-5, 0x1.1111111111111p-7,
                               0x1.6c16c16c16c17p-10, 0x1.a01a01a01a01ap-13, 0x1.a01a01a01a01ap-16,
                               0x1.71de3a556c734p-19, 0x1.27e4fb7789f5cp-22, 0x1.ae64567f544e4p-26,
                               0x1.1eed8eff8d898p-29, 0x1.6124613a86d09p-33, 0x1.93974a8c07c9dp-37};
    double x = r.hi, tail = c[sizeof c / sizeof *c - 1];
    for (int i = (int)(sizeof c / sizeof *c) - 2; i >= 0; i--)
        tail = tail * x + c[i];
    VolDd square = vol_dd_product(x, x);
    double rest = x * square.hi * tail + (0.5 * square.lo + (r.lo + r.lo * x));
    VolDd sum = vol_dd_quick_sum(x, 0.5 * square.hi);
    return vol_dd_quick_sum(sum.hi, sum.lo + rest);
}

/* x = k ln 2 + r; |x| < 1100. */
static VolDd reduce_exponent(VolDd x, int *k)
{
    double n = nearbyint(x.hi * LOG2_E);
    *k = (int)n;
    VolDd r = vol_dd_sum(x.hi - n * LN2_A, -n * LN2_B); /* the first difference is exact */
    return vol_dd_quick_sum(r.hi, r.lo + x.lo);
}

static double exp_of(VolDd x) /* |x.hi| < 1100 */
{
    int k;
    VolDd p = expm1_near_zero(reduce_exponent(x, &k));
    VolDd sum = vol_dd_quick_sum(1, p.hi);
    return times_power(sum.hi + (sum.lo + p.lo), k);
}

double vol_exp(double x)
{
    if (isnan(x))
        return x;
    if (x > 710)
        return INFINITY;
    if (x < -746)
        return 0;
    return exp_of((VolDd){x, 0});
}

double vol_expm1(double x)
{
    if (isnan(x) || fabs(x) < 0x1p-54)
        return x;
    if (x > 710)
        return INFINITY;
    if (x < -40)
        return -1;
    int k;
    VolDd p = expm1_near_zero(reduce_exponent((VolDd){x, 0}, &k));
    if (k == 0)
        return p.hi + p.lo;
    /* 2^k (1 + p) - 1 = 2^k ((1 - 2^-k) + p) */
    if (k > 100)
        return exp_of((VolDd){x, 0});
    VolDd sum = vol_dd_sum(1, -power_of_two(-k));
    sum = vol_dd_add(sum, p);
    return times_power(sum.hi, k);
}

/* ---- logarithm ---- */

/* 2 atanh(s) = 2 s (1 + z/3 + z^2/5 + ...), z = s^2 <= 0.0295: three terms in double-double, the rest in double. */
static VolDd twice_atanh(VolDd s)
{
    static const double c[] = {1.0 / 7, 1.0 / 9, 1.0 / 11, 1.0 / 13, 1.0 / 15, 1.0 / 17, 1.0 / 19, 1.0 / 21, 1.0 / 23,
                               1.0 / 25, 1.0 / 27, 1.0 / 29};
    static const VolDd third = {0x1.5555555555555p-2, 0x1.5555555555555p-56};
    static const VolDd fifth = {0x1.999999999999ap-3, -0x1.999999999999ap-57};
    VolDd z = vol_dd_mul(s, s);
    double tail = c[sizeof c / sizeof *c - 1];
    for (int i = (int)(sizeof c / sizeof *c) - 2; i >= 0; i--)
        tail = tail * z.hi + c[i];
    VolDd sum = vol_dd_quick_sum(fifth.hi, fifth.lo + z.hi * tail);
    sum = vol_dd_mul(z, sum);
    sum = vol_dd_mul(z, vol_dd_add(third, sum));
    return vol_dd_scale(vol_dd_add(s, vol_dd_mul(s, sum)), 2);
}

/* log(2^k (m.hi + m.lo)), m within a factor of about sqrt 2 of 1. */
static VolDd log_of(VolDd m, int k)
{
    VolDd below = vol_dd_sum(m.hi - 1, m.lo), above = vol_dd_sum(m.hi, 1);
    above.lo += m.lo;
    VolDd log = twice_atanh(vol_dd_div(below, above));
    if (k == 0)
        return log;
    double n = k;
    VolDd shift = vol_dd_quick_sum(n * LN2_A, n * LN2_B); /* the first product is exact */
    shift.lo += n * LN2_C;
    return vol_dd_add(shift, log);
}

static VolDd log_positive(double x) /* finite, > 0 */
{
    int k;
    double m = split(x, &k);
    if (m > 0x1.6a09e667f3bcdp+0) { /* sqrt 2 */
        m *= 0.5;
        k++;
    }
    return log_of((VolDd){m, 0}, k);
}

double vol_log(double x)
{
    if (isnan(x) || x == INFINITY)
        return x;
    if (x <= 0)
        return x == 0 ? -INFINITY : NAN;
    VolDd log = log_positive(x);
    return log.hi + log.lo;
}

double vol_log1p(double x)
{
    if (isnan(x) || x == INFINITY || fabs(x) < 0x1p-54)
        return x;
    if (x <= -1)
        return x == -1 ? -INFINITY : NAN;
    int k;
    VolDd one_more = vol_dd_sum(1, x);
    if (one_more.hi > 0.70 && one_more.hi < 1.42) { /* keeps x itself, however small */
        k = 0;
    } else {
        double m = split(one_more.hi, &k);
        if (m > 0x1.6a09e667f3bcdp+0)
            k++;
        one_more = (VolDd){times_power(one_more.hi, -k), times_power(one_more.lo, -k)};
    }
    VolDd log = log_of(one_more, k);
    return log.hi + log.lo;
}

/* ---- powers ---- */

static bool is_integer(double y) { return fabs(y) >= 0x1p53 || y == floor(y); }
static bool is_odd(double y) { return fabs(y) < 0x1p53 && y == floor(y) && floor(y / 2) * 2 != y; }

/* x^y for the x and y that are no ordinary numbers; |x| != 1, y != 0. */
static double pow_of_edges(double x, double y, double sign)
{
    double size = fabs(x);
    if (isinf(y))
        return (size > 1) == (y > 0) ? INFINITY : 0;
    return sign * ((size > 1) == (y > 0) ? INFINITY : 0); /* x is 0 or infinite */
}

double vol_pow(double x, double y)
{
    if (y == 0 || x == 1)
        return 1;
    if (isnan(x) || isnan(y))
        return x + y;
    double size = fabs(x), sign = signbit(x) && is_odd(y) ? -1 : 1;
    if (isinf(y) && size == 1)
        return 1;
    if (isinf(y) || size == 0 || isinf(x))
        return pow_of_edges(x, y, sign);
    if (x < 0 && !is_integer(y))
        return NAN;
    if (size == 1)
        return sign;
    bool grows = (size > 1) == (y > 0);
    if (fabs(y) > 0x1p64) /* |log x| >= 2^-53 */
        return sign * (grows ? INFINITY : 0);
    VolDd log = log_positive(size);
    VolDd p = vol_dd_product(y, log.hi);
    p = vol_dd_quick_sum(p.hi, p.lo + y * log.lo);
    if (fabs(p.hi) > 760)
        return sign * (grows ? INFINITY : 0);
    return sign * exp_of(p);
}

/* Newton's iteration from a straight line through m in [1, 8), the last step with the residual in double-double. */
double vol_cbrt(double x)
{
    if (isnan(x) || isinf(x) || x == 0)
        return x;
    int k;
    double m = split(fabs(x), &k);
    int third = k >= 0 ? k / 3 : -((2 - k) / 3); /* floor */
    m *= power_of_two(k - 3 * third);
    double r = 0.9 + 0.15 * m;
    for (int i = 0; i < 5; i++)
        r -= (r - m / (r * r)) / 3;
    VolDd square = vol_dd_product(r, r), cube = vol_dd_product(square.hi, r);
    double rest = (cube.hi - m) + (cube.lo + square.lo * r);
    r -= rest / (3 * square.hi);
    return copysign(times_power(r, third), x);
}
