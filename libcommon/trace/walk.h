/* The bricks along one ray, those that are invisible left out in blocks as large as can be.
 *
 * A brick's stretch [t0, t1] follows from its own planes alone, t(plane) = (plane - o) / d, never from the way that led
 * there: leaving bricks out changes nothing in those that remain, and packet_walk_tmpl.h finds the same.  An axis that the
 * ray runs along has no planes. */
#ifndef VOL_TRACE_WALK_H
#define VOL_TRACE_WALK_H

#include "simd/axes.h"
#include "trace/brick_finder.h"
#include "trace/index_ray.h"

typedef struct Walk {
    axes o, d, inv, near; /* the ray in index space: see IndexRay */
    axes at;              /* brick coordinates, whole numbers */
    axes ahead;           /* t of the plane where the ray leaves brick `at` across each axis; INFINITY: never */
    axes step;            /* 1, -1, or 0 where the ray runs along the planes */
    axes leave;           /* the side of a brick that it leaves by: 8 or 0 */
    axes last_face;       /* t where it leaves the domain, through a face of cells; else NAN */
    double t, end;
    uint64_t blocks;      /* passed over, invisible, and not yet counted */
    IndexRay ray;
    BrickFinder finder;
} Walk;

typedef struct BrickSpan {
    double t0, t1;
    axes origin;          /* first cell */
    axes e;               /* where asked for: where the ray is at t0, from `origin`, in [0, 8] */
    axes_mask exit_axes;  /* and the axes across whose planes t1 lies */
    uint32_t brick;
    bool wide;            /* through many bricks of one value; `origin` is the first one's, and no gradient differs from 0 */
} BrickSpan;

/* Where the ray meets the planes `at`, one across each axis: as plane_time. */
ALWAYS_INLINE axes plane_times(const Walk *w, axes at) { return (at - w->o) * w->inv; }

/* Where the ray leaves bricks lo to hi across each axis. */
ALWAYS_INLINE axes walk_leaves(const Walk *w, axes lo, axes hi)
{
    axes plane = axes_select((axes_mask)(w->d > 0), hi + 1, lo) * VOL_BRICK_CELLS;
    return axes_select((axes_mask)(w->d == 0), axes_all(INFINITY), plane_times(w, plane));
}

/* Comes to the brick that holds the ray from t on. */
static inline void walk_locate(Walk *w)
{
    const VolEmptySpace *space = w->finder.space;
    for (int a = 0; a < 3; a++)
        w->at[a] = brick_at_time(&w->ray, a, w->t, space->visible_min[a], space->visible_max[a]);
    w->ahead = walk_leaves(w, w->at, w->at);
}

static inline void walk_begin(Walk *w, const VolGrid *grid, const VolEmptySpace *space, const VolRay *world)
{
    IndexRay ray = w->ray = index_ray(&grid->world_to_index, world);
    finder_begin(&w->finder, grid, space);
    w->t = world->t0;
    w->end = world->t1;
    w->blocks = 0;
    w->o = axes_of(ray.o[0], ray.o[1], ray.o[2]);
    w->d = axes_of(ray.d[0], ray.d[1], ray.d[2]);
    w->inv = axes_of(ray.inv[0], ray.inv[1], ray.inv[2]);
    w->near = axes_of(ray.near[0], ray.near[1], ray.near[2]);
    for (int a = 0; a < 3; a++) {
        w->step[a] = (ray.d[a] > 0) - (ray.d[a] < 0);
        w->leave[a] = ray.d[a] > 0 ? VOL_BRICK_CELLS : 0;
        w->last_face[a] = last_face_time(grid, &ray, a);
    }
    cut_to_visible(&ray, space, &w->t, &w->end);
    if (w->t < w->end)
        walk_locate(w);
}

/* Steps to the neighbour through the plane(s) at `t`.  Without branches: which axis comes next nobody can predict. */
ALWAYS_INLINE void walk_step(Walk *w, double t)
{
    axes_mask crossed = (axes_mask)(w->ahead <= t);
    w->at += (axes)((axes_mask)w->step & crossed);
    w->ahead = axes_select(crossed, plane_times(w, w->at * VOL_BRICK_CELLS + w->leave), w->ahead);
    w->t = t;
}

ALWAYS_INLINE axes axes_within_brick(axes e) { return axes_min(axes_max(e, axes_all(0)), axes_all(VOL_BRICK_CELLS)); }

/* Where the ray enters the brick: in a plane of voxels where it may be there but for rounding, as it is in the planes of
 * the brick and the domain that it enters through, and with them in those that it meets in the same edges and corners. */
ALWAYS_INLINE void walk_entry(const Walk *w, BrickSpan *span)
{
    const axes to_whole = axes_all(0x1.8p52);
    axes e = axes_fma(axes_all(w->t), w->d, w->o - span->origin), plane = (e + to_whole) - to_whole, off = e - plane;
    axes blur = w->near + 0x1p-50 * axes_max(plane + span->origin, -(plane + span->origin));
    span->e = axes_within_brick(axes_select((axes_mask)(axes_max(off, -off) <= blur), plane, e));
}

/* `ahead`: where the planes are that the stretch may end at. */
ALWAYS_INLINE void walk_span(const Walk *w, uint32_t brick, double exit, axes ahead, bool ends, BrickSpan *span)
{
    span->t0 = w->t;
    span->t1 = exit;
    span->brick = brick;
    span->wide = false;
    span->origin = w->at * VOL_BRICK_CELLS;
    if (!ends)
        return;
    span->exit_axes = (axes_mask)(ahead == exit) | (axes_mask)(w->last_face == exit);
    walk_entry(w, span);
}

/* Passes a box of bricks; true: it is a stretch to be seen. */
static inline bool walk_pass_box(Walk *w, const BrickFound *found, bool ends, BrickSpan *span)
{
    const int32_t *lo = found->box.lo, *hi = found->box.hi;
    axes ahead = walk_leaves(w, axes_of(lo[0], lo[1], lo[2]), axes_of(hi[0], hi[1], hi[2]));
    double nearest = axes_least(ahead), exit = nearest < w->end ? nearest : w->end;
    bool seen = found->visible && exit > w->t;
    if (seen) {
        walk_span(w, found->brick, exit, ahead, ends, span);
        span->wide = true;
    }
    w->t = exit;
    if (w->t < w->end)
        walk_locate(w);
    return seen;
}

ALWAYS_INLINE bool walk_pass_brick(Walk *w, const BrickFound *found, bool ends, BrickSpan *span)
{
    double nearest = axes_least(w->ahead), exit = nearest < w->end ? nearest : w->end;
    bool seen = found->visible && exit > w->t;
    if (seen)
        walk_span(w, found->brick, exit, w->ahead, ends, span);
    walk_step(w, exit > w->t ? exit : w->t);
    return seen;
}

/* The next visible brick's stretch, of positive length; false at the end of the ray.  `ends`: also where it begins and ends
 * in space. */
ALWAYS_INLINE bool walk_next(Walk *w, bool ends, BrickSpan *span)
{
    while (w->t < w->end) {
        int32_t at[3];
        for (int a = 0; a < 3; a++)
            at[a] = (int32_t)w->at[a];
        BrickFound found;
        find_brick(&w->finder, at, &found);
        w->blocks += !found.visible;
        if (found.single ? walk_pass_brick(w, &found, ends, span) : walk_pass_box(w, &found, ends, span))
            return true;
    }
    return false;
}

#endif
