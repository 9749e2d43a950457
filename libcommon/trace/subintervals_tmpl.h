/* Sub-intervals of rays for the exact estimator (exact_tmpl.h has the derivation): parts of a cell's segments within one
 * interval of the transfer function, their optical depth in closed form, their light by Gauss-Legendre quadrature.
 *
 * PARAMETERS  VOL_DOUBLE; VOL_TRAVERSAL
 * PROVIDES    Exact; cell_time(), take_gradients(), end_of_gentle_turn(), end_of_even_light(), shade_at(); SubInterval, cut_sub_interval(),
 *             optical_depth_to(), largest_optical_depth(), sub_interval_light(), channel_is_lit() */
#ifndef VOL_TRACE_SUBINTERVALS_TMPL_H
#define VOL_TRACE_SUBINTERVALS_TMPL_H

#include VOL_TRAVERSAL

#include "trace/accumulate_tmpl.h"
#include "trace/fall_off.h"
#include "trace/source_tmpl.h"

/* The exact estimator's state: a ray packet, and the cell that each ray is in. */
typedef struct Exact {
    RayPacket packet;
    Traversal way;
    Accumulator sum;

    /* The cell being integrated. */
    ints in_cell, gradients_known;
    Cubic v;
    CellPlace place;
    reals begin, length;      /* world units from the stretch's beginning */
    Cubic gradient[3];        /* world space, times gradient_scale (a power of two), where gradients_known */
    reals gradient_scale;
    ints steady;              /* the normal turns little, and to no other side of viewer or lights, anywhere in the cell */
    reals least, most;        /* where the kernel or the scene asks for it: v never leaves them */
    reals turn[2];            /* where v turns; 1: nowhere */
    ints many;                /* to be cut at knots or where v turns */
    ints interval;            /* that the next segment lies in */

    /* v runs in monotone legs from turn to turn; knots and isosurfaces cut a leg into segments. */
    ints turns_passed, leg_begun;
    reals leg_s, leg_v;       /* where the leg ends, and the field there */
    reals s, stop;            /* the segment */
    reals va, stop_v;         /* the field at its ends */
    ints stop_step;           /* what its end does to the interval: -1, 0, 1 */
    ints ends_leg;            /* it ends the leg */
    ints rises;               /* v did on the last segment with something in it */
    Cubic run;                /* v - va along it, u in [0, 1]; a0 = 0 */
    reals done;               /* u up to which it is integrated */

    ints meets_iso;
    reals exit;               /* the field at the cell's exit */
    size_t event_first[LANES], event_last[LANES]; /* the isosurfaces at `stop` */
} Exact;

static inline double cell_time(const Exact *k, unsigned i, real s)
{
    return stretch_begin(&k->way)[i] + (double)(k->begin[i] + s * k->length[i]);
}

/* ---- Shading inside a cell ---- */

/* Where the cells begin, as times along the rays. */
ALWAYS_INLINE reals cell_times(const Exact *k)
{
    reals t0;
    for (int i = 0; i < LANES; i++)
        t0[i] = (real)stretch_begin(&k->way)[i];
    return t0 + k->begin;
}

/* f = m0 + m1 y + m2 y^2 + m3 y^3 with y = 2 s - 1, from -1 to 1 in the cell. */
ALWAYS_INLINE void about_middle(const Cubic *f, reals m[4])
{
    reals half = (real)0.5 * f->a1, quarter = (real)0.25 * f->a2;
    m[3] = (real)0.125 * f->a3;
    m[2] = reals_fma(reals_all(3), m[3], quarter);
    m[1] = reals_fma(reals_all(3), m[3], half + 2 * quarter);
    m[0] = f->a0 + half + quarter + m[3];
}

/* Whether all of the cell's gradients, about its middle m[n], are on the same side of a light: their product with `to` + y
 * `change` has no zero where |f1| + |f2| + |f3| + |f4| < |f0|. */
static inline ints all_on_one_side(const reals m[4][3], const reals to[3], const reals change[3])
{
    reals f0 = dot3(m[0], to), rest = reals_abs(dot3(m[3], change));
    for (int n = 1; n < 4; n++)
        rest += reals_abs(dot3(m[n], to) + dot3(m[n - 1], change));
    return (ints)(rest < reals_abs(f0));
}

/* Whether every normal of the cell lies within 26 degrees of every other, on the same side of the viewer and of each light,
 * and no gradient is much shorter than another: with the gradient m0 + m1 y + m2 y^2 + m3 y^3,
 * |m1| + |m2| + |m3| <= |m0| / 5 keeps all within 11.6 degrees of m0 and a fifth of its length. */
