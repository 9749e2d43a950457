/* The few operations that the ray kernels are written in, in float or in double (VOL_DOUBLE).
 *
 * A kernel's body is compiled once per precision and cpu level from the same text: multiply-adds are always explicit, so
 * that every level rounds alike.  exp is ours: Cody-Waite reduction and a Taylor polynomial, below 1 ulp (double) and
 * 1.5 ulp (float) for arguments <= 0, exactly 0 below the smallest normal number. */
#ifndef VOL_SIMD_REAL_H
#define VOL_SIMD_REAL_H

#include <math.h>
#include <stdint.h>
#include <string.h>

/* Of float: half a unit in the last place of 1; and above this, products of three values stay well within it. */
#define UNIT_ROUNDOFF 0x1p-24f
#define LEAST_SAFE 0x1p-40f

#ifdef VOL_DOUBLE

typedef double real;
#define REAL_EPSILON 0x1p-52
#define REAL_SMALLEST 0x1p-1074

static inline real real_fma(real a, real b, real c) { return __builtin_fma(a, b, c); }
static inline real real_sqrt(real a) { return __builtin_sqrt(a); }
static inline real real_abs(real a) { return __builtin_fabs(a); }
static inline real real_floor(real a) { return __builtin_floor(a); }
static inline real real_ceil(real a) { return __builtin_ceil(a); }

static inline real real_exp(real x)
{
    const real magic = 0x1.8p52;
    real clamped = x < -708.0 ? -708.0 : x;
    real shifted = real_fma(clamped, 0x1.71547652b82fep0, magic);
    real n = shifted - magic;
    real r = real_fma(n, -0x1.62e42fefa39efp-1, clamped);
    r = real_fma(n, -0x1.abc9e3b39803fp-56, r);
    static const real c[] = {1.0 / 6227020800.0, 1.0 / 479001600.0, 1.0 / 39916800.0, 1.0 / 3628800.0, 1.0 / 362880.0,
                             1.0 / 40320.0, 1.0 / 5040.0, 1.0 / 720.0, 1.0 / 120.0, 1.0 / 24.0, 1.0 / 6.0, 0.5};
    real p = c[0];
    for (int i = 1; i < 12; i++)
        p = real_fma(p, r, c[i]);
    p = real_fma(r * r, p, r) + 1;
    int64_t bits;
    memcpy(&bits, &p, sizeof bits);
    bits += (int64_t)((uint64_t)(int64_t)n << 52);
    memcpy(&p, &bits, sizeof p);
    return x < -708.0 ? 0 : p;
}

#else

typedef float real;
#define REAL_EPSILON 0x1p-23f
#define REAL_SMALLEST 0x1p-149f

static inline real real_fma(real a, real b, real c) { return __builtin_fmaf(a, b, c); }
static inline real real_sqrt(real a) { return __builtin_sqrtf(a); }
static inline real real_abs(real a) { return __builtin_fabsf(a); }
static inline real real_floor(real a) { return __builtin_floorf(a); }
static inline real real_ceil(real a) { return __builtin_ceilf(a); }

static inline real real_exp(real x)
{
    const real magic = 0x1.8p23f;
    real clamped = x < -87.0f ? -87.0f : x;
    real shifted = real_fma(clamped, 0x1.715476p0f, magic);
    real n = shifted - magic;
    real r = real_fma(n, -0x1.62e4p-1f, clamped);
    r = real_fma(n, -0x1.7f7d1cp-20f, r);
    real p = 1.0f / 5040;
    p = real_fma(p, r, 1.0f / 720);
    p = real_fma(p, r, 1.0f / 120);
    p = real_fma(p, r, 1.0f / 24);
    p = real_fma(p, r, 1.0f / 6);
    p = real_fma(p, r, 0.5f);
    p = real_fma(r * r, p, r) + 1;
    int32_t bits;
    memcpy(&bits, &p, sizeof bits);
    bits += (int32_t)((uint32_t)(int32_t)n << 23);
    memcpy(&p, &bits, sizeof p);
    return x < -87.0f ? 0 : p;
}

#endif

/* The largest number below a finite a. */
static inline real real_below(real a)
{
#ifdef VOL_DOUBLE
    int64_t bits;
#else
    int32_t bits;
#endif
    if (a == 0)
        return -REAL_SMALLEST;
    memcpy(&bits, &a, sizeof bits);
    bits += a > 0 ? -1 : 1;
    memcpy(&a, &bits, sizeof bits);
    return a;
}

/* The least number that is not below a: v >= real_at_or_above(a) where and only where v >= a. */
static inline real real_at_or_above(double a)
{
    real r = (real)a;
    return (double)r < a ? -real_below(-r) : r;
}

/* b >= a, where a was taken to `before`: rounded to the nearest that keeps them in order, equal where they are equal. */
static inline real real_in_order(double a, real before, double b)
{
    real r = (real)b;
    if (b == a)
        return before;
    return r > before ? r : -real_below(-before);
}

/* What rounding a to r left out.  (Some compilers take r for a where they turn several of these into vectors.) */
static inline double real_rest(double a, real r)
{
    volatile real rounded = r;
    return a - (double)rounded;
}

static inline real real_min(real a, real b) { return a < b ? a : b; }
static inline real real_max(real a, real b) { return a > b ? a : b; }
static inline real real_clamp(real a, real lo, real hi) { return a < lo ? lo : a > hi ? hi : a; }

#endif
