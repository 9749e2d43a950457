/* What float cannot tell, for the exact estimator: rays that depend on it are traced in double.
 *
 * Float knows the field to about grain = u |v|, u = 2^-24, |v| the largest of the cell's corners.  A crossing of a knot or
 * an isosurface is known to grain / |v'| along the ray, and next to where v turns to sqrt(grain / |v'' / 2|).  If what
 * particles do jumps there, or an isosurface stands among them, the pixel is off by that length times the jump, seen
 * through what is in front; an isosurface's normal by that length times its own turning.  Where v turns, or passes from
 * cell to cell, within a few grains of an isosurface, float cannot tell on which side: there are two crossings more or less,
 * or one at an end of the ray.  It can where v never leaves one side anyway: that of all corners of the cell, or of the face
 * that it is surely in, is that of v.
 *
 * Where extinction or emission grows by b per unit of v, a stretch of length l is off by b l grain.
 *
 * Gradients are known to about u G, G the largest in the cell: the direction of one of length g to u G / g.
 *
 * Hardly one cell in a hundred thousand is such a case, but a ray meets a hundred cells, and a picture has a million rays.
 * What does not depend on how a ray runs, conditioning.c judges by parts of the volume.
 *
 * PARAMETERS  VOL_DOUBLE; VOL_TRAVERSAL
 * PROVIDES    blur_on_way(), give_up_blurred(), give_up_unsure_entries(), give_up_unsure_normals(), give_up_steep(),
 *             give_up_faint() */
#ifndef VOL_TRACE_BLUR_TMPL_H
#define VOL_TRACE_BLUR_TMPL_H

#include "trace/gentle_tmpl.h"

#ifdef VOL_DOUBLE

static inline reals blur_on_way(reals lo, reals hi) { return (void)lo, (void)hi, reals_all(0); }
static inline void give_up_blurred(Exact *k, ints mask, unsigned features) { (void)k, (void)mask, (void)features; }
MAYBE_UNUSED static inline void give_up_unsure_entries(Exact *k, ints mask, unsigned features)
{
    (void)k, (void)mask, (void)features;
}
static inline void give_up_steep(Exact *k, ints mask, const SubInterval *p, const Properties *in, reals optical_depth,
                                 unsigned features)
{
    (void)k, (void)mask, (void)p, (void)in, (void)optical_depth, (void)features;
}
MAYBE_UNUSED static inline ints give_up_unsure_normals(Exact *k, ints mask, unsigned features)
{
    (void)k, (void)features;
    return mask;
}
MAYBE_UNUSED static inline void give_up_faint(Exact *k, ints mask, const SubInterval *p, reals optical_depth,
                                              unsigned features)
{
    (void)k, (void)mask, (void)p, (void)optical_depth, (void)features;
}

#else

/* How near values must be to be mistaken for each other. */
ALWAYS_INLINE reals blur_of(reals lo, reals hi) { return reals_max(reals_abs(lo), reals_abs(hi)) * (8 * UNIT_ROUNDOFF); }

/* The same where rays' places count, too: known to 32 u of a cell (grid_cells_tmpl.h), mostly to much less. */
ALWAYS_INLINE reals blur_on_way(reals lo, reals hi)
{
    return reals_fma(hi - lo, reals_all(16 * UNIT_ROUNDOFF), blur_of(lo, hi));
}

/* Gives up the rays of `mask` whose pixels are off by `effect`, seen through what is in front; returns those that go on. */
ALWAYS_INLINE ints give_up_beyond(Exact *k, ints mask, reals effect, unsigned features)
{
    reals reached = k->sum.reached[0];
    ints lost = mask & (ints)(effect > (real)BLUR_LIMIT);
    if (!any(lost))
        return mask;
    for (int c = 1; c < channels_of(features); c++)
        reached = reals_min(reached, k->sum.reached[c]);
    lost &= (ints)(effect * reals_exp(-reached) > (real)BLUR_LIMIT);
    k->in_cell &= ~lost;
    give_up(&k->packet, lost);
    return mask & ~lost;
}