static inline ints is_steady(const Exact *k, const Cubic gradient[3])
{
    const VolScene *scene = k->packet.scene;
    reals m[4][3], to[3], change[3], none[3] = {{0}};
    for (int a = 0; a < 3; a++) {
        reals of_axis[4];
        about_middle(&gradient[a], of_axis);
        for (int n = 0; n < 4; n++)
            m[n][a] = of_axis[n];
    }
    reals around = reals_sqrt(dot3(m[1], m[1])) + reals_sqrt(dot3(m[2], m[2])) + reals_sqrt(dot3(m[3], m[3]));
    ints steady = (ints)(25 * around * around <= dot3(m[0], m[0]));
    steady &= all_on_one_side((const reals(*)[3])m, k->packet.view, none);
    for (size_t n = 0; n < scene->light_count; n++) {
        const VolLight *light = &scene->lights[n];
        if (light->kind == VOL_LIGHT_HEAD)
            continue;
        towards_light(&k->packet, light, reals_fma(k->length, reals_all((real)0.5), cell_times(k)), to);
        for (int a = 0; a < 3; a++)
            change[a] = light->kind == VOL_LIGHT_SUN ? none[a] : (real)0.5 * k->length * k->packet.view[a];
        steady &= all_on_one_side((const reals(*)[3])m, to, change);
    }
    return steady;
}

/* The gradients of the cells of `mask`, scaled so that their squares neither overflow nor vanish. */
static inline void take_gradients(Exact *k, ints mask)
{
    ints wanted = mask & ~k->gradients_known;
    if (!any(wanted))
        return;
    Cubic world[3];
    reals largest = reals_all(0);
    traversal_gradients(&k->way, &k->packet, &k->place, wanted, world);
    for (int a = 0; a < 3; a++) {
        const reals some[4] = {world[a].a0, world[a].a1, world[a].a2, world[a].a3};
        for (int n = 0; n < 4; n++)
            largest = reals_max(largest, reals_abs(some[n]));
    }
    reals scale = scale_for(largest);
    for (int a = 0; a < 3; a++) {
        Cubic fresh = {world[a].a0 * scale, world[a].a1 * scale, world[a].a2 * scale, world[a].a3 * scale};
        cubic_replace(&k->gradient[a], wanted, &fresh);
    }
    k->gradient_scale = reals_select(wanted, scale, k->gradient_scale);
    k->steady = ints_select(wanted, is_steady(k, k->gradient), k->steady);
    k->gradients_known |= wanted;
}

ALWAYS_INLINE void gradients_at(const Exact *k, reals s, reals out[3])
{
    for (int a = 0; a < 3; a++)
        out[a] = cubic_at(&k->gradient[a], s);
}

/* At `count` places s of each cell. */
ALWAYS_INLINE void shade_at(const Exact *k, int count, const reals *s, Shading *out)
{
    reals gradient[SHADINGS_MOST][3], t[SHADINGS_MOST], begin = cell_times(k);
    for (int n = 0; n < count; n++) {
        gradients_at(k, s[n], gradient[n]);
        t[n] = reals_fma(s[n], k->length, begin);
    }
    shade_scaled(&k->packet, count, (const reals(*)[3])gradient, t, out);
    for (int n = 0; n < count; n++)
        out[n].gradient /= k->gradient_scale;
}

/* Whether the normal turns by more than 18 degrees from a to b. */
ALWAYS_INLINE ints turns(const reals a[3], const reals b[3])
{
    reals aa = dot3(a, a), bb = dot3(b, b), ab = dot3(a, b);
    return (ints)(ab < 0) | (ints)(ab * ab < (real)0.9 * aa * bb);
}

/* Whether the gradient bends so much that it may all but vanish in between: the second difference against the middle. */
ALWAYS_INLINE ints bends(const reals a[3], const reals m[3], const reals b[3])
{
    reals second[3];
    for (int i = 0; i < 3; i++)
        second[i] = (a[i] - m[i]) + (b[i] - m[i]);
    return (ints)(dot3(second, second) > (real)0.1 * dot3(m, m));
}

/* Whether the normal does most of its turning near the end where the gradient is shorter: the gradient's length changes
 * much, and its direction with it.  For a gradient a + b s the normal has poles at |s| = |a| / |b|; the quadrature
 * resolves a stretch up to 4 times that long (rho = 2.6).  Turns of less than half a degree do not matter. */
