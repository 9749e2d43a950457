/* What reals.h promises, for 16 floats in AVX-512's registers.  Include reals.h instead. */
#include <immintrin.h>

ALWAYS_INLINE reals reals_fma(reals a, reals b, reals c)
{
    return (reals)_mm512_fmadd_ps((__m512)a, (__m512)b, (__m512)c);
}
ALWAYS_INLINE reals reals_select(ints mask, reals a, reals b)
{
    return (reals)_mm512_ternarylogic_epi32((__m512i)mask, (__m512i)a, (__m512i)b, 0xca);
}
ALWAYS_INLINE reals reals_max(reals a, reals b) { return (reals)_mm512_max_ps((__m512)a, (__m512)b); }
ALWAYS_INLINE reals reals_min(reals a, reals b) { return (reals)_mm512_min_ps((__m512)a, (__m512)b); }
ALWAYS_INLINE reals reals_sqrt(reals a) { return (reals)_mm512_sqrt_ps((__m512)a); }
ALWAYS_INLINE unsigned mask_bits(ints mask) { return _mm512_movepi32_mask((__m512i)mask); }
ALWAYS_INLINE reals reals_trunc(reals a)
{
    return (reals)_mm512_roundscale_ps((__m512)a, _MM_FROUND_TO_ZERO | _MM_FROUND_NO_EXC);
}

/* ---- Loads ---- */

ALWAYS_INLINE __m512 join_quarters(__m128 a, __m128 b, __m128 c, __m128 d)
{
    __m512 low = _mm512_insertf32x4(_mm512_castps128_ps512(a), b, 1);
    return _mm512_insertf32x4(_mm512_insertf32x4(low, c, 2), d, 3);
}

ALWAYS_INLINE reals load_quad_row(const float *table, const int32_t at[LANES], int i)
{
    return (reals)join_quarters(_mm_loadu_ps(table + at[i]), _mm_loadu_ps(table + at[i + 4]),
                                _mm_loadu_ps(table + at[i + 8]), _mm_loadu_ps(table + at[i + 12]));
}

ALWAYS_INLINE void transpose_quads(const reals row[4], reals out[4])
{
    __m512 a = _mm512_unpacklo_ps((__m512)row[0], (__m512)row[1]), b = _mm512_unpackhi_ps((__m512)row[0], (__m512)row[1]);
    __m512 c = _mm512_unpacklo_ps((__m512)row[2], (__m512)row[3]), d = _mm512_unpackhi_ps((__m512)row[2], (__m512)row[3]);
    out[0] = (reals)_mm512_shuffle_ps(a, c, 0x44);
    out[1] = (reals)_mm512_shuffle_ps(a, c, 0xee);
    out[2] = (reals)_mm512_shuffle_ps(b, d, 0x44);
    out[3] = (reals)_mm512_shuffle_ps(b, d, 0xee);
}

ALWAYS_INLINE reals spread_in_quads(reals a, int i)
{
    return i == 0   ? (reals)_mm512_permute_ps((__m512)a, 0x00)
           : i == 1 ? (reals)_mm512_permute_ps((__m512)a, 0x55)
           : i == 2 ? (reals)_mm512_permute_ps((__m512)a, 0xaa)
                    : (reals)_mm512_permute_ps((__m512)a, 0xff);
}

ALWAYS_INLINE reals gather_reals(const float *table, ints index)
{
    return (reals)_mm512_i32gather_ps((__m512i)index, table, 4);
}
ALWAYS_INLINE ints gather_ints(const int32_t *table, ints index)
{
    return (ints)_mm512_i32gather_epi32((__m512i)index, table, 4);
}

ALWAYS_INLINE reals pick_reals(const float table[8], ints index)
{
    return (reals)_mm512_permutexvar_ps((__m512i)index, _mm512_castps256_ps512(_mm256_loadu_ps(table)));
}
ALWAYS_INLINE ints pick_ints(const int32_t table[8], ints index)
{
    __m256i all = _mm256_loadu_si256((const __m256i *)(const void *)table);
    return (ints)_mm512_permutexvar_epi32((__m512i)index, _mm512_castsi256_si512(all));
}

ALWAYS_INLINE void load_corners_of(const float *const base[LANES], ints offset, reals c[8])
{
    const float *p[LANES];
    int32_t at[LANES] __attribute__((aligned(64)));
    memcpy(at, &offset, sizeof at);
    for (int i = 0; i < LANES; i++)
        p[i] = base[i] + at[i];
    for (int r = 0; r < 4; r++) {
        const int row = corner_row[r];
#define PAIRS(i) load_two_pairs(p[i] + row, p[(i) + 1] + row)
        __m512 l = join_quarters(PAIRS(0), PAIRS(4), PAIRS(8), PAIRS(12));
        __m512 h = join_quarters(PAIRS(2), PAIRS(6), PAIRS(10), PAIRS(14));
#undef PAIRS
        c[2 * r] = (reals)_mm512_shuffle_ps(l, h, 0x88);
        c[2 * r + 1] = (reals)_mm512_shuffle_ps(l, h, 0xdd);
    }
}

/* ---- Sums in double ---- */

ALWAYS_INLINE void doubles_add(Doubles *sum, reals a)
{
    for (int n = 0; n < LANES / 4; n++) {
        float4 some;
        memcpy(&some, (const char *)&a + n * (int)sizeof some, sizeof some);
        sum->part[n] += (double4)_mm256_cvtps_pd((__m128)some);
    }
}

ALWAYS_INLINE reals doubles_round(const Doubles *sum)
{
    __m128 part[LANES / 4];
    for (int n = 0; n < LANES / 4; n++)
        part[n] = _mm256_cvtpd_ps((__m256d)sum->part[n]);
    return (reals)join_quarters(part[0], part[1], part[2], part[3]);
}
