/* The three coordinates of one lane in a register, beside a fourth that means nothing: double for places along rays, `real`
 * for those within a brick.
 *
 * PROVIDES    axes, axes_mask; axes_of(), axes_all(), axes_select(), axes_fma(), axes_min(), axes_max(),
 *             axes_least(); local_axes, local_mask, local_of(), local_all(), local_select(), local_fma(), local_min(),
 *             local_max(), local_all_set() */
#ifndef VOL_SIMD_AXES_H
#define VOL_SIMD_AXES_H

#include "simd/reals.h"

typedef double axes __attribute__((vector_size(4 * sizeof(double))));
typedef int64_t axes_mask __attribute__((vector_size(4 * sizeof(int64_t))));

ALWAYS_INLINE axes axes_of(double x, double y, double z) { return (axes){x, y, z, 0}; }
ALWAYS_INLINE axes axes_all(double a) { return a - (axes){0}; }
ALWAYS_INLINE axes axes_select(axes_mask mask, axes a, axes b)
{
    return (axes)(((axes_mask)a & mask) | ((axes_mask)b & ~mask));
}
/* Of equal numbers, and where one is none: the second. */
ALWAYS_INLINE axes axes_min(axes a, axes b) { return axes_select((axes_mask)(a < b), a, b); }
ALWAYS_INLINE axes axes_max(axes a, axes b) { return axes_select((axes_mask)(a > b), a, b); }
ALWAYS_INLINE double axes_least(axes a)
{
    double least = a[0] < a[1] ? a[0] : a[1];
    return least < a[2] ? least : a[2];
}

#if defined(REALS_AVX2) || defined(REALS_AVX512)
ALWAYS_INLINE axes axes_fma(axes a, axes b, axes c) { return (axes)_mm256_fmadd_pd((__m256d)a, (__m256d)b, (__m256d)c); }
#else
ALWAYS_INLINE axes axes_fma(axes a, axes b, axes c)
{
    for (int i = 0; i < 3; i++)
        c[i] = fma(a[i], b[i], c[i]);
    return c;
}
#endif

/* ---- Of the kernel's precision ---- */

#ifdef VOL_DOUBLE
typedef axes local_axes;
typedef axes_mask local_mask;
ALWAYS_INLINE local_axes local_fma(local_axes a, local_axes b, local_axes c) { return axes_fma(a, b, c); }
#else
typedef float local_axes __attribute__((vector_size(4 * sizeof(float))));
typedef int32_t local_mask __attribute__((vector_size(4 * sizeof(int32_t))));
#if defined(REALS_AVX2) || defined(REALS_AVX512)
ALWAYS_INLINE local_axes local_fma(local_axes a, local_axes b, local_axes c)
{
    return (local_axes)_mm_fmadd_ps((__m128)a, (__m128)b, (__m128)c);
}
#else
ALWAYS_INLINE local_axes local_fma(local_axes a, local_axes b, local_axes c)
{
    for (int i = 0; i < 3; i++)
        c[i] = real_fma(a[i], b[i], c[i]);
    return c;
}
#endif
#endif

ALWAYS_INLINE local_axes local_of(real x, real y, real z) { return (local_axes){x, y, z, 0}; }
ALWAYS_INLINE local_axes local_all(real a) { return a - (local_axes){0}; }
ALWAYS_INLINE local_axes local_select(local_mask mask, local_axes a, local_axes b)
{
    return (local_axes)(((local_mask)a & mask) | ((local_mask)b & ~mask));
}
/* Whether the mask is set for all three. */
ALWAYS_INLINE bool local_all_set(local_mask mask) { return mask[0] & mask[1] & mask[2]; }
ALWAYS_INLINE local_axes local_min(local_axes a, local_axes b) { return local_select((local_mask)(a < b), a, b); }
ALWAYS_INLINE local_axes local_max(local_axes a, local_axes b) { return local_select((local_mask)(a > b), a, b); }

#endif
