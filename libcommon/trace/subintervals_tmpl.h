/* Sub-intervals of rays for the exact estimator (exact_tmpl.h has the derivation): parts of a cell's segments within one
 * interval of the transfer function, their optical depth in closed form, their light by Gauss-Legendre quadrature.
 *
 * PARAMETERS  VOL_DOUBLE; VOL_TRAVERSAL
 * PROVIDES    Exact; cell_time(), cell_times(), time_in_cell(), gradients_at(), shade_at(); SubInterval, cut_sub_interval(),
 *             optical_depth_to(), largest_optical_depth(), sub_interval_light(), channel_is_lit() */
#ifndef VOL_TRACE_SUBINTERVALS_TMPL_H
#define VOL_TRACE_SUBINTERVALS_TMPL_H

#include VOL_TRAVERSAL

#include "trace/accumulate_tmpl.h"
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
    ints in_surface;          /* where there are light grids: it is a surface cell (reach.h) */
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

/* Where the cells begin, as times along the rays, where any light asks for them. */
ALWAYS_INLINE Times cell_times(const Exact *k)
{
    Times times = {{0}};
    if (k->packet.prepared->lit_from_places) {
        times = times_of(stretch_begin(&k->way));
        times.rest += k->begin;
    }
    return times;
}

/* The time s of the way through cells that begin at `begin`. */
ALWAYS_INLINE Times time_in_cell(const Exact *k, const Times *begin, reals s)
{
    return (Times){begin->t, reals_fma(s, k->length, begin->rest)};
}

ALWAYS_INLINE void gradients_at(const Exact *k, reals s, reals out[3])
{
    for (int a = 0; a < 3; a++)
        out[a] = cubic_at(&k->gradient[a], s);
}

/* Places in cells as light grids know them. */
ALWAYS_INLINE reals lit_in_cell(const Exact *k, reals s) { return reals_fma(s, k->length, k->begin); }

/* At `count` places s of each cell; `places` are the same, or NULL. */
ALWAYS_INLINE void shade_at(const Exact *k, int count, const reals *s, const LitPlaces *places, Shading *out)
{
    reals gradient[SHADINGS_MOST][3], after[SHADINGS_MOST];
    Times begin = cell_times(k);
    for (int n = 0; n < count; n++) {
        gradients_at(k, s[n], gradient[n]);
        after[n] = s[n] * k->length;
    }
    shade_scaled(&k->packet, count, (const reals(*)[3])gradient, &begin, after, places, out);
    for (int n = 0; n < count; n++)
        out[n].gradient /= k->gradient_scale;
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
                            const Shading *sh, const reals *lit, real u, reals X, const reals weight[3], Light *sum)
{
    reals zero = reals_all(0), amount = reals_max(reals_line(p->scatter0, in->scatter[1], X), zero);
    Source source;
    source_at(k->packet.tables, in, p->x0 + X, sh, lit, features, &source);
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
ALWAYS_INLINE void sub_interval_light(const Exact *k, const Properties *in, SubInterval *p, ints seen, ints dense,
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
    reals lit[GAUSS][3], at[GAUSS];
    const bool is_lit = features & FEATURE_LIT && k->packet.lit;
    const LitPlaces places = {at, seen, features & FEATURE_CLASSIC ? ints_all(0) : k->in_surface, NULL, {0}};
    if (is_lit) {
        for (int n = 0; n < GAUSS; n++)
            at[n] = lit_in_cell(k, s[n]);
        lit_on_particles(&k->packet, GAUSS, at, seen, lit);
        if (features & FEATURE_SURFACE && !(features & FEATURE_SHADED))
            light_evenly(&k->packet, GAUSS, &places, sh);
    }
    if (features & FEATURE_SHADED) {
        shade_at(k, GAUSS, s, is_lit ? &places : NULL, sh);
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
        add_node(k, in, p, features, &sh[n], is_lit ? lit[n] : NULL, gauss_x[n], X, weight, sum);
    }
}

#endif