ALWAYS_INLINE ints turns_at_an_end(const reals a[3], const reals b[3])
{
    reals aa = dot3(a, a), bb = dot3(b, b), ab = dot3(a, b);
    ints uneven = (ints)(aa > 25 * bb) | (ints)(bb > 25 * aa);
    return uneven & (ints)(ab * ab < (real)0.9999 * aa * bb);
}

/* Where the gradient's product with `to` is 0 between sa and sb, else sb; what is 0 but for rounding has no side. */
static inline reals side_limit(const Exact *k, const reals to[3], reals sa, reals sb, ints mask)
{
    const Cubic *g = k->gradient;
    Cubic f = {dot3((reals[]){g[0].a0, g[1].a0, g[2].a0}, to), dot3((reals[]){g[0].a1, g[1].a1, g[2].a1}, to),
               dot3((reals[]){g[0].a2, g[1].a2, g[2].a2}, to), dot3((reals[]){g[0].a3, g[1].a3, g[2].a3}, to)};
    reals none = 4 * REAL_EPSILON * (reals_abs(f.a0) + reals_abs(f.a1) + reals_abs(f.a2) + reals_abs(f.a3));
    reals turn[2], side[4];
    turning_points(&f, &turn[0], &turn[1]);
    /* Between these f is monotone: no pair of zeros stays unseen. */
    reals at[4] = {sa, reals_min(reals_max(turn[0], sa), sb), reals_min(reals_max(turn[1], sa), sb), sb};
    for (int n = 0; n < 4; n++) {
        side[n] = cubic_at(&f, at[n]);
        side[n] = reals_where((ints)(reals_abs(side[n]) > none), side[n]);
    }
    ints crossed = {0};
    reals lo = sa, hi = sb;
    for (int n = 2; n >= 0; n--) {
        ints here = mask & (ints)(side[n] * side[n + 1] < 0);
        crossed |= here;
        lo = reals_select(here, at[n], lo);
        hi = reals_select(here, at[n + 1], hi);
    }
    if (!any(crossed))
        return sb;
    reals zero = solve_cubic(&f, reals_all(0), lo, hi, crossed);
    return reals_select(crossed & (ints)(zero > sa), zero, sb);
}

/* The first place between sa and sb where a light begins or ceases to shine on the surface, else sb.  The direction towards
 * a light with a position changes along the ray, but slowly: the root is found for a fixed direction, then again for the
 * direction at that root. */
static reals light_limit(const Exact *k, const VolLight *light, reals sa, reals sb, ints mask)
{
    int looks = light->kind == VOL_LIGHT_SUN ? 1 : 3;
    reals s = (real)0.5 * (sa + sb), to[3];
    for (int n = 0; n < looks; n++) {
        towards_light(&k->packet, light, reals_fma(s, k->length, cell_times(k)), to);
        s = side_limit(k, to, sa, sb, mask);
    }
    return s;
}

/* Where the normal flips to face the viewer, or a light begins or ceases to shine on it, between sa and sb, else sb. */
static inline reals kink_limit(const Exact *k, reals sa, reals sb, ints mask)
{
    const VolScene *scene = k->packet.scene;
    sb = side_limit(k, k->packet.view, sa, sb, mask);
    for (size_t n = 0; n < scene->light_count; n++)
        if (scene->lights[n].kind != VOL_LIGHT_HEAD)
            sb = light_limit(k, &scene->lights[n], sa, sb, mask);
    return sb;
}

/* |gradient|^2 - square, along the cell. */
ALWAYS_INLINE reals length_beyond(const Exact *k, reals s, reals square)
{
    reals g[3];
    gradients_at(k, s, g);
    return dot3(g, g) - square;
}

/* Surfaceness by gradient magnitude (K 11) has a kink at either end of its ramp.  The first place between sa and sb where
 * the magnitude passes one of these ends, else sb.  The squared magnitude is nearly a parabola, whose vertex reveals a
 * pair of passages that the values at sa and sb do not show. */
