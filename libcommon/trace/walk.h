/* The bricks along a ray, those that are invisible left out in blocks as large as can be.
 *
 * A brick's stretch [t0, t1] follows from its own planes alone, t(plane) = (plane - o) / d, never from the way that led
 * there: leaving bricks out changes nothing in those that remain.  An axis that the ray runs along has no planes.
 *
 * Outside the nodes that have bricks of their own, what is of one value is a box of many bricks: invisible, it is passed
 * over in one step; visible, it is one stretch.  Where gradients are asked for, its outermost bricks (space->margin), in
 * which they may differ from 0, remain bricks. */
#ifndef VOL_TRACE_WALK_H
#define VOL_TRACE_WALK_H

#include <math.h>
#include <string.h>

#include "trace/empty_space.h"
#include "trace/ray.h"

typedef struct Walk {
    const VolGrid *grid;
    const VolEmptySpace *space;
    double o[3], d[3], inv[3]; /* index space, per world unit of t */
    double t, end;
    double start;              /* of the ray itself */
    double ahead[3];           /* t of the plane where the ray leaves brick `at` across each axis; INFINITY: never */
    double facing[3];          /* a brick's side that the ray enters by: 0 or 8; -1: none */
    int32_t at[3];             /* brick coordinates */
    int32_t step[3];           /* 1, -1, or 0 where the ray runs along the planes */
    unsigned through;          /* bit a: `t` lies on the entry plane of brick `at` across axis a */
    int32_t at_min[3], at_max[3];
    const VolNode *node;       /* that holds `at`, where node_at says so; NULL: background */
    int32_t node_at[3];
    const VolRoot *root;       /* that holds `at`, where root_at says so and no node does; NULL: background */
    int32_t root_at[3];
    uint64_t blocks;           /* passed over, invisible, and not yet counted */
} Walk;

/* Bricks that are all the same one. */
typedef struct WalkBox {
    int32_t lo[3], hi[3];
} WalkBox;

typedef struct BrickSpan {
    double t0, t1;
    uint32_t brick;
    int32_t origin[3];  /* first cell */
    double e[3];        /* where asked for: where the ray is at t0, from `origin`, in [0, 8] */
    unsigned exit_axes; /* and the axes across whose planes t1 lies: bit a */
    bool wide;          /* through many bricks of one value; `origin` is the first one's, and no gradient differs from 0 */
} BrickSpan;

static inline double walk_plane(const Walk *w, int a, int32_t plane) { return (plane - w->o[a]) * w->inv[a]; }

/* Where the ray leaves a block of `size` bricks (a power of two) around `at`, across one axis. */
static inline double walk_leaves(const Walk *w, int a, int32_t size)
{
    int32_t first = w->at[a] & ~(size - 1);
    return w->d[a] == 0 ? INFINITY : walk_plane(w, a, (w->d[a] > 0 ? first + size : first) * VOL_BRICK_CELLS);
}

/* The brick that holds the ray from t on: along each axis the last whose entry plane is not behind t. */
static inline void walk_locate(Walk *w)
{
    for (int a = 0; a < 3; a++) {
        double x = w->d[a] == 0 ? w->o[a] : w->o[a] + w->t * w->d[a];
        double lo = w->at_min[a], hi = w->at_max[a], b = floor(x * (1.0 / VOL_BRICK_CELLS));
        int32_t at = (int32_t)(b < lo ? lo : b > hi ? hi : b);
        if (w->d[a] > 0) {
            while (at < w->at_max[a] && walk_plane(w, a, (at + 1) * VOL_BRICK_CELLS) <= w->t)
                at++;
            while (at > w->at_min[a] && walk_plane(w, a, at * VOL_BRICK_CELLS) > w->t)
                at--;
        } else if (w->d[a] < 0) {
            while (at > w->at_min[a] && walk_plane(w, a, at * VOL_BRICK_CELLS) <= w->t)
                at--;
            while (at < w->at_max[a] && walk_plane(w, a, (at + 1) * VOL_BRICK_CELLS) > w->t)
                at++;
        }
        w->at[a] = at;
        w->ahead[a] = walk_leaves(w, a, 1);
    }
    w->through = 0;
    for (int a = 0; a < 3; a++)
        if (w->d[a] != 0 && walk_plane(w, a, w->at[a] * VOL_BRICK_CELLS + (int32_t)w->facing[a]) == w->t)
            w->through |= 1u << a;
}

