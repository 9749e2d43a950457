/* Four doubles side by side, the same bits at every cpu level: what the compiler's vectors lack, once in plain C and once
 * for AVX2.  No lane depends on another, and nothing is fused. */
#ifndef VOL_SIMD_QUADS_H
#define VOL_SIMD_QUADS_H

#ifdef __AVX2__
#include <immintrin.h>
#endif
#include <stdbool.h>
#include <stdint.h>

#define INLINE static inline __attribute__((always_inline))

typedef double Quad __attribute__((vector_size(32)));
typedef int64_t Mask __attribute__((vector_size(32)));

INLINE Quad quad(double x) { return (Quad){x, x, x, x}; }

/* The same numbers either way.  least() and most() are b where either is not a number; halves(): half i of a, then that
 * of b. */
#ifdef __AVX2__
INLINE Mask below(Quad a, Quad b) { return a < b; }
INLINE bool any(Mask mask) { return _mm256_movemask_pd((__m256d)mask) != 0; }
INLINE Quad choose(Mask mask, Quad yes, Quad no)
{
    return (Quad)_mm256_blendv_pd((__m256d)no, (__m256d)yes, (__m256d)mask);
}
INLINE Quad least(Quad a, Quad b) { return (Quad)_mm256_min_pd((__m256d)a, (__m256d)b); }
INLINE Quad most(Quad a, Quad b) { return (Quad)_mm256_max_pd((__m256d)a, (__m256d)b); }
INLINE Quad halves(Quad a, Quad b, int i)
{
    return i ? __builtin_shufflevector(a, b, 2, 3, 6, 7) : __builtin_shufflevector(a, b, 0, 1, 4, 5);
}
#else
/* Two and two: what is wider than the machine's vectors the compiler would make number by number. */
typedef double Pair __attribute__((vector_size(16)));
typedef union Pairs {
    Quad quad;
    Pair pair[2];
} Pairs;
INLINE Mask below(Quad a, Quad b)
{
    Pairs x = {a}, y = {b};
    for (int i = 0; i < 2; i++)
        x.pair[i] = (Pair)(x.pair[i] < y.pair[i]);
    return (Mask)x.quad;
}
INLINE Quad halves(Quad a, Quad b, int i) { return ((Pairs){.pair = {((Pairs){a}).pair[i], ((Pairs){b}).pair[i]}}).quad; }
INLINE bool any(Mask mask) { return (mask[0] | mask[1] | mask[2] | mask[3]) != 0; }
INLINE Quad choose(Mask mask, Quad yes, Quad no) { return (Quad)((mask & (Mask)yes) | (~mask & (Mask)no)); }
INLINE Quad least(Quad a, Quad b) { return choose(below(a, b), a, b); }
INLINE Quad most(Quad a, Quad b) { return choose(below(b, a), a, b); }
#endif
INLINE Quad within(Quad x, Quad bound) { return most(least(x, bound), -bound); }

/* exp(-t), t >= 0: Cody-Waite reduction, Taylor polynomial; below 2 ulp, never 0. */
INLINE Quad exp_minus(Quad t)
{
    const Quad magic = quad(0x1.8p52);
    Quad x = most(-t, quad(-708));
    Quad shifted = x * quad(0x1.71547652b82fep0) + magic, n = shifted - magic;
    Quad r = (x - n * quad(0x1.62e42feep-1)) - n * quad(0x1.a39ef35793c76p-33);
    static const double c[] = {1.0 / 6227020800.0, 1.0 / 479001600.0, 1.0 / 39916800.0, 1.0 / 3628800.0, 1.0 / 362880.0,
                               1.0 / 40320.0, 1.0 / 5040.0, 1.0 / 720.0, 1.0 / 120.0, 1.0 / 24.0, 1.0 / 6.0, 0.5};
    Quad p = quad(c[0]);
#pragma GCC unroll 12
    for (int i = 1; i < 12; i++)
        p = p * r + quad(c[i]);
    p = (r * r * p + r) + quad(1);
    return (Quad)((Mask)p + (((Mask)shifted - (Mask)magic) << 52));
}

#endif
