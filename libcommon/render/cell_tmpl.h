/* One trilinear cell under a ray.
 *
 * With the local entry point p0 and the local step p1 from entry to exit, the trilinear field along s in [0, 1] is exactly
 * the cubic v(s) = a0 + a1 s + a2 s^2 + a3 s^3.  With the corner differences
 *     kx = c100-c000, ky, kz;  kxy = c110-c100-c010+c000, kxz, kyz;  kq = c111-c110-c101-c011+c100+c010+c001-c000
 * and y(s) = y0 + y1 s etc.,
 *     v = A(s) + B(s) x(s),  A = c000 + ky y + kz z + kyz y z,  B = kx + kxy y + kxz z + kq y z.
 * Include real.h first. */
#ifndef VOL_RENDER_CELL_TMPL_H
#define VOL_RENDER_CELL_TMPL_H

#include <stdbool.h>

#include "grid/grid.h"

typedef struct Cubic {
    real a0, a1, a2, a3;
} Cubic;

static inline real cubic_at(const Cubic *c, real s)
{
    return real_fma(real_fma(real_fma(c->a3, s, c->a2), s, c->a1), s, c->a0);
}

static inline real cubic_slope(const Cubic *c, real s)
{
    return real_fma(real_fma(3 * c->a3, s, 2 * c->a2), s, c->a1);
}

/* Corner n has x = n>>2, y = n>>1&1, z = n&1. */
static inline void load_corners(const VolGrid *grid, const VolBrick *brick, const int32_t cell[3], real c[8])
{
    size_t at = (size_t)brick->storage * VOL_BRICK_STRIDE +
                (size_t)((cell[0] * VOL_BRICK_SIDE + cell[1]) * VOL_BRICK_SIDE + cell[2]);
    static const int offset[8] = {0, 1, 9, 10, 81, 82, 90, 91};
    if (grid->is_double)
        for (int n = 0; n < 8; n++)
            c[n] = (real)((const double *)grid->values)[at + (size_t)offset[n]];
    else
        for (int n = 0; n < 8; n++)
            c[n] = (real)((const float *)grid->values)[at + (size_t)offset[n]];
}

static inline Cubic expand_cell(const real c[8], const real p[3], const real d[3])
{
    real kx = c[4] - c[0], ky = c[2] - c[0], kz = c[1] - c[0];
    real kxy = (c[6] - c[4]) - ky, kxz = (c[5] - c[4]) - kz, kyz = (c[3] - c[2]) - kz;
    real kq = ((c[7] - c[6]) - (c[5] - c[4])) - kyz;
    real x0 = p[0], y0 = p[1], z0 = p[2], x1 = d[0], y1 = d[1], z1 = d[2];
    real yz0 = y0 * z0, yz1 = real_fma(y0, z1, y1 * z0), yz2 = y1 * z1;
    real A0 = real_fma(kyz, yz0, real_fma(kz, z0, real_fma(ky, y0, c[0])));
    real A1 = real_fma(kyz, yz1, real_fma(kz, z1, ky * y1));
    real A2 = kyz * yz2;
    real B0 = real_fma(kq, yz0, real_fma(kxz, z0, real_fma(kxy, y0, kx)));
    real B1 = real_fma(kq, yz1, real_fma(kxz, z1, kxy * y1));
    real B2 = kq * yz2;
    Cubic v;
    v.a0 = real_fma(B0, x0, A0);
    v.a1 = real_fma(B0, x1, real_fma(B1, x0, A1));
    v.a2 = real_fma(B1, x1, real_fma(B2, x0, A2));
    v.a3 = B2 * x1;
    return v;
}

/* The Bernstein coefficients enclose the cubic on [0, 1]. */
static inline void cubic_range(const Cubic *v, real *lo, real *hi)
{
    const real third = (real)(1.0 / 3.0);
    real b1 = real_fma(v->a1, third, v->a0);
    real b2 = real_fma(real_fma(2, v->a1, v->a2), third, v->a0);
    real b3 = ((v->a0 + v->a1) + v->a2) + v->a3;
    *lo = real_min(real_min(v->a0, b1), real_min(b2, b3));
    *hi = real_max(real_max(v->a0, b1), real_max(b2, b3));
}

/* v at a point p of a cell, kept within the corners that carry weight there: on a face, exactly within that face. */
static inline real clamp_to_corners(real v, const real c[8], const real p[3])
{
    real lo = INFINITY, hi = -INFINITY;
    for (int n = 0; n < 8; n++) {
        bool out = false;
        for (int a = 0; a < 3; a++) {
            int high = n >> (2 - a) & 1;
            out = out || (high && p[a] == 0) || (!high && p[a] == 1);
        }
        if (out)
            continue;
        lo = real_min(lo, c[n]);
        hi = real_max(hi, c[n]);
    }
    return real_clamp(v, lo, hi);
}

/* Where v'(s) = 0 inside (0, 1), ascending; at most two.  The quadratic is solved without cancellation. */
static inline int turning_points(const Cubic *v, real s[2])
{
    real a = 3 * v->a3, b = 2 * v->a2, c = v->a1;
    real disc = real_fma(b, b, -4 * a * c);
    if (!(disc > 0))
        return 0;
    real q = (real)-0.5 * (b + (b < 0 ? -real_sqrt(disc) : real_sqrt(disc)));
    real r0 = q / a, r1 = c / q; /* infinite or NaN where the degree is lower: refused below */
    int n = 0;
    if (r0 > 0 && r0 < 1)
        s[n++] = r0;
    if (r1 > 0 && r1 < 1 && r1 != r0)
        s[n++] = r1;
    if (n == 2 && s[0] > s[1]) {
        real t = s[0];
        s[0] = s[1];
        s[1] = t;
    }
    return n;
}

/* s in [lo, hi], where v is monotone, with v(s) = target: Newton kept inside a shrinking bracket.  Near a double root
 * Newton alone converges slowly, so the cap is high and bisection takes over. */
static inline real solve_cubic(const Cubic *v, real target, real lo, real hi)
{
    Cubic f = *v;
    f.a0 -= target;
    real f_lo = cubic_at(&f, lo), f_hi = cubic_at(&f, hi);
    if (f_lo == 0 || (f_lo > 0) == (f_hi > 0))
        return real_abs(f_lo) <= real_abs(f_hi) ? lo : hi;
    bool rising = f_hi > f_lo;
    real s = real_clamp(lo - f_lo * (hi - lo) / (f_hi - f_lo), lo, hi);
    for (int i = 0; i < 60; i++) {
        real value = cubic_at(&f, s);
        if (value == 0)
            break;
        if ((value < 0) == rising)
            lo = s;
        else
            hi = s;
        real next = s - value / cubic_slope(&f, s);
        if (!(next > lo && next < hi))
            next = (real)0.5 * (lo + hi);
        if (!(next > lo && next < hi) || real_abs(next - s) <= REAL_EPSILON * (real)0.25 * real_abs(s))
            break;
        s = next;
    }
    return s;
}

#endif