/* Where the ray leaves the block of `size` bricks that holds w->at. */
static inline double walk_exit(const Walk *w, int32_t size)
{
    double t = w->end;
    for (int a = 0; a < 3; a++) {
        double leaves = walk_leaves(w, a, size);
        t = leaves < t ? leaves : t;
    }
    return t;
}

/* The ray in index space.  Where it runs along a plane of voxels and lies in it but for rounding, it lies in it: else what
 * is said of the plane alone, a plateau at an isosurface's value, would be lost to the voxels beside it. */
static inline void walk_ray(const VolGrid *grid, const VolRay *ray, double os[3], double ds[3])
{
    const double(*m)[3] = grid->world_to_index.m;
    VolVec3 o = vol_apply(&grid->world_to_index, ray->origin);
    VolVec3 d = vol_apply_linear(&grid->world_to_index, ray->direction);
    os[0] = o.x, os[1] = o.y, os[2] = o.z;
    ds[0] = d.x, ds[1] = d.y, ds[2] = d.z;
    for (int a = 0; a < 3; a++) {
        double terms = fabs(ray->origin.x * m[0][a]) + fabs(ray->origin.y * m[1][a]) + fabs(ray->origin.z * m[2][a]);
        double plane = floor(os[a] + 0.5);
        if (ds[a] == 0 && fabs(os[a] - plane) <= 0x1p-47 * (terms + fabs(m[3][a])))
            os[a] = plane;
    }
}

/* Bricks outside the box around the visible ones are never looked at. */
static inline void walk_begin(Walk *w, const VolGrid *grid, const VolEmptySpace *space, const VolRay *ray)
{
    double os[3], ds[3];
    walk_ray(grid, ray, os, ds);
    w->grid = grid;
    w->space = space;
    w->t = w->start = ray->t0;
    w->end = ray->t1;
    w->node_at[0] = w->root_at[0] = INT32_MAX;
    w->blocks = 0;
    for (int a = 0; a < 3; a++) {
        w->o[a] = os[a];
        w->d[a] = ds[a];
        w->inv[a] = ds[a] == 0 ? 0 : 1 / ds[a];
        w->step[a] = (ds[a] > 0) - (ds[a] < 0);
        w->facing[a] = ds[a] < 0 ? VOL_BRICK_CELLS : ds[a] > 0 ? 0 : -1;
        w->at_min[a] = space->visible_min[a];
        w->at_max[a] = space->visible_max[a];
        if (w->d[a] != 0) {
            bool up = w->d[a] > 0;
            int32_t in = up ? w->at_min[a] : w->at_max[a] + 1, out = up ? w->at_max[a] + 1 : w->at_min[a];
            double entry = walk_plane(w, a, in * VOL_BRICK_CELLS), exit = walk_plane(w, a, out * VOL_BRICK_CELLS);
            w->t = entry > w->t ? entry : w->t;
            w->end = exit < w->end ? exit : w->end;
        } else if (w->o[a] < w->at_min[a] * VOL_BRICK_CELLS || w->o[a] > (w->at_max[a] + 1) * VOL_BRICK_CELLS) {
            w->end = -INFINITY;
        }
    }
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
            w->ahead[a] = walk_plane(w, a, w->at[a] * VOL_BRICK_CELLS + VOL_BRICK_CELLS - (int32_t)w->facing[a]);
        }
    w->t = t;
}

static inline double within_brick(double e)
{
    e = e > 0 ? e : 0;
    return e < VOL_BRICK_CELLS ? e : VOL_BRICK_CELLS;
}

