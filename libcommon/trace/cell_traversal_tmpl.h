/* The way of LANES rays through bricks and their cells, for the exact estimator: on to the next cell with something in it.
 * Include subintervals_tmpl.h first. */
#ifndef VOL_TRACE_CELL_TRAVERSAL_TMPL_H
#define VOL_TRACE_CELL_TRAVERSAL_TMPL_H

#include "trace/subintervals_tmpl.h"

static void cells_begin(Cells *k, const VolScene *scene, VolScratch *scratch, const VolRay *rays, size_t count,
                        VolRadiance *out)
{
    memset(k, 0, sizeof *k);
    packet_begin(&k->packet, scene, scratch, rays, count, out);
    for (int i = 0; i < LANES; i++)
        k->carry_t[i] = NAN;
    for (int a = 0; a < 3; a++) {
        ints up = (ints)(k->packet.d[a] > 0);
        k->sign[a] = reals_select(up, reals_all(1), reals_all(-1));
        k->upper[a] = reals_select(up, reals_all(1), reals_all(0));
    }
}

/* The last cell of a brick along axis a that a ray comes to: in the brick and in the domain. */
static inline real last_cell(const VolGrid *grid, int a, int32_t origin, real d)
{
    int32_t low = grid->cell_min[a] - origin, high = grid->cell_max[a] - origin;
    if (d > 0)
        return (real)(high < VOL_BRICK_CELLS - 1 ? high : VOL_BRICK_CELLS - 1);
    return (real)(low > 0 ? low : 0);
}

/* Where a ray reaches the next face across an axis.  The brick's and the domain's own faces are none: where it leaves the
 * brick, `end` says, and a cell beyond is never entered whatever rounding makes of a slanting ray. */
static inline real next_face(real at, real last, real e, real d, real inv)
{
    if (d == 0 || at == last)
        return INFINITY;
    return (at + (d > 0) - e) * inv;
}

/* In double soft surfaces too are judged by ends on which neighbouring cells agree: beside a value of 1e30 what rounding
 * leaves of a face of zeros would hide a layer of surfaces from one and show it to the other. */
static inline bool judges_ends(unsigned features)
{
#ifdef VOL_DOUBLE
    return features & FEATURE_SURFACE;
#else
    (void)features;
    return false;
#endif
}

/* Lane i goes to its next brick, to the cell where its ray enters that. */
static void enter_brick(Cells *k, unsigned i, unsigned features)
{
    RayPacket *l = &k->packet;
    if (!packet_enter_brick(l, i, !(features & FEATURE_CLASSIC), true))
        return;
    const BrickSpan *span = &l->span[i];
    for (int a = 0; a < 3; a++) {
        real d = l->d[a][i], e = real_clamp((real)span->e[a], 0, VOL_BRICK_CELLS);
        real at = d < 0 ? real_ceil(e) - 1 : real_floor(e);
        real last = last_cell(l->scene->grid, a, span->origin[a], d);
        /* A ray that enters where the domain ends but for rounding is in its last cell, not beyond it. */
        at = real_min(real_max(at, d < 0 ? last : 0), d > 0 ? last : VOL_BRICK_CELLS - 1);
        k->e[a][i] = e;
        k->at[a][i] = at;
        k->last[a][i] = last;
        k->next[a][i] = l->single[i] ? INFINITY : next_face(at, k->last[a][i], e, d, l->inv[a][i]);
        k->entered[a][i] = 0;
        k->exit_axes[a][i] = -(lane_int)(span->exit_axes >> a & 1);
    }
    k->visible[i] = l->scene->brick_visible[span->brick] == VOL_BRICK_SEEN ? -1 : 0;
    k->u[i] = 0;
    k->end[i] = (real)(span->t1 - span->t0);
    if (features & FEATURE_ISO || judges_ends(features))
        k->carried[i] = k->carry_t[i] == span->t0 ? -1 : 0;
}

