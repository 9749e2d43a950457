/* What reals.h promises, for 8 floats in AVX2's registers.  Include reals.h instead. */
#include <immintrin.h>

ALWAYS_INLINE reals reals_fma(reals a, reals b, reals c)
{
    return (reals)_mm256_fmadd_ps((__m256)a, (__m256)b, (__m256)c);
}
ALWAYS_INLINE reals reals_select(ints mask, reals a, reals b)
{
    return (reals)_mm256_blendv_ps((__m256)b, (__m256)a, (__m256)mask);
}
ALWAYS_INLINE reals reals_max(reals a, reals b) { return (reals)_mm256_max_ps((__m256)a, (__m256)b); }
ALWAYS_INLINE reals reals_min(reals a, reals b) { return (reals)_mm256_min_ps((__m256)a, (__m256)b); }
ALWAYS_INLINE reals reals_sqrt(reals a) { return (reals)_mm256_sqrt_ps((__m256)a); }
ALWAYS_INLINE unsigned mask_bits(ints mask) { return (unsigned)_mm256_movemask_ps((__m256)mask); }
ALWAYS_INLINE reals reals_trunc(reals a)
{
    return (reals)_mm256_round_ps((__m256)a, _MM_FROUND_TO_ZERO | _MM_FROUND_NO_EXC);
}

/* ---- Loads ---- */

ALWAYS_INLINE __m256 join_halves(__m128 a, __m128 b) { return _mm256_insertf128_ps(_mm256_castps128_ps256(a), b, 1); }

ALWAYS_INLINE reals load_quad_row(const float *table, const int32_t at[LANES], int i)
{
    return (reals)join_halves(_mm_loadu_ps(table + at[i]), _mm_loadu_ps(table + at[i + 4]));
}

ALWAYS_INLINE void transpose_quads(const reals row[4], reals out[4])
{
    __m256 a = _mm256_unpacklo_ps((__m256)row[0], (__m256)row[1]), b = _mm256_unpackhi_ps((__m256)row[0], (__m256)row[1]);
    __m256 c = _mm256_unpacklo_ps((__m256)row[2], (__m256)row[3]), d = _mm256_unpackhi_ps((__m256)row[2], (__m256)row[3]);
    out[0] = (reals)_mm256_shuffle_ps(a, c, 0x44);
    out[1] = (reals)_mm256_shuffle_ps(a, c, 0xee);
    out[2] = (reals)_mm256_shuffle_ps(b, d, 0x44);
    out[3] = (reals)_mm256_shuffle_ps(b, d, 0xee);
}

ALWAYS_INLINE reals spread_in_quads(reals a, int i)
{
    return i == 0   ? (reals)_mm256_permute_ps((__m256)a, 0x00)
           : i == 1 ? (reals)_mm256_permute_ps((__m256)a, 0x55)
           : i == 2 ? (reals)_mm256_permute_ps((__m256)a, 0xaa)
                    : (reals)_mm256_permute_ps((__m256)a, 0xff);
}

ALWAYS_INLINE reals gather_reals(const float *table, ints index)
{
    return (reals)_mm256_i32gather_ps(table, (__m256i)index, 4);
}
ALWAYS_INLINE ints gather_ints(const int32_t *table, ints index)
{
    return (ints)_mm256_i32gather_epi32(table, (__m256i)index, 4);
}

ALWAYS_INLINE reals pick_reals(const float table[8], ints index)
{
    return (reals)_mm256_permutevar8x32_ps(_mm256_loadu_ps(table), (__m256i)index);
}
ALWAYS_INLINE ints pick_ints(const int32_t table[8], ints index)
{
    return (ints)_mm256_permutevar8x32_epi32(_mm256_loadu_si256((const __m256i *)(const void *)table), (__m256i)index);
}

ALWAYS_INLINE void load_corners_of(const float *const base[LANES], ints offset, reals c[8])
{
    const float *p[LANES];
    int32_t at[LANES] __attribute__((aligned(32)));
    memcpy(at, &offset, sizeof at);
    for (int i = 0; i < LANES; i++)
        p[i] = base[i] + at[i];
    for (int r = 0; r < 4; r++) {
        const int row = corner_row[r];
#define PAIRS(i) load_two_pairs(p[i] + row, p[(i) + 1] + row)
        __m256 l = join_halves(PAIRS(0), PAIRS(4)), h = join_halves(PAIRS(2), PAIRS(6));
#undef PAIRS
        c[2 * r] = (reals)_mm256_shuffle_ps(l, h, 0x88);
        c[2 * r + 1] = (reals)_mm256_shuffle_ps(l, h, 0xdd);
    }
}

/* ---- Sums in double ---- */

ALWAYS_INLINE void doubles_add(Doubles *sum, reals a)
{
    sum->part[0] += (double4)_mm256_cvtps_pd(_mm256_castps256_ps128((__m256)a));
    sum->part[1] += (double4)_mm256_cvtps_pd(_mm256_extractf128_ps((__m256)a, 1));
}

ALWAYS_INLINE reals doubles_round(const Doubles *sum)
{
    return (reals)join_halves(_mm256_cvtpd_ps((__m256d)sum->part[0]), _mm256_cvtpd_ps((__m256d)sum->part[1]));
}