/* Where the ray enters the brick.  On a brick's or the domain's own plane the coordinate is known exactly. */
static inline void walk_entry(const Walk *w, BrickSpan *span)
{
    for (int a = 0; a < 3; a++) {
        double e = within_brick(fma(w->t, w->d[a], w->o[a] - span->origin[a]));
        span->e[a] = w->through >> a & 1 ? w->facing[a] : e;
    }
    if (w->t != w->start)
        return;
    for (int a = 0; a < 3; a++) {
        double entry = w->d[a] > 0 ? w->grid->domain_min[a] : w->grid->domain_max[a];
        if (w->d[a] != 0 && !(w->through >> a & 1) && (entry - w->o[a]) * w->inv[a] == w->t)
            span->e[a] = within_brick(entry - w->at[a] * VOL_BRICK_CELLS);
    }
}

/* Whether t is where the ray leaves the domain across axis a, through a face of cells (not in the middle of the only voxel
 * along that axis). */
static inline bool ends_on_face(const Walk *w, int a, double t)
{
    const VolGrid *grid = w->grid;
    double face = w->d[a] > 0 ? grid->domain_max[a] : grid->domain_min[a];
    return w->d[a] != 0 && grid->domain_min[a] + 1 <= grid->domain_max[a] && face == floor(face) &&
           (face - w->o[a]) * w->inv[a] == t;
}

/* `ahead`: where the planes are that the stretch may end at. */
static inline void walk_span(const Walk *w, uint32_t brick, double exit, const double ahead[3], bool entry, BrickSpan *span)
{
    span->t0 = w->t;
    span->t1 = exit;
    span->brick = brick;
    span->exit_axes = 0;
    span->wide = false;
    for (int a = 0; a < 3; a++)
        span->origin[a] = w->at[a] * VOL_BRICK_CELLS;
    if (!entry)
        return;
    for (int a = 0; a < 3; a++)
        span->exit_axes |= (unsigned)(ahead[a] == exit || ends_on_face(w, a, exit)) << a;
    walk_entry(w, span);
}

/* ---- What is of one value ---- */

/* The bricks like the one at w->at in a block of 2^log2 bricks a side, `octants` of which are given. */
static inline void walk_octants(const Walk *w, const uint32_t octants[8], int log2, uint32_t *brick, WalkBox *box)
{
    unsigned here = vol_octant_of(w->at[0], w->at[1], w->at[2], log2);
    *brick = octants[here];
    for (int a = 0; a < 3; a++) {
        unsigned bit = 4u >> a;
        bool ends = false; /* in another value along this axis */
        for (unsigned k = 0; k < 8; k++)
            ends = ends || octants[k] != octants[k ^ bit];
        int32_t first = w->at[a] & -(1 << log2), last = first + ((1 << log2) - 1);
        box->lo[a] = ends && here & bit ? last : first;
        box->hi[a] = ends && !(here & bit) ? last - 1 : last;
    }
}

/* The bricks like the one at w->at, where no node has bricks of its own. */
static inline void walk_look_wide(Walk *w, uint32_t *brick, WalkBox *box)
{
    if (w->node) {
        walk_octants(w, w->node->octants, VOL_NODE_LOG2, brick, box);
        return;
    }
    int32_t at[3];
    for (int a = 0; a < 3; a++)
        at[a] = w->at[a] >> VOL_ROOT_LOG2;
    if (memcmp(at, w->root_at, sizeof at) != 0) {
        memcpy(w->root_at, at, sizeof at);
        w->root = vol_grid_root(w->grid, at[0], at[1], at[2]);
    }
    *brick = 0;
    if (w->root)
        walk_octants(w, w->root->octants, VOL_ROOT_LOG2, brick, box);
    if (w->root && !w->root->has_nodes)
        return;
    int log2 = vol_grid_empty_around(w->grid, w->node_at);
    for (int a = 0; a < 3; a++) {
        int32_t first = w->at[a] & -(1 << log2), last = first + ((1 << log2) - 1);
        box->lo[a] = w->root && box->lo[a] > first ? box->lo[a] : first;
        box->hi[a] = w->root && box->hi[a] < last ? box->hi[a] : last;
    }
}

