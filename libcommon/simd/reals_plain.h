/* What reals.h promises, in plain C; doubles' arithmetic in AVX2's registers where there are any.  Include reals.h
 * instead. */
#ifdef REALS_AVX2
#include <immintrin.h>

ALWAYS_INLINE reals reals_fma(reals a, reals b, reals c)
{
    return (reals)_mm256_fmadd_pd((__m256d)a, (__m256d)b, (__m256d)c);
}
ALWAYS_INLINE reals reals_select(ints mask, reals a, reals b)
{
    return (reals)_mm256_blendv_pd((__m256d)b, (__m256d)a, (__m256d)mask);
}
ALWAYS_INLINE ints reals_below(reals a, reals b) { return (ints)(a < b); }
ALWAYS_INLINE reals reals_max(reals a, reals b) { return (reals)_mm256_max_pd((__m256d)a, (__m256d)b); }
ALWAYS_INLINE reals reals_min(reals a, reals b) { return (reals)_mm256_min_pd((__m256d)a, (__m256d)b); }
ALWAYS_INLINE reals reals_sqrt(reals a) { return (reals)_mm256_sqrt_pd((__m256d)a); }
ALWAYS_INLINE unsigned mask_bits(ints mask) { return (unsigned)_mm256_movemask_pd((__m256d)mask); }
ALWAYS_INLINE reals reals_trunc(reals a)
{
    return (reals)_mm256_round_pd((__m256d)a, _MM_FROUND_TO_ZERO | _MM_FROUND_NO_EXC);
}
#else
ALWAYS_INLINE reals reals_fma(reals a, reals b, reals c)
{
    for (int i = 0; i < LANES; i++)
        c[i] = real_fma(a[i], b[i], c[i]);
    return c;
}
ALWAYS_INLINE reals reals_select(ints mask, reals a, reals b) { return (reals)(((ints)a & mask) | ((ints)b & ~mask)); }
#ifdef VOL_DOUBLE
/* Two and two: what is wider than the machine's vectors the compiler would make number by number. */
typedef double double2 __attribute__((vector_size(16)));
typedef union Pairs {
    reals all;
    double2 pair[2];
} Pairs;
ALWAYS_INLINE ints reals_below(reals a, reals b)
{
    Pairs x = {a}, y = {b};
    for (int i = 0; i < 2; i++)
        x.pair[i] = (double2)(x.pair[i] < y.pair[i]);
    return (ints)x.all;
}
#else
ALWAYS_INLINE ints reals_below(reals a, reals b) { return (ints)(a < b); }
#endif
ALWAYS_INLINE reals reals_max(reals a, reals b) { return reals_select(reals_below(b, a), a, b); }
ALWAYS_INLINE reals reals_min(reals a, reals b) { return reals_select(reals_below(a, b), a, b); }
ALWAYS_INLINE reals reals_sqrt(reals a)
{
    for (int i = 0; i < LANES; i++)
        a[i] = real_sqrt(a[i]);
    return a;
}
ALWAYS_INLINE unsigned mask_bits(ints mask)
{
    unsigned bits = 0;
    for (int i = 0; i < LANES; i++)
        bits |= (unsigned)(mask[i] & 1) << i;
    return bits;
}
ALWAYS_INLINE reals reals_trunc(reals a)
{
    return __builtin_convertvector(__builtin_convertvector(a, ints), reals);
}
#endif

/* ---- Loads ---- */

ALWAYS_INLINE reals load_quad_row(const real *table, const lane_int at[LANES], int i)
{
    real row[LANES];
    reals out;
    for (int n = 0; n < LANES; n += 4)
        memcpy(row + n, table + at[i + n], 4 * sizeof *row);
    memcpy(&out, row, sizeof out);
    return out;
}

ALWAYS_INLINE void transpose_quads(const reals row[4], reals out[4])
{
    for (int k = 0; k < 4; k++) {
        real column[LANES];
        for (int n = 0; n < LANES; n++)
            column[n] = row[n % 4][n / 4 * 4 + k];
        memcpy(&out[k], column, sizeof column);
    }
}

ALWAYS_INLINE reals spread_in_quads(reals a, int i)
{
    reals out = a;
    for (int n = 0; n < LANES; n++)
        out[n] = a[n / 4 * 4 + i];
    return out;
}

ALWAYS_INLINE reals gather_reals(const real *table, ints index)
{
    reals out;
    for (int i = 0; i < LANES; i++)
        out[i] = table[index[i]];
    return out;
}
ALWAYS_INLINE ints gather_ints(const int32_t *table, ints index)
{
    ints out;
    for (int i = 0; i < LANES; i++)
        out[i] = table[index[i]];
    return out;
}

ALWAYS_INLINE reals pick_reals(const real table[8], ints index) { return gather_reals(table, index); }
ALWAYS_INLINE ints pick_ints(const int32_t table[8], ints index) { return gather_ints(table, index); }

ALWAYS_INLINE void load_corners_of(const real *const base[LANES], ints offset, reals c[8])
{
    for (int r = 0; r < 4; r++) {
        real low[LANES], high[LANES];
        for (int i = 0; i < LANES; i++) {
            low[i] = base[i][offset[i] + corner_row[r]];
            high[i] = base[i][offset[i] + corner_row[r] + 1];
        }
        memcpy(&c[2 * r], low, sizeof low);
        memcpy(&c[2 * r + 1], high, sizeof high);
    }
}

/* ---- Sums in double ---- */

ALWAYS_INLINE void doubles_add(Doubles *sum, reals a)
{
#ifdef VOL_DOUBLE
    sum->part[0] += a;
#else
    for (int n = 0; n < LANES; n++)
        sum->part[n / 4][n % 4] += (double)a[n];
#endif
}

ALWAYS_INLINE reals doubles_round(const Doubles *sum)
{
#ifdef VOL_DOUBLE
    return sum->part[0];
#else
    reals out;
    for (int n = 0; n < LANES; n++)
        out[n] = (real)sum->part[n / 4][n % 4];
    return out;
#endif
}

#ifdef VOL_DOUBLE
/* Half i of a, then that of b. */
ALWAYS_INLINE reals reals_halves(reals a, reals b, int i)
{
#ifdef REALS_AVX2
    return i ? __builtin_shufflevector(a, b, 2, 3, 6, 7) : __builtin_shufflevector(a, b, 0, 1, 4, 5);
#else
    return ((Pairs){.pair = {((Pairs){a}).pair[i], ((Pairs){b}).pair[i]}}).all;
#endif
}
#endif
