/* Ray packets in a grid: each ray on its own way from brick to brick, or brick by brick all that have come to it.
 *
 * PARAMETERS  VOL_DOUBLE
 * PROVIDES    Traversal; of the contract in traversal.h: traversal_begin() and what concerns stretches */
#ifndef VOL_TRACE_GRID_RAYS_TMPL_H
#define VOL_TRACE_GRID_RAYS_TMPL_H

#include "trace/bricks_tmpl.h"
#include "trace/packet_tmpl.h"
#include "trace/packet_walk_tmpl.h"
#include "trace/trilinear_tmpl.h"

typedef struct Traversal {
    Walk walk[LANES];             /* of rays on their own way */
    PacketWalk packet;            /* of rays together */
    bool together;
    reals d[3], inv[3];           /* index space per world unit */
    axes domain_min, domain_max, cell_min, cell_max; /* the grid's */
    ints in_plane[3];             /* the ray lies in a plane of voxels across the axis */
    bool some_in_plane;

    /* The brick that a lane is in. */
    Stretches in;
    uint32_t brick[LANES];
    ints uniform;                 /* the stretch is: many bricks of one value */
    const real *values[LANES];    /* its voxels */
    const real *gradients[LANES]; /* its voxels' gradients, three planes; those of an earlier brick where due */
    reals steepest;               /* no component of those in world space is larger */
    unsigned gradients_due;       /* one bit per lane */
    ints in_stretch, shows, invalid; /* invalid: it has voxels that are not finite */
    reals lo, hi;                 /* range of the others */

    /* Cells: the way through the brick from where the ray entered it, world units along the ray. */
    reals e[3], at[3];            /* the entry, and the next cell to come, from the brick's first */
    reals next[3];                /* where the ray leaves that cell across each axis */
    reals u, end;                 /* where it enters that cell; where it leaves the brick */
    ints entered[3];              /* through that axis' face */
    reals sign[3], upper[3];      /* of the direction: 1 or -1; 1 or 0 */
    reals last[3];                /* the brick's last cell that way, in the domain */
    ints exit_axes[3];            /* the brick is left across that axis */

    /* The field at cells' ends as neighbours agree on it: at the last one's exit. */
    reals blur;                   /* how far rounding may have taken a ray from a plane, in cells */
    ints carried;
    reals carry;
    double carry_t[LANES];

    /* Samples: number j lies at run[a] + j step[a] from the brick's first voxel. */
    reals run[3], step[3];
} Traversal;

static inline const double *stretch_begin(const Traversal *w) { return w->in.begin; }
static inline const double *stretch_end(const Traversal *w) { return w->in.past; }
static inline ints stretch_is_uniform(const Traversal *w) { return w->uniform; }

static inline void brick_origin(const Traversal *w, unsigned i, int32_t origin[3])
{
    for (int a = 0; a < 3; a++)
        origin[a] = (int32_t)w->in.origin[a][i];
}

/* How far rounding may have taken the ray from planes of voxels, however great the coordinates. */
static inline double ray_blur(const VolGrid *grid, const IndexRay *ray)
{
    double most = 0;
    for (int a = 0; a < 3; a++) {
        double low = coordinate_blur(ray, a, grid->domain_min[a]), high = coordinate_blur(ray, a, grid->domain_max[a]);
        most = low > most ? low : most;
        most = high > most ? high : most;
    }
    return most < 0x1p-20 - 0x1p-48 ? most + 0x1p-48 : 0x1p-20;
}

