/* What there is at a brick's place: the brick, or the block of bricks around it that is passed in one step.
 *
 * Outside the nodes that have bricks of their own, what is of one value is a box of many bricks: invisible, it is passed
 * over in one step; visible, it is one stretch.  Where gradients are asked for, its outermost bricks (space->margin), in
 * which they may differ from 0, remain bricks. */
#ifndef VOL_TRACE_BRICK_FINDER_H
#define VOL_TRACE_BRICK_FINDER_H

#include <string.h>

#include "trace/empty_space.h"

/* Remembers where it was asked last: places that are asked for follow one another. */
typedef struct BrickFinder {
    const VolGrid *grid;
    const VolEmptySpace *space;
    const VolNode *node; /* of the place asked for last, where node_at says so; NULL: background */
    int32_t node_at[3];
    const VolRoot *root; /* of one without a node, where root_at says so; NULL: background */
    int32_t root_at[3];
} BrickFinder;

/* Bricks from lo to hi. */
typedef struct BrickBox {
    int32_t lo[3], hi[3];
} BrickBox;

static inline void finder_begin(BrickFinder *f, const VolGrid *grid, const VolEmptySpace *space)
{
    *f = (BrickFinder){.grid = grid, .space = space, .node_at = {INT32_MAX}, .root_at = {INT32_MAX}};
}

/* The bricks like the one at `at` in a block of 2^log2 bricks a side, `octants` of which are given. */
static inline void box_of_octants(const int32_t at[3], const uint32_t octants[8], int log2, uint32_t *brick, BrickBox *box)
{
    unsigned here = vol_octant_of(at[0], at[1], at[2], log2);
    *brick = octants[here];
    for (int a = 0; a < 3; a++) {
        unsigned bit = 4u >> a;
        bool ends = false; /* in another value along this axis */
        for (unsigned k = 0; k < 8; k++)
            ends = ends || octants[k] != octants[k ^ bit];
        int32_t first = at[a] & -(1 << log2), last = first + ((1 << log2) - 1);
        box->lo[a] = ends && here & bit ? last : first;
        box->hi[a] = ends && !(here & bit) ? last - 1 : last;
    }
}

/* The bricks like the one at `at`, where no node has bricks of its own. */
static inline void find_wide(BrickFinder *f, const int32_t at[3], uint32_t *brick, BrickBox *box)
{
    if (f->node) {
        box_of_octants(at, f->node->octants, VOL_NODE_LOG2, brick, box);
        return;
    }
    int32_t root_at[3];
    for (int a = 0; a < 3; a++)
        root_at[a] = at[a] >> VOL_ROOT_LOG2;
    if (memcmp(root_at, f->root_at, sizeof root_at) != 0) {
        memcpy(f->root_at, root_at, sizeof root_at);
        f->root = vol_grid_root(f->grid, root_at[0], root_at[1], root_at[2]);
    }
    *brick = 0;
    if (f->root)
        box_of_octants(at, f->root->octants, VOL_ROOT_LOG2, brick, box);
    if (f->root && !f->root->has_nodes)
        return;
    int log2 = vol_grid_empty_around(f->grid, f->node_at);
    for (int a = 0; a < 3; a++) {
        int32_t first = at[a] & -(1 << log2), last = first + ((1 << log2) - 1);
        box->lo[a] = f->root && box->lo[a] > first ? box->lo[a] : first;
        box->hi[a] = f->root && box->hi[a] < last ? box->hi[a] : last;
    }
}

/* What of a visible box may be crossed in one go; false: nothing, at `at`. */
static inline bool cut_margin(const BrickFinder *f, const int32_t at[3], uint32_t brick, BrickBox *box)
{
    int32_t margin = f->space->margin;
    bool inside = vol_brick_is_uniform(&f->grid->bricks[brick]);
    for (int a = 0; a < 3; a++) {
        box->lo[a] += margin;
        box->hi[a] -= margin;
        inside = inside && at[a] >= box->lo[a] && at[a] <= box->hi[a];
    }
    return inside;
}

/* Size of the invisible block around `at` as a power of two, or VOL_VISIBLE with the brick's number; VOL_WIDE: to be asked
 * for by find_wide. */
static inline unsigned find_level(BrickFinder *f, const int32_t at[3], uint32_t *brick)
{
    int32_t n[3] = {at[0] >> 4, at[1] >> 4, at[2] >> 4};
    if (n[0] != f->node_at[0] || n[1] != f->node_at[1] || n[2] != f->node_at[2]) {
        f->node = vol_grid_node(f->grid, n[0], n[1], n[2]);
        memcpy(f->node_at, n, sizeof n);
    }
    if (!f->node || !f->node->bricks)
        return VOL_WIDE;
    size_t place = (size_t)(((at[0] & 15) * 16 + (at[1] & 15)) * 16 + (at[2] & 15));
    *brick = f->node->bricks[place];
    return f->space->levels[(size_t)f->node->detail * VOL_NODE_ENTRIES + place];
}

/* The brick at a place, and what of the bricks around it is passed together with it. */
typedef struct BrickFound {
    uint32_t brick;
    bool visible, single; /* single: the brick alone, and `box` is not set */
    BrickBox box;
} BrickFound;

/* Where find_level says VOL_WIDE: rarely asked, and not to be in the way of what is asked often. */
static __attribute__((noinline)) void find_wide_box(BrickFinder *f, const int32_t at[3], BrickFound *found)
{
    find_wide(f, at, &found->brick, &found->box);
    found->visible = f->space->brick_visible[found->brick];
    found->single = found->visible && !cut_margin(f, at, found->brick, &found->box);
}

static inline __attribute__((always_inline)) void find_brick(BrickFinder *f, const int32_t at[3], BrickFound *found)
{
    unsigned level = find_level(f, at, &found->brick);
    if (level == VOL_WIDE) {
        find_wide_box(f, at, found);
        return;
    }
    found->visible = level == VOL_VISIBLE;
    found->single = found->visible || level == 0;
    for (int a = 0; a < 3 && !found->single; a++) {
        found->box.lo[a] = at[a] & -(1 << level);
        found->box.hi[a] = found->box.lo[a] + ((1 << level) - 1);
    }
}

#endif