/* How far a crossing at the segment's end may be off, in parts of the cell. */
ALWAYS_INLINE reals shift_of(const Exact *k, reals grain)
{
    reals slope = reals_abs(cubic_slope(&k->v, k->stop)), bend = reals_abs(reals_fma(3 * k->v.a3, k->stop, k->v.a2));
    reals steepest = reals_max(slope, reals_sqrt(grain * bend)), one = reals_all(1);
    return reals_select((ints)(grain < steepest), grain / steepest, one);
}

/* The jump, per unit of length, at the knots that a segment comes near to at its end. */
ALWAYS_INLINE reals jump_near(const Exact *k, reals near)
{
    const TfTables *o = k->packet.tables;
    reals below = gather_reals(o->edges, k->interval), above = gather_reals(o->edges + 1, k->interval);
    ints near_below = (ints)(reals_abs(k->stop_v - below) <= near);
    ints near_above = (ints)(reals_abs(above - k->stop_v) <= near);
    return reals_max(reals_where(near_below, gather_reals(o->jump, k->interval)),
                     reals_where(near_above, gather_reals(o->jump + 1, k->interval)));
}

/* Those of `mask` whose v at s is so near an isosurface that float cannot tell on which side.  Where the field turns at the
 * isosurface's value in voxels, it comes near it far more often than chance has it: rare errors count, too. */
ALWAYS_INLINE ints undecided(const Exact *k, ints mask, reals s, reals v, real value)
{
    reals lo = k->least, hi = k->most;
    ints extreme = (ints)(lo == value) | (ints)(hi == value);
    mask &= (ints)(reals_abs(v - value) <= reals_select(extreme, blur_on_way(lo, hi), blur_of(lo, hi)));
    if (any(mask))
        traversal_sure_range(&k->way, &k->packet, &k->place, s, mask, &lo, &hi);
    return mask & (ints)(lo < value) & (ints)(hi >= value);
}

/* Gives up those of `mask` that begin in this cell so near an isosurface. */
MAYBE_UNUSED static void give_up_unsure_entries(Exact *k, ints mask, unsigned features)
{
    const TfTables *o = k->packet.tables;
    reals effect = reals_all(0);
    for (size_t n = 0; n < o->isosurface_count; n++) {
        const Isosurface *iso = &o->isosurfaces[n];
        ints unsure = undecided(k, mask, reals_all(0), k->va, iso->value);
        effect = reals_max(effect, reals_where(unsure, reals_all((real)iso->opacity)));
    }
    give_up_beyond(k, mask, effect, features);
}

/* Gives up rays of `mask` whose next segment ends in such a crossing, or whose leg ends next to one. */
static inline void give_up_blurred(Exact *k, ints mask, unsigned features)
{
    const TfTables *o = k->packet.tables;
    reals largest = reals_max(reals_abs(k->least), reals_abs(k->most)), near = blur_of(k->least, k->most);
    reals length = k->length * shift_of(k, largest * UNIT_ROUNDOFF);
    reals effect = length * jump_near(k, near);
    for (size_t n = 0; n < o->isosurface_count && features & FEATURE_ISO; n++) {
        const Isosurface *iso = &o->isosurfaces[n];
        ints met = mask & k->meets_iso, crossed = met & (ints)(reals_abs(k->stop_v - iso->value) <= near);
        ints unsure = undecided(k, met & k->leg_begun, k->leg_s, k->leg_v, iso->value);
        effect = reals_max(effect, reals_where(crossed, length * iso->around));
        effect = reals_max(effect, reals_where(unsure, reals_all((real)iso->opacity)));
    }
    ints tiny = (ints)(largest > 0) & (ints)(largest < LEAST_SAFE);
    give_up_beyond(k, mask, reals_select(tiny, reals_all(1), effect), features);
}

