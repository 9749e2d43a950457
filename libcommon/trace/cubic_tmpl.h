/* A cubic along each ray, s in [0, 1]: its range, where it turns, where it takes a value.
 *
 * PARAMETERS  VOL_DOUBLE
 * PROVIDES    Cubic, cubic_at(), cubic_slope(), largest_term(), cubic_replace(), cubic_range(), turning_points(),
 *             solve_cubic() */
#ifndef VOL_TRACE_CUBIC_TMPL_H
#define VOL_TRACE_CUBIC_TMPL_H

#include "simd/reals.h"

typedef struct Cubic {
    reals a0, a1, a2, a3;
} Cubic;

ALWAYS_INLINE reals cubic_at(const Cubic *c, reals s)
{
    return reals_fma(reals_fma(reals_fma(c->a3, s, c->a2), s, c->a1), s, c->a0);
}

ALWAYS_INLINE reals cubic_slope(const Cubic *c, reals s)
{
    return reals_fma(reals_fma(3 * c->a3, s, 2 * c->a2), s, c->a1);
}

ALWAYS_INLINE reals largest_term(const Cubic *c)
{
    return reals_max(reals_max(reals_abs(c->a0), reals_abs(c->a1)), reals_max(reals_abs(c->a2), reals_abs(c->a3)));
}

/* a where `mask`, else what was there. */
ALWAYS_INLINE void cubic_replace(Cubic *old, ints mask, const Cubic *a)
{
    old->a0 = reals_select(mask, a->a0, old->a0);
    old->a1 = reals_select(mask, a->a1, old->a1);
    old->a2 = reals_select(mask, a->a2, old->a2);
    old->a3 = reals_select(mask, a->a3, old->a3);
}

/* The Bernstein coefficients enclose the cubic on [0, 1]. */
ALWAYS_INLINE void cubic_range(const Cubic *v, reals *lo, reals *hi)
{
    const reals third = reals_all((real)(1.0 / 3.0));
    reals b1 = reals_fma(v->a1, third, v->a0);
    reals b2 = reals_fma(reals_fma(reals_all(2), v->a1, v->a2), third, v->a0);
    reals b3 = ((v->a0 + v->a1) + v->a2) + v->a3;
    *lo = reals_min(reals_min(v->a0, b1), reals_min(b2, b3));
    *hi = reals_max(reals_max(v->a0, b1), reals_max(b2, b3));
}

/* Nearer to an end a turn is one that rounding made: what it changes is lost in the rounding of v.  (In float one such would
 * be in a thousand; there blur_tmpl.h sees to those that matter.) */
#ifdef VOL_DOUBLE
#define TURN_FROM 0x1p-26
#else
#define TURN_FROM 0
#endif

/* Where v'(s) = 0 inside (0, 1), ascending; 1 where there is none.  The quadratic is solved without cancellation. */
static inline void turning_points(const Cubic *v, reals *first, reals *second)
{
    const reals one = reals_all(1);
    reals a = 3 * v->a3, b = 2 * v->a2, c = v->a1;
    reals disc = reals_fma(b, b, -4 * a * c);
    ints real_roots = (ints)(disc > 0);
    reals root = reals_sqrt(reals_select(real_roots, disc, one));
    reals q = (real)-0.5 * (b + reals_select((ints)(b < 0), -root, root));
    reals r0 = q / a, r1 = c / q; /* infinite or NaN where the degree is lower: refused here */
    r0 = reals_select(real_roots & (ints)(r0 > TURN_FROM) & (ints)(r0 < 1 - TURN_FROM), r0, one);
    r1 = reals_select(real_roots & (ints)(r1 > TURN_FROM) & (ints)(r1 < 1 - TURN_FROM), r1, one);
    *first = reals_min(r0, r1);
    *second = reals_max(r0, r1);
}

/* Finds s in [lo, hi], where v is monotone, with v(s) = target: by Halley's iteration within a shrinking bracket, and by
 * bisection wherever a step would leave the bracket.
 *
 * It stops once v(s) - target is no more than the rounding of its own terms, or once the next step would be shorter than a
 * quarter of a unit in the last place of 1: with f = v - target that is about move^3 ((f'' / 2 f')^2 + |f''' / 6 f'|), and
 * |f''| / 2 is at most `bend`.  Near a double root it converges slowly, so the cap is high and bisection takes over. */
static inline reals solve_cubic(const Cubic *v, reals target, reals lo, reals hi, ints mask)
{
    Cubic f = *v;
    f.a0 -= target;
    reals f_lo = cubic_at(&f, lo), f_hi = cubic_at(&f, hi);
    ints outside = (ints)(f_lo == 0) | ~((ints)(f_lo > 0) ^ (ints)(f_hi > 0));
    reals nearest = reals_select((ints)(reals_abs(f_lo) <= reals_abs(f_hi)), lo, hi);
    ints rising = (ints)(f_hi > f_lo), open = mask & ~outside;
    const reals least = reals_all(REAL_EPSILON * (real)0.25);
    reals third = reals_abs(f.a3), bend = reals_fma(reals_all(3), third, reals_abs(f.a2));
    reals noise = least * ((reals_abs(f.a0) + reals_abs(f.a1)) + (reals_abs(f.a2) + third));
    reals s = lo - f_lo * (hi - lo) / (f_hi - f_lo);
    s = reals_min(reals_max(s, lo), hi);
    for (int i = 0; i < 60 && any(open); i++) {
        reals value = cubic_at(&f, s);
        open &= (ints)(reals_abs(value) > noise);
        ints before = ~((ints)(value < 0) ^ rising);
        lo = reals_select(before, s, lo);
        hi = reals_select(before, hi, s);
        reals slope = cubic_slope(&f, s), square = slope * slope;
        reals next = s - value * slope / (square - value * reals_fma(3 * f.a3, s, f.a2));
        ints inside = (ints)(next > lo) & (ints)(next < hi);
        next = reals_select(inside, next, (real)0.5 * (lo + hi));
        open &= (ints)(next > lo) & (ints)(next < hi);
        reals move = reals_abs(next - s), rest = move * move * move * reals_fma(bend, bend, third * reals_abs(slope));
        s = reals_select(open, next, s);
        open &= ~(inside & (ints)(rest <= least * square)) & (ints)(move > least);
    }
    return reals_select(outside, nearest, s);
}

#endif
