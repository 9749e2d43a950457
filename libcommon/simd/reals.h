/* Vectors of `real`: LANES rays side by side, the same bits on every cpu level.
 *
 * The compiler's vector types give + - * / and comparisons on any machine.  What they lack stands in reals_plain.h,
 * reals_avx2.h and reals_avx512.h, the same list in each:
 *
 *     reals_fma, reals_select, reals_max, reals_min, reals_sqrt, reals_trunc   (towards zero; what fits in 31 bits)
 *     mask_bits             one bit per lane
 *     load_quad_row      four numbers from table + at[lane] of each of the lanes i, i + 4, ..., one lane's after the other's
 *     transpose_quads    from rows 0 to 3 to the first, second, third and fourth number of every lane
 *     spread_in_quads    number i of every four lanes in all of these: what a row is multiplied by
 *     gather_reals, gather_ints    table[index], lane by lane
 *     pick_reals, pick_ints        the same from eight numbers: one register holds them
 *     load_corners_of    the corners of a cell, n = 4 x + 2 y + z, from base[lane] + offset[lane] of bricks of 9^3
 *                        numbers: along z two corners lie side by side and come in one load
 *     doubles_add, doubles_round   sums in double
 *     reals_below (a < b) and, in double alone, reals_halves    in reals_plain.h only
 *
 * Every operation works lane by lane: what a lane holds never depends on its neighbours.  Masks are integers of the same
 * width, all bits set or none. */
#ifndef VOL_SIMD_REALS_H
#define VOL_SIMD_REALS_H

#include <stdbool.h>

#include "simd/real.h"

#if defined(__AVX2__) && defined(__FMA__)
#define REALS_AVX2 1
#endif
#if defined(__AVX512F__) && defined(__AVX512DQ__) && defined(__AVX512VL__) && defined(__AVX512BW__)
#define REALS_AVX512 1
#endif

#ifdef VOL_DOUBLE
enum { LANES = 4 };
typedef int64_t lane_int;
#elif defined(REALS_AVX512)
enum { LANES = 16 };
typedef int32_t lane_int;
#else
enum { LANES = 8 };
typedef int32_t lane_int;
#endif

typedef real reals __attribute__((vector_size(LANES * sizeof(real))));
typedef lane_int ints __attribute__((vector_size(LANES * sizeof(lane_int))));
typedef double double4 __attribute__((vector_size(32)));
typedef float float4 __attribute__((vector_size(16)));

#define ALWAYS_INLINE static inline __attribute__((always_inline))
#define MAYBE_UNUSED __attribute__((unused)) /* in a template of which a kernel may need only parts */

ALWAYS_INLINE reals reals_all(real a) { return a - (reals){0}; } /* a - 0 is a, whatever its sign; a + 0 may not be */
ALWAYS_INLINE ints ints_all(lane_int a) { return (ints){0} + a; }

/* The lanes whose bit is set, one after the other. */
#define FOR_LANES(i, bits)                                                                                                 \
    for (unsigned left_ = (bits), i = 0; left_ && (i = (unsigned)__builtin_ctz(left_), true); left_ &= left_ - 1)

typedef struct Doubles {
    double4 part[LANES / 4];
} Doubles;

static const int corner_row[4] = {0, 9, 81, 90};

#if defined(REALS_AVX2) && !defined(VOL_DOUBLE)
#include <immintrin.h>

/* Two numbers from either place; they need not be aligned to more than a number. */
ALWAYS_INLINE __m128 load_two_pairs(const float *low, const float *high)
{
    double first;
    memcpy(&first, low, sizeof first);
    return _mm_castpd_ps(_mm_loadh_pd(_mm_set_sd(first), (const double *)(const void *)high));
}
#endif

#if defined(REALS_AVX512) && !defined(VOL_DOUBLE)
#include "simd/reals_avx512.h"
#elif defined(REALS_AVX2) && !defined(VOL_DOUBLE)
#include "simd/reals_avx2.h"
#else
#include "simd/reals_plain.h"
#endif

/* ---- What follows from that ---- */

ALWAYS_INLINE ints ints_select(ints mask, ints a, ints b) { return (a & mask) | (b & ~mask); }
/* a where `mask`, else 0. */
ALWAYS_INLINE reals reals_where(ints mask, reals a) { return (reals)((ints)a & mask); }
ALWAYS_INLINE reals reals_abs(reals a)
{
    const lane_int all_but_the_sign = (lane_int)(((uint64_t)1 << (8 * sizeof(lane_int) - 1)) - 1);
    return (reals)((ints)a & all_but_the_sign);
}
ALWAYS_INLINE reals reals_clamp(reals a, real lo, real hi) { return reals_min(reals_max(a, reals_all(lo)), reals_all(hi)); }
ALWAYS_INLINE bool any(ints mask) { return mask_bits(mask) != 0; }
/* A mask with the lanes of `bits` set. */
ALWAYS_INLINE ints mask_of(unsigned bits)
{
    lane_int lanes[LANES];
    ints mask;
    for (int i = 0; i < LANES; i++)
        lanes[i] = -(lane_int)(bits >> i & 1);
    memcpy(&mask, lanes, sizeof mask);
    return mask;
}

