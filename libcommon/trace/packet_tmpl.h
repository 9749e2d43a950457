/* LANES rays side by side: each on its own way from brick to brick, whatever the others do.  What a lane computes depends
 * on its own ray alone, so that a picture does not depend on which rays travel together.
 */
#ifndef VOL_TRACE_PACKET_TMPL_H
#define VOL_TRACE_PACKET_TMPL_H

#include "trace/bricks_tmpl.h"
#include "trace/tf_tables_tmpl.h"
#include "simd/reals.h"
#include "trace/walk.h"

typedef struct RayPacket {
    const VolScene *scene;
    const TfTables *tables;
    VolScratch *scratch;
    const VolRay *rays;
    size_t count;
    VolRadiance *out;
    Walk walk[LANES];
    BrickSpan span[LANES];          /* the brick that a lane is in */
    const real *values[LANES];      /* its voxels */
    const real *gradients[LANES];   /* its voxels' gradients, three planes; those of an earlier brick where due */
    bool single[LANES];             /* it is of one value and counts as one cell */
    reals d[3], inv[3], view[3];    /* index space per world unit; world, towards the eye */
    reals termination_depth;
    ints alive, in_brick, invalid;
    unsigned gradients_due;         /* one bit per lane */
} RayPacket;

/* The lanes whose bit is set, one after the other. */
#define FOR_LANES(i, bits)                                                                                                 \
    for (unsigned left_ = (bits), i = 0; left_ && (i = (unsigned)__builtin_ctz(left_), true); left_ &= left_ - 1)

static inline void packet_begin(RayPacket *l, const VolScene *scene, VolScratch *scratch, const VolRay *rays, size_t count,
                                VolRadiance *out)
{
    *l = (RayPacket){.scene = scene, .tables = SCENE_TABLES(scene), .scratch = scratch, .rays = rays, .count = count,
                 .out = out};
    for (size_t i = 0; i < LANES; i++) {
        const VolRay *ray = &rays[i < count ? i : 0];
        Walk *w = &l->walk[i];
        if (i < count)
            out[i] = (VolRadiance){.depth = INFINITY};
        walk_begin(w, scene, ray);
        l->values[i] = l->gradients[i] = scratch_zeros(scratch);
        l->termination_depth[i] = (real)vol_scene_termination_depth(scene, ray->t1 - ray->t0);
        for (int a = 0; a < 3; a++) {
            l->d[a][i] = (real)w->d[a];
            l->inv[a][i] = w->d[a] == 0 ? 0 : 1 / (real)w->d[a];
        }
        l->view[0][i] = (real)-ray->direction.x;
        l->view[1][i] = (real)-ray->direction.y;
        l->view[2][i] = (real)-ray->direction.z;
        l->alive[i] = i < count ? -1 : 0;
    }
}

static inline bool float_is_enough(const VolScene *scene, uint32_t brick)
{
#ifdef VOL_DOUBLE
    (void)scene, (void)brick;
    return true;
#else
    return !scene->ill_conditioned || !scene->ill_conditioned[brick];
#endif
}

/* Takes lane i into its next visible brick; false, and the lane is dead: there is none, or the ray is given up.  `entry`:
 * see walk_next. */
static inline bool packet_enter_brick(RayPacket *l, unsigned i, bool single_cells, bool entry)
{
    BrickSpan *span = &l->span[i];
    bool found = walk_next(&l->walk[i], entry, span);
    l->scratch->skipped.blocks += l->walk[i].blocks; /* now: a ray may end in the brick and come here no more */
    l->walk[i].blocks = 0;
    bool enough = !found || float_is_enough(l->scene, span->brick);
    if (!found || !enough) {
        l->out[i].given_up = !enough;
        l->alive[i] = 0;
        return false;
    }
    const VolBrick *brick = &l->scene->grid->bricks[span->brick];
    l->single[i] = span->wide || (single_cells && vol_brick_is_uniform(brick));
    l->values[i] = brick_values(l->scene->grid, l->scratch, l->values, span->brick);
    l->gradients_due |= 1u << i;
    l->invalid[i] = -(lane_int)brick->invalid;
    l->in_brick[i] = -1;
    l->scratch->skipped.bricks_entered++;
    return true;
}

/* Makes the gradients of each of `mask`; the others have something that may be loaded from. */
static inline void packet_need_gradients(RayPacket *l, ints mask)
{
    unsigned due = mask_bits(mask) & l->gradients_due;
    l->gradients_due &= ~due;
    FOR_LANES(i, due)
        l->gradients[i] = l->span[i].wide ? scratch_zeros(l->scratch)
                                          : brick_gradients(l->scene->grid, l->scratch, l->gradients, l->span[i].brick,
                                                            l->span[i].origin);
}

/* ---- Searching the transfer function ---- */

/* How many of n ascending numbers are <= v (or < v, where `below`). */
ALWAYS_INLINE ints count_up_to(const real *sorted, size_t n, reals v, bool below)
{
    ints found = {0};
    if (n <= FEW_KNOTS) {
        for (size_t k = 0; k < n; k++)
            found -= below ? (ints)(v > sorted[k]) : (ints)(v >= sorted[k]);
        return found;
    }
    for (int i = 0; i < LANES; i++) {
        size_t lo = 0, hi = n;
        while (lo < hi) {
            size_t mid = (lo + hi) / 2;
            if (below ? sorted[mid] < v[i] : sorted[mid] <= v[i])
                lo = mid + 1;
            else
                hi = mid;
        }
        found[i] = (lane_int)lo;
    }
    return found;
}

/* The intervals that hold v: how many knots are <= v. */
ALWAYS_INLINE ints intervals_of(const TfTables *o, reals v)
{
    if (o->knot_count <= FEW_KNOTS)
        return count_up_to(o->edges + 1, o->knot_count, v, false);
    reals place = reals_clamp((v - o->bucket_lo) * o->bucket_scale, 0, KNOT_BUCKETS - 1);
    ints j = gather_ints(o->buckets, __builtin_convertvector(place, ints));
    for (;;) {
        /* Beside a hole v may be infinite: nothing is above the last edge. */
        ints above = (ints)(gather_reals(o->edges + 1, j) <= v) & (ints)(j < (lane_int)o->knot_count);
        if (!any(above))
            return j;
        j -= above;
    }
}

/* Both ends' of a range. */
ALWAYS_INLINE void intervals_around(const TfTables *o, reals lo, reals hi, ints *low, ints *high)
{
    if (o->knot_count > FEW_KNOTS) {
        *low = intervals_of(o, lo);
        *high = intervals_of(o, hi);
        return;
    }
    ints a = {0}, b = {0};
    for (size_t k = 1; k <= o->knot_count; k++) {
        reals knot = reals_all(o->edges[k]);
        a -= (ints)(lo >= knot);
        b -= (ints)(hi >= knot);
    }
    *low = a;
    *high = b;
}

/* Per interval: whether anything is in it. */
ALWAYS_INLINE ints intervals_visible(const TfTables *o, ints j) { return (ints)(gather_ints(o->next_visible, j) == j); }

#endif
