/* One trilinear cell under each of LANES rays.
 *
 * With the local entry point p and the local step d from entry to exit, the trilinear field along s in [0, 1] is exactly
 * the cubic v(s) = a0 + a1 s + a2 s^2 + a3 s^3.  With the corner differences
 *     kx = c100-c000, ky, kz;  kxy = c110-c100-c010+c000, kxz, kyz;  kq = c111-c110-c101-c011+c100+c010+c001-c000
 * and y(s) = y0 + y1 s etc.,
 *     v = A(s) + B(s) x(s),  A = c000 + ky y + kz z + kyz y z,  B = kx + kxy y + kxz z + kq y z.
 * Corner n has x = n>>2, y = n>>1&1, z = n&1.
 *
 * PARAMETERS  VOL_DOUBLE
 * PROVIDES    expand_cell(), interpolate_cell(), collapse_cell(), range_of_corners(), judge_at(), all_finite() */
#ifndef VOL_TRACE_TRILINEAR_TMPL_H
#define VOL_TRACE_TRILINEAR_TMPL_H

#include "trace/cubic_tmpl.h"

ALWAYS_INLINE Cubic expand_cell(const reals c[8], const reals p[3], const reals d[3])
{
    reals kx = c[4] - c[0], ky = c[2] - c[0], kz = c[1] - c[0];
    reals kxy = (c[6] - c[4]) - ky, kxz = (c[5] - c[4]) - kz, kyz = (c[3] - c[2]) - kz;
    reals kq = ((c[7] - c[6]) - (c[5] - c[4])) - kyz;
    reals x0 = p[0], y0 = p[1], z0 = p[2], x1 = d[0], y1 = d[1], z1 = d[2];
    reals yz0 = y0 * z0, yz1 = reals_fma(y0, z1, y1 * z0), yz2 = y1 * z1;
    reals A0 = reals_fma(kyz, yz0, reals_fma(kz, z0, reals_fma(ky, y0, c[0])));
    reals A1 = reals_fma(kyz, yz1, reals_fma(kz, z1, ky * y1));
    reals A2 = kyz * yz2;
    reals B0 = reals_fma(kq, yz0, reals_fma(kxz, z0, reals_fma(kxy, y0, kx)));
    reals B1 = reals_fma(kq, yz1, reals_fma(kxz, z1, kxy * y1));
    reals B2 = kq * yz2;
    Cubic v;
    /* All that is added to c000 first, so that only one rounding is of its size; but where that would all but cancel it. */
    reals rest = reals_fma(B0, x0, reals_fma(kyz, yz0, reals_fma(kz, z0, ky * y0)));
    ints small = (ints)(reals_abs(rest) <= (real)0.5 * reals_abs(c[0]));
    v.a0 = reals_select(small, c[0] + rest, reals_fma(B0, x0, A0));
    v.a1 = reals_fma(B0, x1, reals_fma(B1, x0, A1));
    v.a2 = reals_fma(B1, x1, reals_fma(B2, x0, A2));
    v.a3 = B2 * x1;
    return v;
}

/* For rays of `mask`, which lie in a face across axis a, the one at 1 where `high`: that face's corners stand for both, and
 * nothing else has any part in what the rays see. */
ALWAYS_INLINE void collapse_cell(reals c[8], int a, ints mask, ints high)
{
    const int across = 4 >> a;
    for (int n = 0; n < 8; n++) {
        if (n & across)
            continue;
        reals face = reals_select(high, c[n + across], c[n]);
        c[n] = reals_select(mask, face, c[n]);
        c[n + across] = reals_select(mask, face, c[n + across]);
    }
}

/* As reals_mix, but exactly b at t = 1, and not exactly a where b = a. */
ALWAYS_INLINE reals reals_blend(reals a, reals b, reals t) { return reals_fma(t, b, reals_fma(-t, a, a)); }

/* The field at one point of the cell. */
ALWAYS_INLINE reals interpolate_cell(const reals c[8], const reals p[3])
{
    reals z00 = reals_mix(c[0], c[1], p[2]), z01 = reals_mix(c[2], c[3], p[2]);
    reals z10 = reals_mix(c[4], c[5], p[2]), z11 = reals_mix(c[6], c[7], p[2]);
    return reals_mix(reals_mix(z00, z01, p[1]), reals_mix(z10, z11, p[1]), p[0]);
}

static inline ints all_finite(const reals c[8])
{
    reals sum = reals_all(0);
    for (int n = 0; n < 8; n++)
        sum += c[n] * 0;
    return (ints)(sum == 0);
}

/* What a trilinear field cannot leave. */
ALWAYS_INLINE void range_of_corners(const reals c[8], reals *least, reals *most)
{
    reals lo[4], hi[4];
    for (int n = 0; n < 4; n++) {
        lo[n] = reals_min(c[2 * n], c[2 * n + 1]);
        hi[n] = reals_max(c[2 * n], c[2 * n + 1]);
    }
    *least = reals_min(reals_min(lo[0], lo[1]), reals_min(lo[2], lo[3]));
    *most = reals_max(reals_max(hi[0], hi[1]), reals_max(hi[2], hi[3]));
}

/* The field at a point p of a cell, from those corners alone that carry weight there: on a face it stays exactly within the
 * range of the face's corners, however large the others are. */
static inline reals judge_at(const reals c[8], const reals p[3])
{
    reals z[4], y[2];
    for (int n = 0; n < 4; n++)
        z[n] = reals_blend(c[2 * n], c[2 * n + 1], p[2]);
    for (int n = 0; n < 2; n++)
        y[n] = reals_blend(z[2 * n], z[2 * n + 1], p[1]);
    reals v = reals_blend(y[0], y[1], p[0]);
    reals lo = reals_all(INFINITY), hi = -lo;
    ints low[3], high[3];
    for (int a = 0; a < 3; a++) {
        low[a] = ~(ints)(p[a] == 1);
        high[a] = ~(ints)(p[a] == 0);
    }
    for (int n = 0; n < 8; n++) {
        ints in = (n >> 2 ? high[0] : low[0]) & (n >> 1 & 1 ? high[1] : low[1]) & (n & 1 ? high[2] : low[2]);
        lo = reals_select(in, reals_min(lo, c[n]), lo);
        hi = reals_select(in, reals_max(hi, c[n]), hi);
    }
    return reals_min(reals_max(v, lo), hi);
}

#endif