/* Where the cell's corners are not at hand: what the cubic's terms come to, and what the ray's place in the brick, known to
 * 4 u of a cell, changes.  A single value is known exactly. */
ALWAYS_INLINE reals grain_of(const Cubic *v)
{
    reals change = (reals_abs(v->a1) + reals_abs(v->a2)) + reals_abs(v->a3);
    return reals_where((ints)(change > 0), reals_fma(reals_all(5), change, reals_abs(v->a0)) * UNIT_ROUNDOFF);
}

/* Gives up rays of `mask` on which rounding of v shows in what a sub-interval does. */
ALWAYS_INLINE void give_up_steep(Exact *k, ints mask, const SubInterval *p, const Properties *in, reals optical_depth,
                                 unsigned features)
{
    const reals zero = reals_all(0), one = reals_all(1);
    if (!k->packet.tables->steep)
        return;
    reals steepest = reals_abs(in->extinction[0][1]), color = reals_abs(in->scatter_color[0][1]);
    for (int c = 1; c < channels_of(features); c++)
        steepest = reals_max(steepest, reals_abs(in->extinction[c][1]));
    for (int c = 0; c < 3 && features & FEATURE_EMIT; c++)
        steepest = reals_max(steepest, reals_abs(in->emit[c][1]));
    for (int c = 1; c < 3; c++)
        color = reals_max(color, reals_abs(in->scatter_color[c][1]));
    reals per_v = reals_fma(steepest, p->length, color * reals_min(optical_depth, one));
    if (features & FEATURE_SURFACE) { /* where v turns, rounding of it on one side is not made up for on the other */
        ints rises = (ints)(k->stop_v > k->va), first = (ints)(k->s == 0) & (ints)(k->done == 0);
        reals after = reals_max(reals_line(in->surface[0], in->surface[1], p->x0 + run_of(p, one)), zero);
        per_v += reals_where(k->ends_leg & (ints)(k->stop < one), after);
        per_v += reals_where(first & (rises ^ k->rises), reals_max(p->surface0, zero));
        k->rises = ints_select(mask, rises, k->rises);
    }
    give_up_beyond(k, mask, 2 * per_v * grain_of(&k->v), features); /* such errors add up along a ray */
}

/* Whether normals of the cell's gradients g at the segment's end, known to an angle of `turn`, have no side.  Highlights
 * that are roots of N.h grow so fast from 0 that rounding shows up to 10,000 times as far. */
static ints normal_has_no_side(const Exact *k, const reals g[3], reals turn)
{
    reals n[3];
    Times begin = cell_times(k), now = time_in_cell(k, &begin, k->stop);
    unit_normal(&k->packet, g, n);
    turn += 8 * UNIT_ROUNDOFF;
    ints unsure = has_no_side(&k->packet, n, turn, &now);
    if (is_rooted(k->packet.tables))
        unsure |= (ints)(reals_abs(dot3(n, k->packet.view)) <= 10000 * turn);
    return unsure;
}

/* Gives up rays of `mask` that have come to an isosurface with such a normal; returns those that go on. */
MAYBE_UNUSED static ints give_up_unsure_normals(Exact *k, ints mask, unsigned features)
{
    reals g[3], change[3], grain = reals_max(reals_abs(k->least), reals_abs(k->most)) * UNIT_ROUNDOFF;
    ints varies = {0};
    gradients_at(k, k->stop, g);
    for (int a = 0; a < 3; a++)
        change[a] = cubic_slope(&k->gradient[a], k->stop);
    reals square = dot3(g, g), along = dot3(g, change), zero = reals_all(0);
    reals across = reals_sqrt(reals_max(square * dot3(change, change) - along * along, zero)); /* |g| times what turns it */
    reals turn = (shift_of(k, grain) * across + reals_sqrt(square) * UNIT_ROUNDOFF) / square;
    turn = reals_select(normal_has_no_side(k, g, turn), reals_all(1), turn);
    /* What is 0 in float, where the gradient is not 0 all over the cell, may be a normal in double. */
    turn = reals_select((ints)(square > zero), turn, reals_all(1));
    for (int a = 0; a < 3; a++)
        varies |= (ints)(largest_term(&k->gradient[a]) > zero);
    return give_up_beyond(k, mask, reals_where(varies, turn), features);
}

