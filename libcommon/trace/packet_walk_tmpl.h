/* The bricks along the rays of a packet that are near one another: what walk.h does for one ray, with the same results.
 *
 * Rays visit bricks together.  Each has come to some brick, and every step takes it on along at least one axis: what it has
 * behind it is its `order`, the sum over the axes.  Of all bricks that lanes have come to, the one with the least order is
 * visited, by all lanes that have come to it.  Where all run in one direction, any other ray that will ever pass through
 * that brick has less behind it now, and there is none: no brick is visited twice.
 *
 * PARAMETERS  VOL_DOUBLE
 * PROVIDES    PacketWalk, Visit, Stretches, packet_walk_begin(), rays_are_close(), packet_walk_next() */
#ifndef VOL_TRACE_PACKET_WALK_TMPL_H
#define VOL_TRACE_PACKET_WALK_TMPL_H

#include <string.h>

#include "simd/wide.h"
#include "trace/brick_finder.h"
#include "trace/index_ray.h"
#include "trace/walk.h"

/* The stretches that lanes are in. */
typedef struct Stretches {
    double begin[LANES], past[LANES];
    double origin[3][LANES];     /* the brick's first cell; of many the first that is entered */
} Stretches;

typedef struct PacketWalk {
    BrickFinder finder;
    double o[3][LANES], d[3][LANES], inv[3][LANES]; /* each lane's IndexRay */
    double step[3][LANES];       /* 1, -1, or 0 where the ray runs along the planes */
    double leave[3][LANES];      /* the side of a brick that it leaves by: 8 or 0 */
    double t[LANES], end[LANES]; /* it has come to t */
    double at[3][LANES];         /* brick coordinates, whole numbers */
    double ahead[3][LANES];      /* t of the plane where it leaves that brick across each axis; INFINITY: never */
    double order[LANES];
    uint64_t blocks;             /* passed over, invisible, lane by lane, and not yet counted */
} PacketWalk;

/* A brick, and the lanes that have entered it. */
typedef struct Visit {
    ints lanes;
    uint32_t brick;
    int32_t at[3]; /* brick coordinates */
    bool wide;     /* many bricks of one value, `at` the one that the ray enters; no gradient differs from 0 */
} Visit;

static inline IndexRay lane_ray(const PacketWalk *w, unsigned i)
{
    IndexRay ray;
    for (int a = 0; a < 3; a++) {
        ray.o[a] = w->o[a][i];
        ray.d[a] = w->d[a][i];
        ray.inv[a] = w->inv[a][i];
    }
    return ray;
}

/* ---- Beginnings ---- */

/* Lane i comes to the brick that holds its ray from t on. */
static inline void come_to_time(PacketWalk *w, unsigned i)
{
    IndexRay ray = lane_ray(w, i);
    double t = w->t[i];
    w->order[i] = 0;
    for (int a = 0; a < 3; a++) {
        double at = brick_at_time(&ray, a, t, w->finder.space->visible_min[a], w->finder.space->visible_max[a]);
        w->at[a][i] = at;
        w->ahead[a][i] = ray.d[a] == 0 ? INFINITY : plane_time(&ray, a, at * VOL_BRICK_CELLS + w->leave[a][i]);
        w->order[i] += w->step[a][i] * at;
    }
}

/* The rays begin as each does on its own way.  Lanes beyond `count` have ended. */
static inline void packet_walk_begin(PacketWalk *w, const Walk walk[LANES], size_t count)
{
    finder_begin(&w->finder, walk[0].finder.grid, walk[0].finder.space);
    w->blocks = 0;
    for (unsigned i = 0; i < LANES; i++) {
        const Walk *from = &walk[i];
        w->t[i] = from->t;
        w->end[i] = i < count ? from->end : -INFINITY;
        bool goes = w->t[i] < w->end[i];
        w->order[i] = 0;
        for (int a = 0; a < 3; a++) {
            w->o[a][i] = from->o[a];
            w->d[a][i] = from->d[a];
            w->inv[a][i] = from->inv[a];
            w->step[a][i] = from->step[a];
            w->leave[a][i] = from->leave[a];
            w->at[a][i] = goes ? from->at[a] : 0;
            w->ahead[a][i] = goes ? from->ahead[a] : INFINITY;
            w->order[i] += w->step[a][i] * w->at[a][i];
        }
    }
}

/* Whether no ray ever is farther from the first than about the side of a brick.  Most bricks are then visited by all. */
static inline bool rays_are_close(const PacketWalk *w)
{
    const double most = VOL_BRICK_CELLS;
    bool close = true;
    double length = 0;
    for (int a = 0; a < 3; a++)
        length += w->d[a][0] * w->d[a][0];
    for (int i = 1; i < LANES; i++) {
        if (!(w->t[i] < w->end[i]))
            continue;
        for (int n = 0; n < 2; n++) {
            double t = n ? w->end[i] : w->t[i], along = 0, square = 0;
            for (int a = 0; a < 3; a++) {
                double from = w->o[a][i] + t * w->d[a][i] - w->o[a][0];
                along += from * w->d[a][0];
                square += from * from;
            }
            close = close && square - along * along / length <= most * most;
        }
    }
    return close;
}

