/* The bricks along a ray, those that are invisible left out node by node and brick by brick.
 *
 * A brick's stretch [t0, t1] follows from its own planes alone, t(plane) = (plane - o) / d, never from the way that led
 * there: leaving bricks out changes nothing in those that remain.  An axis that the ray runs along has no planes. */
#ifndef VOL_RENDER_WALK_H
#define VOL_RENDER_WALK_H

#include <math.h>

#include "render/scene.h"

typedef struct Walk {
    const VolScene *scene;
    double o[3], d[3], inv[3]; /* index space, per world unit of t */
    double t, end;
    int32_t at[3];             /* brick coordinates */
    int32_t at_min[3], at_max[3];
} Walk;

typedef struct BrickSpan {
    double t0, t1;
    uint32_t brick;
    int32_t origin[3]; /* first cell */
    double e[3];       /* where the ray is at t0, from `origin`, in [0, 8] */
    unsigned exit_axes; /* bit a: t1 lies on the brick's plane across axis a */
} BrickSpan;

static inline double walk_plane(const Walk *w, int a, int32_t plane) { return (plane - w->o[a]) * w->inv[a]; }

/* The brick that holds the ray from t on: along each axis the last whose entry plane is not behind t. */
static inline void walk_locate(Walk *w)
{
    for (int a = 0; a < 3; a++) {
        double x = w->d[a] == 0 ? w->o[a] : w->o[a] + w->t * w->d[a];
        double lo = w->at_min[a], hi = w->at_max[a], b = floor(x / VOL_BRICK_CELLS);
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
    }
}

/* Where the ray leaves the block of `size` bricks (a power of two) that holds w->at. */
static inline double walk_exit(const Walk *w, int32_t size)
{
    double t = w->end;
    for (int a = 0; a < 3; a++)
        if (w->d[a] != 0) {
            int32_t first = w->at[a] & ~(size - 1);
            double plane = walk_plane(w, a, (w->d[a] > 0 ? first + size : first) * VOL_BRICK_CELLS);
            t = plane < t ? plane : t;
        }
    return t;
}

static inline void walk_begin(Walk *w, const VolScene *scene, const VolRay *ray)
{
    const VolGrid *grid = scene->grid;
    VolVec3 o = vol_apply(&grid->world_to_index, ray->origin);
    VolVec3 d = vol_apply_linear(&grid->world_to_index, ray->direction);
    double os[3] = {o.x, o.y, o.z}, ds[3] = {d.x, d.y, d.z};
    w->scene = scene;
    for (int a = 0; a < 3; a++) {
        w->o[a] = os[a];
        w->d[a] = ds[a];
        w->inv[a] = ds[a] == 0 ? 0 : 1 / ds[a];
        w->at_min[a] = grid->cell_min[a] >> 3;
        w->at_max[a] = grid->cell_max[a] >> 3;
    }
    w->t = ray->t0;
    w->end = ray->t1;
    walk_locate(w);
}

/* Steps to the neighbour through the plane(s) at `t`. */
static inline void walk_step(Walk *w, double t)
{
    for (int a = 0; a < 3; a++)
        if (w->d[a] != 0) {
            int32_t plane = (w->d[a] > 0 ? w->at[a] + 1 : w->at[a]) * VOL_BRICK_CELLS;
            if (walk_plane(w, a, plane) <= t)
                w->at[a] += w->d[a] > 0 ? 1 : -1;
        }
    w->t = t;
}

static inline void walk_span(const Walk *w, uint32_t brick, double exit, BrickSpan *span)
{
    span->t0 = w->t;
    span->t1 = exit;
    span->brick = brick;
    span->exit_axes = 0;
    for (int a = 0; a < 3; a++) {
        int32_t first = w->at[a] * VOL_BRICK_CELLS;
        span->origin[a] = first;
        double e = w->d[a] == 0 ? w->o[a] - first : fma(w->t, w->d[a], w->o[a] - first);
        e = e < 0 ? 0 : e > VOL_BRICK_CELLS ? VOL_BRICK_CELLS : e;
        if (w->d[a] != 0) {
            /* A brick's or the domain's own plane: the coordinate is known exactly. */
            double entry = w->d[a] > 0 ? w->scene->grid->domain_min[a] : w->scene->grid->domain_max[a];
            double brick_entry = first + (w->d[a] > 0 ? 0 : VOL_BRICK_CELLS);
            if ((brick_entry - w->o[a]) * w->inv[a] == w->t)
                e = brick_entry - first;
            else if ((entry - w->o[a]) * w->inv[a] == w->t)
                e = entry - first;
        }
        span->e[a] = e;
        if (w->d[a] != 0 && walk_plane(w, a, w->d[a] > 0 ? first + VOL_BRICK_CELLS : first) == exit)
            span->exit_axes |= 1u << a;
    }
}

/* The next visible brick's stretch, of positive length; false at the end of the ray. */
static inline bool walk_next(Walk *w, BrickSpan *span)
{
    const VolGrid *grid = w->scene->grid;
    while (w->t < w->end) {
        for (int a = 0; a < 3; a++)
            if (w->at[a] < w->at_min[a] || w->at[a] > w->at_max[a])
                return false;
        const VolNode *node = vol_grid_node(grid, w->at[0] >> 4, w->at[1] >> 4, w->at[2] >> 4);
        bool visible = node ? w->scene->node_visible[node - grid->nodes] : w->scene->background_visible;
        if (!visible) {
            w->t = walk_exit(w, VOL_NODE_BRICKS);
            if (w->t < w->end)
                walk_locate(w);
            continue;
        }
        uint32_t brick = 0;
        if (node)
            brick = node->bricks ? node->bricks[((w->at[0] & 15) * 16 + (w->at[1] & 15)) * 16 + (w->at[2] & 15)]
                                 : node->uniform;
        double exit = walk_exit(w, 1);
        bool found = w->scene->brick_visible[brick] && exit > w->t;
        if (found)
            walk_span(w, brick, exit, span);
        walk_step(w, exit > w->t ? exit : w->t);
        if (found)
            return true;
    }
    return false;
}

#endif
