/* Ray packets in a grid: each ray on its own way from brick to brick.
 *
 * PARAMETERS  VOL_DOUBLE
 * PROVIDES    Traversal; of the contract in traversal.h: traversal_begin() and what concerns stretches */
#ifndef VOL_TRACE_GRID_RAYS_TMPL_H
#define VOL_TRACE_GRID_RAYS_TMPL_H

#include "trace/bricks_tmpl.h"
#include "trace/packet_tmpl.h"
#include "trace/walk.h"

typedef struct Traversal {
    Walk walk[LANES];
    reals d[3], inv[3];           /* index space per world unit */

    /* The brick that a lane is in. */
    BrickSpan span[LANES];
    const real *values[LANES];    /* its voxels */
    const real *gradients[LANES]; /* its voxels' gradients, three planes; those of an earlier brick where due */
    unsigned gradients_due;       /* one bit per lane */
    ints in_stretch, shows, invalid; /* invalid: it has voxels that are not finite */
    reals lo, hi;                 /* range of the others */

    /* Cells: the way through the brick from where the ray entered it, world units along the ray. */
    bool single[LANES];           /* it is of one value and counts as one cell */
    reals e[3], at[3];            /* the entry, and the next cell to come, from the brick's first */
    reals next[3];                /* where the ray leaves that cell across each axis */
    reals u, end;                 /* where it enters that cell; where it leaves the brick */
    ints entered[3];              /* through that axis' face */
    reals sign[3], upper[3];      /* of the direction: 1 or -1; 1 or 0 */
    reals last[3];                /* the brick's last cell that way, in the domain */
    ints exit_axes[3];            /* the brick is left across that axis */

    /* The field at cells' ends as neighbours agree on it: at the last one's exit. */
    ints carried;
    reals carry;
    double carry_t[LANES];

    /* Samples: number j lies at run[a] + j step[a] from the brick's first voxel. */
    reals run[3], step[3];
} Traversal;

static inline double stretch_begin(const Traversal *w, unsigned i) { return w->span[i].t0; }
static inline double stretch_end(const Traversal *w, unsigned i) { return w->span[i].t1; }
static inline bool stretch_is_uniform(const Traversal *w, unsigned i) { return w->span[i].wide; }

static inline void traversal_begin(Traversal *w, const RayPacket *l)
{
    memset(w, 0, sizeof *w);
    for (size_t i = 0; i < LANES; i++) {
        Walk *walk = &w->walk[i];
        walk_begin(walk, l->scene->grid, &l->prepared->space, &l->rays[i < l->count ? i : 0]);
        w->values[i] = w->gradients[i] = scratch_zeros(l->scratch);
        w->carry_t[i] = NAN;
        for (int a = 0; a < 3; a++) {
            w->d[a][i] = (real)walk->d[a];
            w->inv[a][i] = walk->d[a] == 0 ? 0 : 1 / (real)walk->d[a];
        }
    }
    for (int a = 0; a < 3; a++) {
        ints up = (ints)(w->d[a] > 0);
        w->sign[a] = reals_select(up, reals_all(1), reals_all(-1));
        w->upper[a] = reals_select(up, reals_all(1), reals_all(0));
    }
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
 * up.  `entry`: see walk_next. */
static inline bool enter_brick(Traversal *w, RayPacket *l, unsigned i, bool entry)
{
    const VolGrid *grid = l->scene->grid;
    BrickSpan *span = &w->span[i];
    bool found = walk_next(&w->walk[i], entry, span);
    l->scratch->skipped.blocks += w->walk[i].blocks; /* now: a ray may end in the brick and come here no more */
    w->walk[i].blocks = 0;
    bool enough = !found || float_is_enough(l->prepared, span->brick);
    if (!found || !enough) {
        l->out[i].given_up = !enough;
        l->alive[i] = 0;
        return false;
    }
    const VolBrick *brick = &grid->bricks[span->brick];
    w->values[i] = brick_values(grid, l->scratch, w->values, span->brick);
    w->gradients_due |= 1u << i;
    w->invalid[i] = -(lane_int)brick->invalid;
    w->in_stretch[i] = -1;
    w->shows[i] = l->prepared->space.brick_visible[span->brick] == VOL_BRICK_SEEN ? -1 : 0;
    w->lo[i] = (real)brick->lo;
    w->hi[i] = (real)brick->hi;
    l->scratch->skipped.bricks_entered++;
    return true;
}

static inline bool traversal_enter_samples(Traversal *w, RayPacket *l, unsigned i) { return enter_brick(w, l, i, false); }

/* Makes the gradients of each of `mask`; the others have something that may be loaded from. */
static inline void need_gradients(Traversal *w, const RayPacket *l, ints mask)
{
    unsigned due = mask_bits(mask) & w->gradients_due;
    w->gradients_due &= ~due;
    FOR_LANES(i, due)
        w->gradients[i] = w->span[i].wide ? scratch_zeros(l->scratch)
                                          : brick_gradients(l->scene->grid, l->scratch, w->gradients, w->span[i].brick,
                                                            w->span[i].origin);
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
