/* What rays are followed in, whatever the kernel's precision: doubles, PART lanes at a time, as many as a register holds.
 *
 * A number per lane is an array double x[LANES], which scalar code indexes and vector code takes in parts:
 *
 *     for (int n = 0; n < PARTS; n++)
 *         put_part(x, n, mask, wide_min(get_part(y, n), get_part(z, n)));
 *
 * What a whole vector of the kernel's is made of comes from all parts at once: smaller pieces written to memory one by one
 * would have to arrive there before the whole could be read.
 *
 * PROVIDES    PART, PARTS; wide, wide_mask (as ints are); wide_all(), wide_select(), wide_fma(), wide_min(), wide_max(),
 *             wide_ceil(), wide_bits(), wide_least(), wide_sum(), get_part(), set_part(), put_part(); mask_part(),
 *             masks_joined(), reals_joined() between them and the kernel's vectors */
#ifndef VOL_SIMD_WIDE_H
#define VOL_SIMD_WIDE_H

#include <math.h>

#include "simd/reals.h"

#if defined(REALS_AVX512) && !defined(VOL_DOUBLE)
#define WIDE_AVX512 1
enum { PART = 8, PARTS = LANES / PART };
#else
enum { PART = 4, PARTS = LANES / PART };
#endif

typedef double wide __attribute__((vector_size(PART * sizeof(double))));
typedef int64_t wide_mask __attribute__((vector_size(PART * sizeof(int64_t))));

ALWAYS_INLINE wide wide_all(double a) { return a - (wide){0}; }
/* a where `mask`, else 0. */
ALWAYS_INLINE wide wide_where(wide_mask mask, wide a) { return (wide)((wide_mask)a & mask); }

#if defined(WIDE_AVX512)
ALWAYS_INLINE wide wide_select(wide_mask mask, wide a, wide b)
{
    return (wide)_mm512_ternarylogic_epi64((__m512i)mask, (__m512i)a, (__m512i)b, 0xca);
}
ALWAYS_INLINE wide wide_fma(wide a, wide b, wide c) { return (wide)_mm512_fmadd_pd((__m512d)a, (__m512d)b, (__m512d)c); }
ALWAYS_INLINE wide wide_min(wide a, wide b) { return (wide)_mm512_min_pd((__m512d)a, (__m512d)b); }
ALWAYS_INLINE wide wide_max(wide a, wide b) { return (wide)_mm512_max_pd((__m512d)a, (__m512d)b); }
ALWAYS_INLINE wide wide_ceil(wide a)
{
    return (wide)_mm512_roundscale_pd((__m512d)a, _MM_FROUND_TO_POS_INF | _MM_FROUND_NO_EXC);
}
ALWAYS_INLINE unsigned wide_bits(wide_mask mask) { return _mm512_movepi64_mask((__m512i)mask); }
ALWAYS_INLINE double wide_least(wide a) { return _mm512_reduce_min_pd((__m512d)a); }
#else
ALWAYS_INLINE wide wide_select(wide_mask mask, wide a, wide b)
{
    return (wide)(((wide_mask)a & mask) | ((wide_mask)b & ~mask));
}
#if defined(REALS_AVX2)
ALWAYS_INLINE wide wide_fma(wide a, wide b, wide c) { return (wide)_mm256_fmadd_pd((__m256d)a, (__m256d)b, (__m256d)c); }
ALWAYS_INLINE wide wide_min(wide a, wide b) { return (wide)_mm256_min_pd((__m256d)a, (__m256d)b); }
ALWAYS_INLINE wide wide_max(wide a, wide b) { return (wide)_mm256_max_pd((__m256d)a, (__m256d)b); }
ALWAYS_INLINE wide wide_ceil(wide a) { return (wide)_mm256_ceil_pd((__m256d)a); }
ALWAYS_INLINE unsigned wide_bits(wide_mask mask) { return (unsigned)_mm256_movemask_pd((__m256d)mask); }
#else
ALWAYS_INLINE wide wide_fma(wide a, wide b, wide c)
{
    for (int i = 0; i < PART; i++)
        c[i] = fma(a[i], b[i], c[i]);
    return c;
}
/* Of equal numbers, and where one is none: the second, as the machine's own do. */
ALWAYS_INLINE wide wide_min(wide a, wide b)
{
    for (int i = 0; i < PART; i++)
        b[i] = a[i] < b[i] ? a[i] : b[i];
    return b;
}
ALWAYS_INLINE wide wide_max(wide a, wide b)
{
    for (int i = 0; i < PART; i++)
        b[i] = a[i] > b[i] ? a[i] : b[i];
    return b;
}
ALWAYS_INLINE wide wide_ceil(wide a)
{
    for (int i = 0; i < PART; i++)
        a[i] = ceil(a[i]);
    return a;
}
ALWAYS_INLINE unsigned wide_bits(wide_mask mask)
{
    unsigned bits = 0;
    for (int i = 0; i < PART; i++)
        bits |= (unsigned)(mask[i] & 1) << i;
    return bits;
}
#endif
ALWAYS_INLINE double wide_least(wide a)
{
    double x = a[0] < a[1] ? a[0] : a[1], y = a[2] < a[3] ? a[2] : a[3];
    return x < y ? x : y;
}
#endif