static reals ramp_limit(const Exact *k, real magnitude, reals sa, reals sb, ints mask)
{
    enum { HALVINGS = sizeof(real) == sizeof(float) ? 24 : 53 };
    reals edge = magnitude * k->gradient_scale, square = edge * edge, half = (real)0.5 * (sb - sa), middle = sa + half;
    /* Begin just beyond sa: at sa itself, the last passage, rounding would decide. */
    reals ahead = reals_fma(half, reals_all((real)0x1p-10), sa);
    reals fa = length_beyond(k, ahead, square), fm = length_beyond(k, middle, square), fb = length_beyond(k, sb, square);
    reals vertex = middle - (real)0.5 * half * (fb - fa) / ((fa - fm) + (fb - fm));
    ints below = (ints)(fa < 0), inside = mask & (ints)(vertex > ahead) & (ints)(vertex < sb);
    vertex = reals_select(inside, vertex, middle);
    reals fv = length_beyond(k, vertex, square);
    ints dips = mask & (below ^ (ints)(fv < 0)), passed = dips | (mask & (below ^ (ints)(fb < 0)));
    reals lo = ahead, hi = reals_select(dips, vertex, sb);
    for (int n = 0; n < HALVINGS && any(passed); n++) {
        middle = (real)0.5 * (lo + hi);
        ints before = ~(below ^ (ints)(length_beyond(k, middle, square) < 0));
        lo = reals_select(before, middle, lo);
        hi = reals_select(before, hi, middle);
    }
    return reals_select(passed, hi, sb);
}

/* Whether the gradient's length, which is a root, changes so much that it has a branch point nearby. */
ALWAYS_INLINE ints is_uneven(const reals a[3], const reals m[3], const reals b[3])
{
    reals aa = dot3(a, a), mm = dot3(m, m), bb = dot3(b, b);
    return (ints)(reals_max(reals_max(aa, bb), mm) > 4 * reals_min(reals_min(aa, bb), mm));
}

/* Shading is no polynomial.  A sub-interval ends at its kinks, and is shortened until the normals at its ends and its
 * middle show that it varies gently: rms error of a shaded noise-like field 4e-5 without, 2e-8 with. */
static reals turn_limit(const Exact *k, reals sa, reals sb, ints mask)
{
    const TfTables *o = k->packet.tables;
    const bool by_length = o->classic && o->gradient_surfaceness;
    reals first[3], middle[3], last[3];
    if (by_length) {
        sb = ramp_limit(k, o->g0, sa, sb, mask);
        sb = ramp_limit(k, o->g1, sa, sb, mask);
    }
    mask &= ~k->steady;
    if (!any(mask))
        return sb;
    sb = kink_limit(k, sa, sb, mask);
    gradients_at(k, sa, first);
    gradients_at(k, sb, last);
    for (int halvings = 0; halvings < 16; halvings++) {
        reals half = (real)0.5 * (sa + sb);
        mask &= (ints)(half > sa) & (ints)(half < sb);
        gradients_at(k, half, middle);
        ints rough = turns(first, middle) | turns(middle, last) | bends(first, middle, last) | turns_at_an_end(first, last);
        if (by_length)
            rough |= is_uneven(first, middle, last);
        mask &= rough;
        if (!any(mask))
            break;
        sb = reals_select(mask, half, sb);
        for (int a = 0; a < 3; a++)
            last[a] = reals_select(mask, middle[a], last[a]);
    }
    return sb;
}

/* The same in u of the segment: exactly 1 where it is the segment's end. */
static reals end_of_gentle_turn(const Exact *k, ints mask)
{
    reals whole = k->stop - k->s, from = reals_fma(whole, k->done, k->s), to = turn_limit(k, from, k->stop, mask);
    reals u = reals_min((to - k->s) / whole, reals_all(1));
    return reals_select((ints)(to < k->stop) & (ints)(u > k->done), u, reals_all(1));
}

/* In a uniform stretch, which may be of any length: how far lights that stand somewhere change smoothly.  In u of the
 * segment, exactly 1 where it is the segment's end. */
MAYBE_UNUSED static reals end_of_even_light(const Exact *k, ints mask)
{
    const RayPacket *l = &k->packet;
    reals end = reals_all(1);
    FOR_LANES(i, mask_bits(mask)) {
        double first = cell_time(k, i, k->s[i]), last = cell_time(k, i, k->stop[i]), length = last - first;
        double t = fma(length, (double)k->done[i], first), blur = 4 * (double)REAL_EPSILON * length;
        double until = vol_lights_even_until(l->scene, &l->rays[i], l->prepared->nearest_light, t, last, blur);
        real u = until < last ? (real)((until - first) / length) : 1;
        end[i] = u > k->done[i] && u < 1 ? u : 1;
    }
    return end;
}

/* ---- Sub-intervals ---- */