static inline void traversal_begin(Traversal *w, const RayPacket *l, bool may_wait)
{
    CLEAR_FROM(w, together);
    for (int a = 0; a < 3; a++) {
        w->domain_min[a] = l->scene->volume.grid->domain_min[a];
        w->domain_max[a] = l->scene->volume.grid->domain_max[a];
        w->cell_min[a] = l->scene->volume.grid->cell_min[a];
        w->cell_max[a] = l->scene->volume.grid->cell_max[a];
    }
    for (size_t i = 0; i < LANES; i++) {
        Walk *walk = &w->walk[i];
        walk_begin(walk, l->scene->volume.grid, &l->prepared->space, &l->rays[i < l->count ? i : 0]);
        w->values[i] = w->gradients[i] = scratch_zeros(l->scratch);
        w->carry_t[i] = NAN;
        w->blur[i] = (real)ray_blur(l->scene->volume.grid, &walk->ray);
        for (int a = 0; a < 3; a++) {
            w->d[a][i] = (real)walk->d[a];
            w->inv[a][i] = walk->d[a] == 0 ? 0 : 1 / (real)walk->d[a];
            w->in_plane[a][i] = lies_in_plane(&walk->ray, a) ? -1 : 0;
            w->some_in_plane = w->some_in_plane || lies_in_plane(&walk->ray, a);
        }
    }
    if (may_wait) {
        packet_walk_begin(&w->packet, w->walk, l->count);
        w->together = rays_are_close(&w->packet);
    }
    for (int a = 0; a < 3; a++) {
        ints up = (ints)(w->d[a] > 0);
        w->sign[a] = reals_select(up, reals_all(1), reals_all(-1));
        w->upper[a] = reals_select(up, reals_all(1), reals_all(0));
    }
}

/* Cells under rays that lie in faces of theirs: p within the cell, at 0 or 1 there but for rounding. */
MAYBE_UNUSED static void collapse_in_planes(const Traversal *w, reals corners[8], const reals p[3])
{
    for (int a = 0; a < 3; a++)
        collapse_cell(corners, a, w->in_plane[a], (ints)(p[a] > (real)0.5));
}

static inline bool float_is_enough(const VolPrepared *prepared, uint32_t brick)
{
#ifdef VOL_DOUBLE
    (void)prepared, (void)brick;
    return true;
#else
    return !prepared->ill_conditioned || !prepared->ill_conditioned[brick];
#endif
}

/* Takes lane i into its next visible brick; false, and the lane is not alive any more: there is none, or the ray is given
 * up.  `ends`: see walk_next. */
static inline bool enter_brick(Traversal *w, RayPacket *l, unsigned i, bool ends, BrickSpan *span)
{
    bool found = walk_next(&w->walk[i], ends, span);
    l->scratch->skipped.blocks += w->walk[i].blocks; /* now: a ray may end in the brick and come here no more */
    w->walk[i].blocks = 0;
    bool enough = !found || float_is_enough(l->prepared, span->brick);
    if (!found || !enough) {
        l->out[i].given_up = !enough;
        l->alive[i] = 0;
        return false;
    }
    const VolBrick *brick = &l->scene->volume.grid->bricks[span->brick];
    w->in.begin[i] = span->t0;
    w->in.past[i] = span->t1;
    for (int a = 0; a < 3; a++)
        w->in.origin[a][i] = span->origin[a];
    w->brick[i] = span->brick;
    w->values[i] = brick_values(l->scene->volume.grid, l->scratch, w->values, span->brick);
    w->uniform[i] = -(lane_int)span->wide;
    w->gradients_due |= 1u << i;
    w->invalid[i] = -(lane_int)brick->invalid;
    w->in_stretch[i] = -1;
    w->shows[i] = l->prepared->space.brick_visible[span->brick] == VOL_BRICK_SEEN ? -1 : 0;
    w->lo[i] = (real)brick->lo;
    w->hi[i] = (real)brick->hi;
    l->scratch->skipped.bricks_entered++;
    return true;
}

static inline bool traversal_enter_samples(Traversal *w, RayPacket *l, unsigned i)
{
    BrickSpan span;
    return enter_brick(w, l, i, false, &span);
}

/* ---- Together ---- */