/* On to the neighbouring cell, or out of the brick. */
ALWAYS_INLINE void next_cell(Cells *k, ints mask, reals u1, ints inside)
{
    RayPacket *l = &k->packet;
    ints going = mask & inside;
    for (int a = 0; a < 3; a++) {
        ints through = going & (ints)(k->next[a] <= u1);
        reals at = k->at[a] + reals_where(through, k->sign[a]);
        reals face = (at + k->upper[a] - k->e[a]) * l->inv[a];
        face = reals_select((ints)(at == k->last[a]), reals_all(INFINITY), face);
        k->at[a] = at;
        k->next[a] = reals_select(through, face, k->next[a]);
        k->entered[a] = ints_select(going, through, k->entered[a]);
    }
    k->u = reals_select(going, u1, k->u);
    l->in_brick &= ~(mask & ~inside);
}

/* Whether an isosurface's value lies between lo and hi (closed). */
ALWAYS_INLINE ints meets_isosurface(const TfTables *o, reals lo, reals hi)
{
    ints before = count_up_to(o->isosurface_values, o->isosurface_count, lo, true);
    return (ints)(count_up_to(o->isosurface_values, o->isosurface_count, hi, false) > before);
}

/* The field at a cell's ends, kept within the corners of the faces that the ends lie on. */
static void judge_ends(Cells *k, ints mask, const reals corners[8], const reals p[3], const reals step[3], reals u1,
                       ints inside, reals *entry, reals *exit)
{
    reals there[3];
    for (int a = 0; a < 3; a++) {
        ints at_face = ints_select(inside, (ints)(k->next[a] <= u1), k->exit_axes[a]);
        there[a] = reals_select(at_face, k->upper[a], reals_clamp(p[a] + step[a], 0, 1));
    }
    *exit = judge_at(corners, there);
    *entry = k->carry;
    if (any(mask & ~k->carried))
        *entry = reals_select(k->carried, k->carry, judge_at(corners, p));
    k->carry = reals_select(mask, *exit, k->carry);
    k->carried |= mask;
    FOR_LANES(i, mask_bits(mask & ~inside))
        k->carry_t[i] = k->packet.span[i].t1;
}

/* Whether anything is to be seen in the cells of `mask`, whose bricks were judged to show nothing but are entered all the
 * same: their field lies between the bricks' ends, whatever rounding makes of it. */
static ints shows_all_the_same(const Cells *k, ints mask, reals lo, reals hi, unsigned features)
{
    const RayPacket *l = &k->packet;
    ints low, high;
    FOR_LANES(i, mask_bits(mask)) {
        const VolBrick *brick = &l->scene->grid->bricks[l->span[i].brick];
        lo[i] = real_clamp(lo[i], (real)brick->lo, (real)brick->hi);
        hi[i] = real_clamp(hi[i], (real)brick->lo, (real)brick->hi);
    }
    intervals_around(l->tables, lo, hi, &low, &high);
    ints touching = (ints)(low < high) & (ints)(hi == gather_reals(l->tables->edges, high));
    return range_shows(l->tables, lo, hi, low, high, touching, features);
}