/* A part of a segment, u in [0, 1]: x(u) = v - ref = x0 + X(u), X = u (x1 + u (x2 + u x3)).  The
 * particles' optical depth up to u is u (g1 + u (g2 + u (g3 + u g4))), the surfaces'
 * |X| max(surface0 + surface1 X / 2, 0). */
typedef struct SubInterval {
    reals x0, x1, x2, x3;
    reals length, sa, ds; /* world units; s = sa + ds u */
    reals g1[3], g2[3], g3[3], g4[3];
    reals surface0, surface1;
    reals scatter0, emit0[3]; /* at u = 0 */
    reals shortest; /* of the shaded nodes' gradients that are not 0, times gradient_scale; where a cell is not steady */
} SubInterval;

/* From u to `end` of the segment. */
ALWAYS_INLINE void cut_sub_interval(const Exact *k, const Properties *in, unsigned features, reals end, SubInterval *p)
{
    const Cubic *run = &k->run;
    reals u = k->done, du = end - u, whole = k->stop - k->s;
    p->sa = reals_fma(whole, u, k->s);
    p->ds = whole * du;
    p->length = k->length * p->ds;
    p->x0 = reals_fma(reals_fma(reals_fma(run->a3, u, run->a2), u, run->a1), u, k->va - in->ref);
    p->x1 = du * cubic_slope(run, u);
    p->x2 = du * du * reals_fma(3 * run->a3, u, run->a2);
    p->x3 = du * du * du * run->a3;
    for (int c = 0; c < channels_of(features); c++) {
        reals slope = p->length * in->extinction[c][1];
        p->g1[c] = p->length * reals_max(reals_line(in->extinction[c][0], in->extinction[c][1], p->x0), reals_all(0));
        p->g2[c] = slope * ((real)0.5 * p->x1);
        p->g3[c] = slope * ((real)(1.0 / 3.0) * p->x2);
        p->g4[c] = slope * ((real)0.25 * p->x3);
    }
    /* Clamped at 0: extinction that rounding made negative would change the ray's optical depth but send no light. */
    p->scatter0 = reals_max(reals_line(in->scatter[0], in->scatter[1], p->x0), reals_all(0));
    for (int c = 0; c < 3 && features & FEATURE_EMIT; c++)
        p->emit0[c] = reals_max(reals_line(in->emit[c][0], in->emit[c][1], p->x0), reals_all(0));
    if (features & FEATURE_SURFACE) {
        p->surface0 = reals_line(in->surface[0], in->surface[1], p->x0);
        p->surface1 = (real)0.5 * in->surface[1];
    }
}

ALWAYS_INLINE reals run_of(const SubInterval *p, reals u)
{
    return u * reals_fma(reals_fma(p->x3, u, p->x2), u, p->x1);
}

ALWAYS_INLINE reals optical_depth_of_particles(const SubInterval *p, int c, reals u)
{
    return u * reals_fma(reals_fma(reals_fma(p->g4[c], u, p->g3[c]), u, p->g2[c]), u, p->g1[c]);
}

ALWAYS_INLINE reals optical_depth_of_surface(const SubInterval *p, reals X)
{
    return reals_abs(X) * reals_max(reals_fma(p->surface1, X, p->surface0), reals_all(0));
}

/* Optical depth from the sub-interval's start to u. */
ALWAYS_INLINE reals optical_depth_to(const SubInterval *p, unsigned features, int c, reals u)
{
    reals optical_depth = optical_depth_of_particles(p, c, u);
    if (features & FEATURE_SURFACE)
        optical_depth += optical_depth_of_surface(p, run_of(p, u));
    return reals_max(optical_depth, reals_all(0));
}

/* Whether channel c still lets anything through.  What lies behind is left out by the same bound that ends whole rays. */
ALWAYS_INLINE ints channel_is_lit(const Exact *k, int c)
{
    return (ints)(k->sum.reached[c] <= reals_min(k->packet.termination_depth, reals_all(700)));
}

/* Of the densest channel that is not dark yet.  Were dark ones to count, a channel far denser than the others would cut the
 * rest of the way into sub-intervals of its own optical depth 1, a thousand or any number of them, for nothing. */
ALWAYS_INLINE reals largest_optical_depth(const Exact *k, const SubInterval *p, unsigned features)
{
    reals largest = optical_depth_to(p, features, 0, reals_all(1));
    if (features & FEATURE_COLOURED)
        largest = reals_where(channel_is_lit(k, 0), largest);
    for (int c = 1; c < channels_of(features); c++)
        largest = reals_max(largest, reals_where(channel_is_lit(k, c), optical_depth_to(p, features, c, reals_all(1))));
    return largest;
}