/* What the lanes of the visit know of their brick. */
ALWAYS_INLINE void settle_in(Traversal *w, RayPacket *l, const Visit *visit)
{
    const VolBrick *brick = &l->scene->volume.grid->bricks[visit->brick];
    const real *values = brick_values(l->scene->volume.grid, l->scratch, w->values, visit->brick);
    bool seen = l->prepared->space.brick_visible[visit->brick] == VOL_BRICK_SEEN;
    unsigned bits = mask_bits(visit->lanes);
    FOR_LANES(i, bits) {
        w->values[i] = values;
        w->brick[i] = visit->brick;
    }
    w->gradients_due |= bits;
    w->uniform = ints_select(visit->lanes, ints_all(-(lane_int)visit->wide), w->uniform);
    w->invalid = ints_select(visit->lanes, ints_all(-(lane_int)brick->invalid), w->invalid);
    w->shows = ints_select(visit->lanes, ints_all(-(lane_int)seen), w->shows);
    w->in_stretch |= visit->lanes;
    w->lo = reals_select(visit->lanes, reals_all((real)brick->lo), w->lo);
    w->hi = reals_select(visit->lanes, reals_all((real)brick->hi), w->hi);
    l->scratch->skipped.bricks_entered += (unsigned)__builtin_popcount(bits);
}

/* Takes those of `mask` that come to it first into the next visible brick; false, and none of them is alive any more: there
 * is none.  Nor are those that are given up. */
ALWAYS_INLINE bool visit_brick(Traversal *w, RayPacket *l, ints mask, Visit *visit)
{
    bool found = packet_walk_next(&w->packet, mask, visit, &w->in);
    l->scratch->skipped.blocks += w->packet.blocks;
    w->packet.blocks = 0;
    if (!found)
        l->alive &= ~mask;
    else if (!float_is_enough(l->prepared, visit->brick))
        give_up(l, visit->lanes);
    else
        settle_in(w, l, visit);
    return found;
}

static inline void traversal_visit_samples(Traversal *w, RayPacket *l, ints mask)
{
    Visit visit;
    while (any(mask) && visit_brick(w, l, mask, &visit))
        mask &= ~visit.lanes;
}

/* No component in world space is larger, where those in index space are no larger than these. */
ALWAYS_INLINE real world_steepest(const VolAffine *world_to_index, const real steepest[3])
{
    real most = 0;
    for (int i = 0; i < 3; i++) {
        const double *m = world_to_index->m[i];
        real sum = (real)fabs(m[0]) * steepest[0] + (real)fabs(m[1]) * steepest[1];
        most = real_max(most, sum + (real)fabs(m[2]) * steepest[2]);
    }
    return most;
}

/* Makes the gradients of each of `mask`; the others have something that may be loaded from. */
static inline void need_gradients(Traversal *w, const RayPacket *l, ints mask)
{
    unsigned due = mask_bits(mask) & w->gradients_due;
    w->gradients_due &= ~due;
    FOR_LANES(i, due) {
        int32_t origin[3];
        brick_origin(w, i, origin);
        if (w->uniform[i])
            w->gradients[i] = scratch_zeros(l->scratch);
        else
            w->gradients[i] = brick_gradients(l->scene->volume.grid, l->scratch, w->gradients, w->brick[i], origin);
        real steepest[3];
        for (int a = 0; a < 3; a++)
            steepest[a] = steepest_of(w->gradients[i], a);
        w->steepest[i] = world_steepest(&l->scene->volume.grid->world_to_index, steepest);
    }
}

/* World gradient from index-space gradient: g_world_i = sum_j d(index_j)/d(world_i) g_j (inverse transpose). */
ALWAYS_INLINE void world_gradients(const VolAffine *world_to_index, const reals g[3], reals out[3])
{
    for (int i = 0; i < 3; i++) {
        const double *m = world_to_index->m[i];
        out[i] = reals_fma(reals_all((real)m[2]), g[2], reals_fma(reals_all((real)m[1]), g[1], (real)m[0] * g[0]));
    }
}

#endif