/* Looks at the next cell of each lane of `mask`: those with something in it are in that cell from now on. */
ALWAYS_INLINE void look_at_cell(Cells *k, ints mask, unsigned features)
{
    RayPacket *l = &k->packet;
    const TfTables *o = l->tables;
    const reals one = reals_all(1), zero = reals_all(0);
    reals u1 = reals_min(reals_min(k->next[0], k->next[1]), reals_min(k->next[2], k->end));
    ints inside = (ints)(u1 < k->end), met = mask & (ints)(u1 > k->u);
    reals length = u1 - k->u, p[3], step[3], corners[8], lo, hi;
    for (int a = 0; a < 3; a++) {
        reals x = reals_clamp(reals_fma(k->u, l->d[a], k->e[a] - k->at[a]), 0, 1);
        p[a] = reals_select(k->entered[a], one - k->upper[a], x);
        step[a] = l->d[a] * length;
    }
    reals place = reals_fma(reals_fma(k->at[0], reals_all(9), k->at[1]), reals_all(9), k->at[2]);
    ints offset = __builtin_convertvector(place, ints);
    load_corners_of(l->values, offset, corners);
    Cubic v = expand_cell(corners, p, step);
    if (any(l->invalid))
        met &= ~l->invalid | all_finite(corners);
    cubic_range(&v, &lo, &hi);
    ints meets_iso = {0};
    reals entry = v.a0, exit = cubic_at(&v, one), least, most;
    if (features & FEATURE_ISO || o->jumps) {
        range_of_corners(corners, &least, &most);
        lo = reals_min(reals_max(lo, least), most);
        hi = reals_min(reals_max(hi, least), most);
        entry = reals_min(reals_max(entry, least), most);
        exit = reals_min(reals_max(exit, least), most);
        k->least = reals_select(met, least, k->least);
        k->most = reals_select(met, most, k->most);
    }
    if (features & FEATURE_ISO || judges_ends(features)) {
        judge_ends(k, met, corners, p, step, u1, inside, &entry, &exit);
        lo = reals_min(lo, reals_min(entry, exit));
        hi = reals_max(hi, reals_max(entry, exit));
        k->carried &= met | ~(mask & (ints)(u1 > k->u));
    }
    if (features & FEATURE_ISO) {
        meets_iso = meets_isosurface(o, lo, hi);
        k->meets_iso = ints_select(met, meets_iso, k->meets_iso);
    }
    ints low, high;
    intervals_around(o, lo, hi, &low, &high);
    ints first_visible = gather_ints(o->next_visible, low);
    ints visible = (ints)(first_visible <= high), constant = met & visible & (ints)(lo == hi);
    /* Unshaded, a cell's light costs less than looking at one cell more. */
    if (features & FEATURE_SHADED && any(constant))
        visible &= ~constant | particles_at(o, low, lo, features);
    ints judged = met & visible & ~k->visible;
    if (__builtin_expect(any(judged), 0))
        visible &= ~judged | shows_all_the_same(k, judged, lo, hi, features);
    ints seen = met & (visible | meets_iso);
    l->scratch->skipped.cells_met += (unsigned)__builtin_popcount(mask_bits(met));
    if (any(seen)) {
        ints many = (ints)(low != high) | meets_iso;
        if (features & FEATURE_SURFACE)
            many |= (ints)(gather_reals(&o->intervals[0].has_surface, low * INTERVAL_REALS) > 0);
        reals turn[2];
        if (any(seen & many)) {
            turning_points(&v, &turn[0], &turn[1]);
            k->turn[0] = reals_select(seen, turn[0], k->turn[0]);
            k->turn[1] = reals_select(seen, turn[1], k->turn[1]);
            low = ints_select(many, intervals_of(o, entry), low);
            k->exit = reals_select(seen, exit, k->exit);
            k->leg_begun &= ~seen;
            k->turns_passed &= ~seen;
        }
        cubic_replace(&k->v, seen, &v);
        for (int a = 0; a < 3 && features & FEATURE_SHADED; a++) {
            k->p[a] = reals_select(seen, p[a], k->p[a]);
            k->step[a] = reals_select(seen, step[a], k->step[a]);
        }
        k->offset = ints_select(seen, offset, k->offset);
        k->gradients_known &= ~seen;
        k->u0 = reals_select(seen, k->u, k->u0);
        k->length = reals_select(seen, length, k->length);
        k->many = ints_select(seen, many, k->many);
        k->interval = ints_select(seen, low, k->interval);
        k->va = reals_select(seen, entry, k->va);
        k->s = reals_select(seen, zero, k->s);
        k->done = reals_select(seen, one, k->done); /* the first stretch is to be planned */
        k->in_cell |= seen;
        k->sums.cells -= seen;
    }
    next_cell(k, mask, u1, inside);
}

/* Every lane that is in no cell goes on until it is, or its ray has ended. */
ALWAYS_INLINE void traverse(Cells *k, unsigned features)
{
    for (;;) {
        ints wanted = k->packet.alive & ~k->in_cell;
        if (!any(wanted))
            return;
        FOR_LANES(i, mask_bits(wanted & ~k->packet.in_brick))
            enter_brick(k, i, features);
        wanted &= k->packet.alive;
        if (any(wanted))
            look_at_cell(k, wanted, features);
    }
}

#endif