/* How far a root of the gradient's product with `to`, which changes by `per_s`, may be off in parts of the cell, where s is
 * one; else 0.  Gradients are scaled to about 1. */
static reals root_shift(const Exact *k, reals s, const reals to[3], const reals per_s[3])
{
    reals g[3], change[3], bend[3], size = reals_sqrt(dot3(to, to)), grain = 4 * UNIT_ROUNDOFF * size;
    gradients_at(k, s, g);
    for (int a = 0; a < 3; a++) {
        change[a] = cubic_slope(&k->gradient[a], s);
        bend[a] = reals_fma(3 * k->gradient[a].a3, s, k->gradient[a].a2);
    }
    reals slope = reals_abs(dot3(change, to) + dot3(g, per_s)), curve = reals_abs(dot3(bend, to) + dot3(change, per_s));
    reals shift = grain / reals_max(slope, reals_sqrt(grain * curve));
    ints root = (ints)(reals_abs(dot3(g, to)) <= 8 * grain) & ((ints)(slope > 0) | (ints)(curve > 0));
    return reals_where(root, reals_min(shift, reals_all(1)));
}

/* The same of the kinks of shading at s. */
static reals kink_shift(const Exact *k, reals s)
{
    const VolScene *scene = k->packet.scene;
    const reals still[3] = {{0}};
    reals shift = root_shift(k, s, k->packet.view, still);
    for (size_t n = 0; n < scene->light_count; n++) {
        reals a[3], b[3];
        if (scene->lights[n].kind == VOL_LIGHT_HEAD)
            continue;
        direction_in_cell(k, &scene->lights[n], a, b);
        for (int c = 0; c < 3; c++)
            a[c] = reals_fma(b[c], s, a[c]);
        shift = reals_max(shift, root_shift(k, s, a, b));
    }
    return shift;
}

/* Gives up rays of `mask` whose sub-interval ends in a kink that float cannot place, and at which shading jumps: where only
 * the viewer's own light shines it does not. */
static void give_up_jumps(Exact *k, ints mask, const SubInterval *p, reals shown, unsigned features)
{
    reals end = p->sa + p->ds, shift = kink_shift(k, end), share = shown * reals_min(shift / p->ds, reals_all(1));
    const reals around[2] = {end - 2 * shift, end + 2 * shift};
    mask &= (ints)(share > (real)(BLUR_LIMIT / 16));
    if (!any(mask))
        return;
    Shading sides[2];
    reals jump = reals_all(0);
    shade_at(k, 2, around, NULL, sides);
    for (int c = 0; c < 3; c++)
        jump = reals_max(jump, reals_abs(sides[1].k[c] - sides[0].k[c]) + reals_abs(sides[1].b[c] - sides[0].b[c]));
    give_up_beyond(k, mask, share * jump, features);
}

/* The same for what rounding does to the shading of a sub-interval of rays of `mask`: to short gradients and where it jumps.
 * Steady cells have neither. */
MAYBE_UNUSED static void give_up_faint(Exact *k, ints mask, const SubInterval *p, reals optical_depth, unsigned features)
{
    reals shown = reals_min(optical_depth, reals_all(1));
    mask &= ~k->steady;
    if (!any(mask))
        return;
    mask = give_up_beyond(k, mask, shown * UNIT_ROUNDOFF / p->shortest, features);
    if (k->packet.prepared->lit_aside)
        give_up_jumps(k, mask, p, shown, features);
}

#endif

#endif
