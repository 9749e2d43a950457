/* The bricks along one ray, those that are invisible left out in blocks as large as can be.
 *
 * A brick's stretch [t0, t1] follows from its own planes alone, t(plane) = (plane - o) / d, never from the way that led
 * there: leaving bricks out changes nothing in those that remain, and packet_walk_tmpl.h finds the same.  An axis that the
 * ray runs along has no planes. */
#ifndef VOL_TRACE_WALK_H
#define VOL_TRACE_WALK_H

#include "trace/brick_finder.h"
#include "trace/index_ray.h"

typedef struct Walk {
    BrickFinder finder;
    IndexRay ray;
    double t, end;
    double start;              /* of the ray itself */
    double ahead[3];           /* t of the plane where the ray leaves brick `at` across each axis; INFINITY: never */
    double facing[3];          /* a brick's side that the ray enters by: 0 or 8; -1: none */
    int32_t at[3];             /* brick coordinates */
    int32_t step[3];           /* 1, -1, or 0 where the ray runs along the planes */
    unsigned through;          /* bit a: `t` lies on the entry plane of brick `at` across axis a */
    uint64_t blocks;           /* passed over, invisible, and not yet counted */
} Walk;

typedef struct BrickSpan {
    double t0, t1;
    uint32_t brick;
    int32_t origin[3];  /* first cell */
    double e[3];        /* where asked for: where the ray is at t0, from `origin`, in [0, 8] */
    unsigned exit_axes; /* and the axes across whose planes t1 lies: bit a */
    bool wide;          /* through many bricks of one value; `origin` is the first one's, and no gradient differs from 0 */
} BrickSpan;

/* Where the ray leaves bricks lo to hi across an axis. */
static inline double walk_leaves(const Walk *w, int a, int32_t lo, int32_t hi)
{
    if (w->ray.d[a] == 0)
        return INFINITY;
    return plane_time(&w->ray, a, (w->ray.d[a] > 0 ? (double)hi + 1 : (double)lo) * VOL_BRICK_CELLS);
}

/* Comes to the brick that holds the ray from t on. */
static inline void walk_locate(Walk *w)
{
    const VolEmptySpace *space = w->finder.space;
    w->through = 0;
    for (int a = 0; a < 3; a++) {
        w->at[a] = brick_at_time(&w->ray, a, w->t, space->visible_min[a], space->visible_max[a]);
        w->ahead[a] = walk_leaves(w, a, w->at[a], w->at[a]);
        double entry = (double)w->at[a] * VOL_BRICK_CELLS + w->facing[a];
        if (w->ray.d[a] != 0 && plane_time(&w->ray, a, entry) == w->t)
            w->through |= 1u << a;
    }
}

static inline void walk_begin(Walk *w, const VolGrid *grid, const VolEmptySpace *space, const VolRay *world)
{
    finder_begin(&w->finder, grid, space);
    w->ray = index_ray(grid, world);
    w->t = w->start = world->t0;
    w->end = world->t1;
    w->blocks = 0;
    for (int a = 0; a < 3; a++) {
        double d = w->ray.d[a];
        w->step[a] = (d > 0) - (d < 0);
        w->facing[a] = d < 0 ? VOL_BRICK_CELLS : d > 0 ? 0 : -1;
    }
    cut_to_visible(&w->ray, space, &w->t, &w->end);
    if (w->t < w->end)
        walk_locate(w);
}

/* Steps to the neighbour through the plane(s) at `t`. */
static inline void walk_step(Walk *w, double t)
{
    w->through = 0;
    for (int a = 0; a < 3; a++)
        if (w->ahead[a] <= t) {
            w->through |= (unsigned)(w->ahead[a] == t) << a;
            w->at[a] += w->step[a];
            w->ahead[a] = plane_time(&w->ray, a, (double)w->at[a] * VOL_BRICK_CELLS + (VOL_BRICK_CELLS - w->facing[a]));
        }
    w->t = t;
}

/* Where the ray enters the brick.  On a brick's or the domain's own plane the coordinate is known exactly. */
static inline void walk_entry(const Walk *w, BrickSpan *span)
{
    for (int a = 0; a < 3; a++) {
        double e = within_brick(fma(w->t, w->ray.d[a], w->ray.o[a] - span->origin[a]));
        span->e[a] = w->through >> a & 1 ? w->facing[a] : e;
        if (w->t == w->start && !(w->through >> a & 1) && begins_on_face(w->finder.grid, &w->ray, a, w->t))
            span->e[a] = within_brick(first_face(w->finder.grid, &w->ray, a) - span->origin[a]);
    }
}

/* `ahead`: where the planes are that the stretch may end at. */
static inline void walk_span(const Walk *w, uint32_t brick, double exit, const double ahead[3], bool ends, BrickSpan *span)
{
    span->t0 = w->t;
    span->t1 = exit;
    span->brick = brick;
    span->exit_axes = 0;
    span->wide = false;
    for (int a = 0; a < 3; a++)
        span->origin[a] = w->at[a] * VOL_BRICK_CELLS;
    if (!ends)
        return;
    for (int a = 0; a < 3; a++)
        span->exit_axes |= (unsigned)(ahead[a] == exit || last_face_time(w->finder.grid, &w->ray, a) == exit) << a;
    walk_entry(w, span);
}

/* Passes a box of bricks; true: it is a stretch to be seen. */
static inline bool walk_pass_box(Walk *w, const BrickFound *found, bool ends, BrickSpan *span)
{
    double ahead[3], exit = w->end;
    for (int a = 0; a < 3; a++) {
        ahead[a] = walk_leaves(w, a, found->box.lo[a], found->box.hi[a]);
        exit = ahead[a] < exit ? ahead[a] : exit;
    }
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

static inline bool walk_pass_brick(Walk *w, const BrickFound *found, bool ends, BrickSpan *span)
{
    double exit = w->end;
    for (int a = 0; a < 3; a++)
        exit = w->ahead[a] < exit ? w->ahead[a] : exit;
    bool seen = found->visible && exit > w->t;
    if (seen)
        walk_span(w, found->brick, exit, w->ahead, ends, span);
    walk_step(w, exit > w->t ? exit : w->t);
    return seen;
}

/* The next visible brick's stretch, of positive length; false at the end of the ray.  `ends`: also where it begins and ends
 * in space. */
static inline bool walk_next(Walk *w, bool ends, BrickSpan *span)
{
    while (w->t < w->end) {
        BrickFound found = find_brick(&w->finder, w->at);
        w->blocks += !found.visible;
        if (found.single ? walk_pass_brick(w, &found, ends, span) : walk_pass_box(w, &found, ends, span))
            return true;
    }
    return false;
}

#endif
