/* Vectors of `real`: LANES of them, added, multiplied and compared lane by lane, the same bits on every cpu level.
 *
 * The compiler's vector types give + - * and comparisons on any machine; what they lack (fused multiply-add, selection) is
 * here.  Sums across lanes have one order, whatever the hardware's width. */
#ifndef VOL_RENDER_REALS_H
#define VOL_RENDER_REALS_H

#ifdef __AVX2__
#include <immintrin.h>
#endif

#include "render/real.h"

#ifdef VOL_DOUBLE
enum { LANES = 16 };
typedef int64_t lane_int;
#else
enum { LANES = 8 };
typedef int32_t lane_int;
#endif

typedef real reals __attribute__((vector_size(LANES * sizeof(real))));
typedef lane_int ints __attribute__((vector_size(LANES * sizeof(lane_int))));

static inline reals reals_all(real a) { return (reals){0} + a; }

#if defined(__AVX2__) && defined(__FMA__)
static inline reals reals_fma(reals a, reals b, reals c)
{
#ifdef VOL_DOUBLE
    union {
        reals all;
        __m256d part[LANES / 4];
    } x = {a}, y = {b}, z = {c};
    for (int i = 0; i < LANES / 4; i++)
        z.part[i] = _mm256_fmadd_pd(x.part[i], y.part[i], z.part[i]);
    return z.all;
#else
    return (reals)_mm256_fmadd_ps((__m256)a, (__m256)b, (__m256)c);
#endif
}
#else
static inline reals reals_fma(reals a, reals b, reals c)
{
    for (int i = 0; i < LANES; i++)
        c[i] = real_fma(a[i], b[i], c[i]);
    return c;
}
#endif

/* Where `mask` is set (all bits of a lane), a, else b. */
static inline reals reals_select(ints mask, reals a, reals b) { return (reals)(((ints)a & mask) | ((ints)b & ~mask)); }
static inline reals reals_max(reals a, reals b) { return reals_select((ints)(a > b), a, b); }
static inline reals reals_abs(reals a) { return reals_select((ints)(a < 0), -a, a); }

static inline real reals_sum(reals t)
{
    real sum[4];
    for (int i = 0; i < 4; i++) {
        sum[i] = t[i];
        for (int k = i + 4; k < LANES; k += 4)
            sum[i] += t[k];
    }
    return (sum[0] + sum[2]) + (sum[1] + sum[3]);
}

/* As real_exp, lane by lane. */
static inline reals reals_exp(reals x)
{
#ifdef VOL_DOUBLE
    const real least = -708.0, magic = 0x1.8p52, log2e = 0x1.71547652b82fep0, ln2 = 0x1.62e42fefa39efp-1,
               ln2_low = 0x1.abc9e3b39803fp-56;
    enum { TERMS = 12, MANTISSA = 52 };
    static const real c[TERMS] = {1.0 / 6227020800.0, 1.0 / 479001600.0, 1.0 / 39916800.0, 1.0 / 3628800.0,
                                  1.0 / 362880.0, 1.0 / 40320.0, 1.0 / 5040.0, 1.0 / 720.0, 1.0 / 120.0, 1.0 / 24.0,
                                  1.0 / 6.0, 0.5};
#else
    const real least = -87.0f, magic = 0x1.8p23f, log2e = 0x1.715476p0f, ln2 = 0x1.62e4p-1f, ln2_low = 0x1.7f7d1cp-20f;
    enum { TERMS = 6, MANTISSA = 23 };
    static const real c[TERMS] = {1.0f / 5040, 1.0f / 720, 1.0f / 120, 1.0f / 24, 1.0f / 6, 0.5f};
#endif
    ints under = (ints)(x < least);
    reals clamped = reals_select(under, reals_all(least), x);
    reals n = reals_fma(clamped, reals_all(log2e), reals_all(magic)) - magic;
    reals r = reals_fma(n, reals_all(-ln2), clamped);
    r = reals_fma(n, reals_all(-ln2_low), r);
    reals p = reals_all(c[0]);
    for (int i = 1; i < TERMS; i++)
        p = reals_fma(p, r, reals_all(c[i]));
    p = reals_fma(r * r, p, r) + 1;
    ints bits = (ints)p + (__builtin_convertvector(n, ints) << MANTISSA);
    return (reals)(bits & ~under);
}

/* Gauss-Legendre on [0, 1], a node a lane. */
#ifdef VOL_DOUBLE
static const reals gauss_x = {
    0.0052995325041750333469603, 0.0277124884633837102743126, 0.0671843988060841224019271, 0.1222977958224984867952045,
    0.1910618777986781147149031, 0.2709916111713863151599924, 0.3591982246103705422868302, 0.4524937450811812866824368,
    0.5475062549188187688287144, 0.6408017753896294577131698, 0.7290083888286137403511589, 0.8089381222013218852850969,
    0.8777022041775015548381589, 0.9328156011939158220869217, 0.9722875115366163001340283, 0.9947004674958249692551249};
static const reals gauss_w = {
    0.0135762297058770482066636, 0.0311267619693239468159351, 0.0475792558412463928441127, 0.0623144856277669384470030,
    0.0747979944082883679845608, 0.0845782596975012679330064, 0.0913017075224617918882686, 0.0947253052275342510846201,
    0.0947253052275342510846201, 0.0913017075224617918882686, 0.0845782596975012679330064, 0.0747979944082883679845608,
    0.0623144856277669384470030, 0.0475792558412463928441127, 0.0311267619693239468159351, 0.0135762297058770482066636};
#else
static const reals gauss_x = {
    0.01985507175123188417f, 0.10166676129318663602f, 0.23723379504183550459f, 0.40828267875217510996f,
    0.59171732124782494555f, 0.76276620495816449541f, 0.89833323870681336398f, 0.98014492824876808807f};
static const reals gauss_w = {
    0.05061426814518812933f, 0.11119051722668724103f, 0.15685332293894363453f, 0.18134189168918099511f,
    0.18134189168918099511f, 0.15685332293894363453f, 0.11119051722668724103f, 0.05061426814518812933f};
#endif

#endif