ALWAYS_INLINE double wide_sum(wide a)
{
    double sum = 0;
    for (int i = 0; i < PART; i++)
        sum += a[i];
    return sum;
}

/* ---- Numbers per lane ---- */

ALWAYS_INLINE wide get_part(const double x[LANES], int n)
{
    wide part;
    memcpy(&part, x + PART * n, sizeof part);
    return part;
}

ALWAYS_INLINE void set_part(double x[LANES], int n, wide value) { memcpy(x + PART * n, &value, sizeof value); }

/* Where `mask`; the others keep theirs.  Whole, since what is stored under a mask cannot be loaded again before it has
 * arrived in memory. */
ALWAYS_INLINE void put_part(double x[LANES], int n, wide_mask mask, wide value)
{
    set_part(x, n, wide_select(mask, value, get_part(x, n)));
}

/* ---- The kernel's own vectors ---- */

#if defined(VOL_DOUBLE)
ALWAYS_INLINE wide_mask mask_part(ints mask, int n) { return (void)n, mask; }
ALWAYS_INLINE ints masks_joined(const wide_mask part[PARTS]) { return part[0]; }
ALWAYS_INLINE reals reals_joined(const wide part[PARTS]) { return part[0]; }
#elif defined(WIDE_AVX512)
ALWAYS_INLINE wide_mask mask_part(ints mask, int n)
{
    return (wide_mask)_mm512_movm_epi64((__mmask8)(_mm512_movepi32_mask((__m512i)mask) >> (PART * n)));
}
ALWAYS_INLINE ints masks_joined(const wide_mask part[PARTS])
{
    unsigned bits = wide_bits(part[0]) | wide_bits(part[1]) << PART;
    return (ints)_mm512_movm_epi32((__mmask16)bits);
}
ALWAYS_INLINE reals reals_joined(const wide part[PARTS])
{
    __m256 low = _mm512_cvtpd_ps((__m512d)part[0]), high = _mm512_cvtpd_ps((__m512d)part[1]);
    return (reals)_mm512_insertf32x8(_mm512_castps256_ps512(low), high, 1);
}
#elif defined(REALS_AVX2)
ALWAYS_INLINE wide_mask mask_part(ints mask, int n)
{
    __m256i all = (__m256i)mask;
    return (wide_mask)_mm256_cvtepi32_epi64(n == 0 ? _mm256_castsi256_si128(all) : _mm256_extracti128_si256(all, 1));
}
ALWAYS_INLINE ints masks_joined(const wide_mask part[PARTS])
{
    __m256i pairs = (__m256i)_mm256_shuffle_ps((__m256)part[0], (__m256)part[1], 0x88);
    return (ints)_mm256_permute4x64_epi64(pairs, 0xd8);
}
ALWAYS_INLINE reals reals_joined(const wide part[PARTS])
{
    return (reals)join_halves(_mm256_cvtpd_ps((__m256d)part[0]), _mm256_cvtpd_ps((__m256d)part[1]));
}
#else
ALWAYS_INLINE wide_mask mask_part(ints mask, int n)
{
    wide_mask part;
    for (int i = 0; i < PART; i++)
        part[i] = mask[PART * n + i];
    return part;
}
ALWAYS_INLINE ints masks_joined(const wide_mask part[PARTS])
{
    ints mask;
    for (int i = 0; i < LANES; i++)
        mask[i] = (lane_int)part[i / PART][i % PART];
    return mask;
}
ALWAYS_INLINE reals reals_joined(const wide part[PARTS])
{
    reals x;
    for (int i = 0; i < LANES; i++)
        x[i] = (real)part[i / PART][i % PART];
    return x;
}
#endif

#endif