/* Adds one node; `weight` is its quadrature weight times transmittance, per channel.  Extinction is taken at the offset X
 * from the sub-interval's start, exactly as optical depth takes it: in a sub-interval so short that x0 + X rounds to x0,
 * light sent and light lost still belong to the same particles. */
ALWAYS_INLINE void add_node(const Exact *k, const Properties *in, const SubInterval *p, unsigned features,
                            const Shading *sh, real u, reals X, const reals weight[3], Light *sum)
{
    reals zero = reals_all(0), amount = reals_max(reals_line(p->scatter0, in->scatter[1], X), zero);
    Source source;
    source_at(k->packet.tables, in, p->x0 + X, sh, features, &source);
    for (int c = 0; c < 3; c++)
        sum->scatter[c] = reals_fma(weight[features & FEATURE_COLOURED ? c : 0] * amount, source.scatter[c],
                                    sum->scatter[c]);
    for (int a = 0; a < 3 && features & FEATURE_CLASSIC && features & FEATURE_EXTRA; a++)
        sum->normal[a] = reals_fma(weight[0] * (amount * p->length), sh->normal[a], sum->normal[a]);
    for (int c = 0; c < 3 && features & FEATURE_EMIT; c++)
        sum->emit[c] = reals_fma(weight[features & FEATURE_COLOURED ? c : 0],
                                 reals_line(p->emit0[c], in->emit[c][1], X), sum->emit[c]);
    if (features & FEATURE_SURFACE) {
        reals dX = reals_fma(reals_fma(3 * p->x3, reals_all(u), 2 * p->x2), reals_all(u), p->x1);
        reals dense = reals_abs(dX) * reals_max(reals_line(p->surface0, in->surface[1], X), zero);
        for (int c = 0; c < 3; c++)
            sum->surface[c] = reals_fma(weight[features & FEATURE_COLOURED ? c : 0], dense * source.surface[c],
                                        sum->surface[c]);
        for (int a = 0; a < 3 && features & FEATURE_SHADED && features & FEATURE_EXTRA; a++)
            sum->normal[a] = reals_fma(weight[0] * dense, sh->normal[a], sum->normal[a]);
    }
}

ALWAYS_INLINE void note_shortest(const Exact *k, const Shading *sh, SubInterval *p)
{
    reals shortest = reals_all(INFINITY);
    for (int n = 0; n < GAUSS; n++)
        shortest = reals_min(shortest, reals_select((ints)(sh[n].gradient > 0), sh[n].gradient, shortest));
    p->shortest = shortest * k->gradient_scale;
}

/* The light that sub-intervals send.  `dense` ones are too short to be cut further, and may be so opaque that no quadrature
 * node would be seen; all of such a one is weighted with its mean transmittance instead. */
ALWAYS_INLINE void sub_interval_light(const Exact *k, const Properties *in, SubInterval *p, ints dense,
                                      unsigned features, Light *sum)
{
    *sum = (Light){0};
    bool any_dense = any(dense);
    reals alike[3] = {0}, passed;
    for (int c = 0; c < channels_of(features) && any_dense; c++)
        alike[c] = reals_phi(optical_depth_to(p, features, c, reals_all(1)), &passed);
    Shading sh[GAUSS];
    reals s[GAUSS];
    for (int n = 0; n < GAUSS; n++)
        s[n] = reals_fma(reals_all(gauss_x[n]), p->ds, p->sa);
    if (features & FEATURE_SHADED) {
        shade_at(k, GAUSS, s, sh);
        if (any(k->gradients_known & ~k->steady))
            note_shortest(k, sh, p);
    }
    for (int n = 0; n < GAUSS; n++) {
        reals u = reals_all(gauss_x[n]), X = run_of(p, u), weight[3], surface = {0};
        if (features & FEATURE_SURFACE)
            surface = optical_depth_of_surface(p, X);
        for (int c = 0; c < channels_of(features); c++) {
            reals optical_depth = optical_depth_of_particles(p, c, u);
            if (features & FEATURE_SURFACE)
                optical_depth += surface;
            weight[c] = reals_exp_short(optical_depth);
            if (any_dense)
                weight[c] = reals_select(dense, alike[c], weight[c]);
            weight[c] *= gauss_w[n];
        }
        add_node(k, in, p, features, &sh[n], gauss_x[n], X, weight, sum);
    }
}

#endif