static inline double walk_leaves_box(const Walk *w, const WalkBox *box, double ahead[3])
{
    double t = w->end;
    for (int a = 0; a < 3; a++) {
        ahead[a] = w->d[a] == 0 ? INFINITY : walk_plane(w, a, (w->d[a] > 0 ? box->hi[a] + 1 : box->lo[a]) * VOL_BRICK_CELLS);
        t = ahead[a] < t ? ahead[a] : t;
    }
    return t;
}

/* What of a visible box may be crossed in one go; false: nothing, at w->at. */
static inline bool walk_narrow(const Walk *w, uint32_t brick, WalkBox *box)
{
    int32_t margin = w->space->margin;
    bool inside = margin >= 0 && vol_brick_is_uniform(&w->grid->bricks[brick]);
    for (int a = 0; a < 3; a++) {
        box->lo[a] += margin;
        box->hi[a] -= margin;
        inside = inside && w->at[a] >= box->lo[a] && w->at[a] <= box->hi[a];
    }
    return inside;
}

/* Crosses a box of bricks that are all the same, which is done with then; true: it is a stretch to be seen. */
static inline bool walk_cross(Walk *w, uint32_t brick, const WalkBox *box, bool visible, bool entry, BrickSpan *span)
{
    double ahead[3], exit = walk_leaves_box(w, box, ahead);
    bool found = visible && exit > w->t;
    if (found) {
        walk_span(w, brick, exit, ahead, entry, span);
        span->wide = true;
    }
    w->t = exit;
    if (w->t < w->end)
        walk_locate(w);
    return found;
}

/* ---- On the way ---- */

/* Size of the invisible block around w->at as a power of two, or VOL_VISIBLE with the brick's number; VOL_WIDE: to be asked
 * for by walk_look_wide. */
static inline unsigned walk_look(Walk *w, uint32_t *brick)
{
    int32_t n[3] = {w->at[0] >> 4, w->at[1] >> 4, w->at[2] >> 4};
    if (n[0] != w->node_at[0] || n[1] != w->node_at[1] || n[2] != w->node_at[2]) {
        w->node = vol_grid_node(w->grid, n[0], n[1], n[2]);
        memcpy(w->node_at, n, sizeof n);
    }
    if (!w->node || !w->node->bricks)
        return VOL_WIDE;
    size_t place = (size_t)(((w->at[0] & 15) * 16 + (w->at[1] & 15)) * 16 + (w->at[2] & 15));
    *brick = w->node->bricks[place];
    return w->space->levels[(size_t)w->node->detail * VOL_NODE_ENTRIES + place];
}

/* The next visible brick's stretch, of positive length; false at the end of the ray.  `entry`: also where it begins and
 * ends in space. */
static inline bool walk_next(Walk *w, bool entry, BrickSpan *span)
{
    while (w->t < w->end) {
        for (int a = 0; a < 3; a++)
            if (w->at[a] < w->at_min[a] || w->at[a] > w->at_max[a])
                return false;
        uint32_t brick;
        unsigned level = walk_look(w, &brick);
        if (level == VOL_WIDE) {
            WalkBox box;
            walk_look_wide(w, &brick, &box);
            level = w->space->brick_visible[brick] ? VOL_VISIBLE : 0;
            if (level != VOL_VISIBLE || walk_narrow(w, brick, &box)) {
                w->blocks += level != VOL_VISIBLE;
                if (walk_cross(w, brick, &box, level == VOL_VISIBLE, entry, span))
                    return true;
                continue;
            }
        }
        w->blocks += level != VOL_VISIBLE;
        if (level != VOL_VISIBLE && level > 0) {
            w->t = walk_exit(w, 1 << level);
            if (w->t < w->end)
                walk_locate(w);
            continue;
        }
        double exit = w->end;
        for (int a = 0; a < 3; a++)
            exit = w->ahead[a] < exit ? w->ahead[a] : exit;
        bool found = level == VOL_VISIBLE && exit > w->t;
        if (found)
            walk_span(w, brick, exit, w->ahead, entry, span);
        walk_step(w, exit > w->t ? exit : w->t);
        if (found)
            return true;
    }
    return false;
}

#endif