/* a + b x */
ALWAYS_INLINE reals reals_line(reals a, reals b, reals x) { return reals_fma(b, x, a); }
ALWAYS_INLINE reals reals_mix(reals a, reals b, reals t) { return reals_fma(t, b - a, a); }

/* Four numbers per lane, from table + index[lane]: a lane's numbers side by side in memory. */
ALWAYS_INLINE void load_quads(const real *table, ints index, reals out[4])
{
    lane_int at[LANES] __attribute__((aligned(sizeof(ints))));
    reals row[4];
    memcpy(at, &index, sizeof at);
    for (int i = 0; i < 4; i++)
        row[i] = load_quad_row(table, at, i);
    transpose_quads(row, out);
}

static inline double doubles_lane(const Doubles *sum, int i) { return sum->part[i >> 2][i & 3]; }
static inline void doubles_set(Doubles *sum, int i, double value) { sum->part[i >> 2][i & 3] = value; }

/* ---- Exponentials ---- */

/* As real_exp, lane by lane. */
ALWAYS_INLINE reals reals_exp(reals x)
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
    reals clamped = reals_max(x, reals_all(least));
    reals shifted = reals_fma(clamped, reals_all(log2e), reals_all(magic)), n = shifted - magic;
    reals r = reals_fma(n, reals_all(-ln2), clamped);
    r = reals_fma(n, reals_all(-ln2_low), r);
    reals p = reals_all(c[0]);
    for (int i = 1; i < TERMS; i++)
        p = reals_fma(p, r, reals_all(c[i]));
    p = reals_fma(r * r, p, r) + 1;
    /* The magic number leaves n in the low bits of the sum. */
    ints bits = (ints)p + (((ints)shifted - (ints)reals_all(magic)) << MANTISSA);
    return (reals)(bits & ~under);
}

#ifdef VOL_DOUBLE
/* ---- Without fused operations, which machines without AVX2 do by hand ---- */

/* exp(-t), t >= 0: as reals_exp, each product rounded; below 2 ulp, never 0.
 *
 * Neither can stand in for the other.  Ray kernels rely on the accuracy of the fused one and on its 0 for what is opaque.
 * Tables are built on any machine, to the same bytes, and take exp(-t) at nearly every entry: where there is no fused
 * multiply-add, doing it by hand takes many times as long as a product and a sum. */
ALWAYS_INLINE reals reals_exp_unfused(reals t)
{
    const reals magic = reals_all(0x1.8p52);
    reals x = reals_max(-t, reals_all(-708));
    reals shifted = x * reals_all(0x1.71547652b82fep0) + magic, n = shifted - magic;
    reals r = (x - n * reals_all(0x1.62e42feep-1)) - n * reals_all(0x1.a39ef35793c76p-33);
    static const double c[] = {1.0 / 6227020800.0, 1.0 / 479001600.0, 1.0 / 39916800.0, 1.0 / 3628800.0, 1.0 / 362880.0,
                               1.0 / 40320.0, 1.0 / 5040.0, 1.0 / 720.0, 1.0 / 120.0, 1.0 / 24.0, 1.0 / 6.0, 0.5};
    reals p = reals_all(c[0]);
#pragma GCC unroll 12
    for (int i = 1; i < 12; i++)
        p = p * r + reals_all(c[i]);
    p = (r * r * p + r) + reals_all(1);
    return (reals)((ints)p + (((ints)shifted - (ints)magic) << 52));
}

ALWAYS_INLINE reals reals_within(reals x, reals bound) { return reals_max(reals_min(x, bound), -bound); }
#endif

/* exp(-x) for x in [0, 1]: Chebyshev's interpolant at x - 1/2 (tests/tools/chebyshev.c), no reduction.  Relative error 4e-8
 * (float), 1e-17 (double) before rounding. */