/* ---- On the way ---- */

/* The brick to be visited next of those that the lanes of `mask` have come to, and who has come to it; false: all have
 * ended. */
ALWAYS_INLINE bool join(const PacketWalk *w, ints mask, Visit *v)
{
    wide_mask going[PARTS];
    wide least = wide_all(INFINITY);
    for (int n = 0; n < PARTS; n++) {
        going[n] = mask_part(mask, n) & (wide_mask)(get_part(w->t, n) < get_part(w->end, n));
        least = wide_min(least, wide_select(going[n], get_part(w->order, n), wide_all(INFINITY)));
    }
    double least_order = wide_least(least);
    if (least_order == INFINITY)
        return false;
    wide_mask leads[PARTS];
    for (int n = 0; n < PARTS; n++)
        leads[n] = going[n] & (wide_mask)(get_part(w->order, n) == least_order);
    unsigned first = (unsigned)__builtin_ctz(mask_bits(masks_joined(leads)));
    double at[3];
    for (int a = 0; a < 3; a++) {
        at[a] = w->at[a][first];
        v->at[a] = (int32_t)at[a];
    }
    for (int n = 0; n < PARTS; n++)
        for (int a = 0; a < 3; a++)
            going[n] &= (wide_mask)(get_part(w->at[a], n) == at[a]);
    v->lanes = masks_joined(going);
    return true;
}

/* Steps to the neighbour through the plane(s) at t. */
ALWAYS_INLINE void step_part(PacketWalk *w, int n, wide_mask mask, wide t)
{
    wide order = get_part(w->order, n);
    for (int a = 0; a < 3; a++) {
        wide ahead = get_part(w->ahead[a], n);
        wide_mask crossed = mask & (wide_mask)(ahead <= t);
        wide at = get_part(w->at[a], n) + (wide)((wide_mask)get_part(w->step[a], n) & crossed);
        wide next = (at * VOL_BRICK_CELLS + get_part(w->leave[a], n) - get_part(w->o[a], n)) * get_part(w->inv[a], n);
        order += (wide)((wide_mask)wide_all(1) & crossed);
        put_part(w->at[a], n, crossed, at);
        put_part(w->ahead[a], n, crossed, next);
    }
    put_part(w->order, n, mask, order);
    put_part(w->t, n, mask, t);
}

/* Where lanes leave a box of bricks. */
ALWAYS_INLINE wide box_plane(const PacketWalk *w, int a, int n, const BrickBox *box)
{
    wide d = get_part(w->d[a], n), low = wide_all((double)box->lo[a] * VOL_BRICK_CELLS);
    wide high = wide_all(((double)box->hi[a] + 1) * VOL_BRICK_CELLS);
    wide t = (wide_select((wide_mask)(d > 0), high, low) - get_part(w->o[a], n)) * get_part(w->inv[a], n);
    return wide_select((wide_mask)(d == 0), wide_all(INFINITY), t);
}

/* The lanes that have come to `v` pass it; those left in it, where it is visible, have a stretch of positive length. */
ALWAYS_INLINE void pass(PacketWalk *w, Visit *v, const BrickFound *at, Stretches *out)
{
    wide_mask all_found[PARTS] = {{0}};
    for (int n = 0; n < PARTS; n++) {
        wide_mask mask = mask_part(v->lanes, n);
        if (PARTS > 1 && !wide_bits(mask))
            continue;
        wide t = get_part(w->t, n), exit = get_part(w->end, n);
        for (int a = 0; a < 3; a++)
            exit = wide_min(at->single ? get_part(w->ahead[a], n) : box_plane(w, a, n, &at->box), exit);
        wide_mask found = all_found[n] = at->visible ? mask & (wide_mask)(exit > t) : (wide_mask){0};
        if (at->visible) {
            put_part(out->begin, n, found, t);
            put_part(out->past, n, found, exit);
            for (int a = 0; a < 3; a++)
                put_part(out->origin[a], n, found, wide_all((double)v->at[a] * VOL_BRICK_CELLS));
        }
        if (at->single) {
            step_part(w, n, mask, wide_max(exit, t));
            continue;
        }
        put_part(w->t, n, mask, exit);
        FOR_LANES(i, wide_bits(mask & (wide_mask)(exit < get_part(w->end, n))))
            come_to_time(w, PART * (unsigned)n + i);
    }
    v->lanes = masks_joined(all_found);
}

/* The next visible brick, and those of `mask` that have a stretch in it, of positive length; others have not come to it yet.
 * false: all of `mask` have come to their ends. */
ALWAYS_INLINE bool packet_walk_next(PacketWalk *w, ints mask, Visit *visit, Stretches *out)
{
    while (join(w, mask, visit)) {
        BrickFound found;
        find_brick(&w->finder, visit->at, &found);
        visit->brick = found.brick;
        visit->wide = found.visible && !found.single;
        if (!found.visible)
            w->blocks += (unsigned)__builtin_popcount(mask_bits(visit->lanes));
        pass(w, visit, &found, out);
        if (any(visit->lanes))
            return true;
    }
    return false;
}

#endif