ALWAYS_INLINE reals reals_exp_short(reals x)
{
#ifdef VOL_DOUBLE
    enum { TERMS = 13 };
    static const real c[] = {1.2719039650810422692e-9, -1.5274200488412991958e-8, 1.6714181868801803907e-7,
                        -1.6714110914977199567e-6, 0.000015042923373747569437, -0.00012034338858639082174,
                        0.00084240369402593992562, -0.0050544221640004391717, 0.025272110821360331798,
                        -0.1010884432854473894, 0.30326532985631670639, -0.60653065971263334784, 0.6065306597126334236};
#else
    enum { TERMS = 7 };
    static const real c[] = {0.00084900787224f, -0.005107301484f, 0.02527128444f, -0.10108182477f, 0.30326535569f,
                        -0.60653086663f, 0.60653065971f};
#endif
    reals y = x - (real)0.5, p = reals_all(c[0]);
    for (int i = 1; i < TERMS; i++)
        p = reals_fma(p, y, reals_all(c[i]));
    return p;
}

/* phi(x) = (1 - exp(-x)) / x, the mean of exp(-u x) over u in [0, 1], and exp(-x); x >= 0.  For x <= 1 Chebyshev's
 * interpolant at x - 1/2 (tests/tools/chebyshev.c): relative error 3e-9 (float), 2e-17 (double) before rounding. */
ALWAYS_INLINE reals reals_phi(reals x, reals *passed)
{
#ifdef VOL_DOUBLE
    static const real c[] = {-1.32214808113269311114e-9, 1.592916142497292366019e-8, -1.750686890299263334863e-7,
                             0.000001758949638658032229683, -0.0000159224088084965834648, 0.0001283045919400132918427,
                             -0.0009065559886183540737762, 0.005507700158424523413789, -0.02802596090065342628028,
                             0.1151014237357689730498, -0.3608160417241994575166, 0.7869386805747331407092};
#else
    static const real c[] = {0.00012907631022196f, -0.00091354602735407f, 0.0055076036119712f, -0.028025086245559f,
                             0.1151014267537f, -0.36081606906655f, 0.78693868057473f};
#endif
    /* By squares of y: shorter chains than Horner's. */
    enum { TERMS = sizeof c / sizeof *c, ODD = TERMS % 2 };
    reals y = x - (real)0.5, yy = y * y, share = ODD ? reals_all(c[0]) : reals_line(reals_all(c[1]), reals_all(c[0]), y);
    for (int n = ODD ? 1 : 2; n < TERMS; n += 2)
        share = reals_fma(share, yy, reals_line(reals_all(c[n + 1]), reals_all(c[n]), y));
    *passed = reals_fma(-x, share, reals_all(1));
    ints dense = (ints)(x > 1);
    if (__builtin_expect(any(dense), 0)) {
        reals rest = reals_exp(-x);
        share = reals_select(dense, (1 - rest) / x, share);
        *passed = reals_select(dense, rest, *passed);
    }
    return share;
}

/* ---- Gauss-Legendre on [0, 1] ---- */

#ifdef VOL_DOUBLE
enum { GAUSS = 16 };
static const real gauss_x[GAUSS] = {
    0.0052995325041750333469603, 0.0277124884633837102743126, 0.0671843988060841224019271, 0.1222977958224984867952045,
    0.1910618777986781147149031, 0.2709916111713863151599924, 0.3591982246103705422868302, 0.4524937450811812866824368,
    0.5475062549188187688287144, 0.6408017753896294577131698, 0.7290083888286137403511589, 0.8089381222013218852850969,
    0.8777022041775015548381589, 0.9328156011939158220869217, 0.9722875115366163001340283, 0.9947004674958249692551249};
static const real gauss_w[GAUSS] = {
    0.0135762297058770482066636, 0.0311267619693239468159351, 0.0475792558412463928441127, 0.0623144856277669384470030,
    0.0747979944082883679845608, 0.0845782596975012679330064, 0.0913017075224617918882686, 0.0947253052275342510846201,
    0.0947253052275342510846201, 0.0913017075224617918882686, 0.0845782596975012679330064, 0.0747979944082883679845608,
    0.0623144856277669384470030, 0.0475792558412463928441127, 0.0311267619693239468159351, 0.0135762297058770482066636};
#else
enum { GAUSS = 8 };
static const real gauss_x[GAUSS] = {
    0.01985507175123188417f, 0.10166676129318663602f, 0.23723379504183550459f, 0.40828267875217510996f,
    0.59171732124782494555f, 0.76276620495816449541f, 0.89833323870681336398f, 0.98014492824876808807f};
static const real gauss_w[GAUSS] = {
    0.05061426814518812933f, 0.11119051722668724103f, 0.15685332293894363453f, 0.18134189168918099511f,
    0.18134189168918099511f, 0.15685332293894363453f, 0.11119051722668724103f, 0.05061426814518812933f};
#endif

#endif
