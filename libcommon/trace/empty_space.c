/* A brick is invisible where the transfer function is nothing over the whole range of its 9^3 voxels: the trilinear field
 * stays within that range, so that leaving the brick out changes no bit of any picture.  Blocks of 2^3, 4^3, 8^3 bricks and
 * whole nodes that are invisible throughout are marked as such in each of their places, for rays to pass in one step.
 * (Blocks of one value need no marks: walk.h.)
 *
 * Estimators that march also show what changes from one sample to the next.  Between samples in invisible bricks that is
 * nothing as long as a ray's bricks share a finite voxel each with the next: then their ranges are one connected range.
 * Where two share none, the ray passes from one to the other through cells that are invalid, for a voxel's width before and
 * behind the plane between them, whatever its direction; both samples are finite only if the step is two voxels or more
 * along some axis.  With such steps bricks that have invalid voxels are entered even if they are invisible.  (Bricks
 * without any finite voxel need not be: whatever has values beside them has invalid voxels.) */
#include "trace/empty_space.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/mem.h"
#include "trace/index_ray.h"
#include "trace/scene.h"

enum { SIDE = VOL_NODE_BRICKS };

/* Whether two neighbouring samples may have invalid voxels between them; a little below two voxels, for rounding. */
static bool steps_over_invalid(const VolScene *scene)
{
    const double(*m)[3] = scene->volume.grid->world_to_index.m;
    double most = 0;
    for (int a = 0; a < 3; a++)
        most = fmax(most, vol_length(vol_vec3(m[0][a], m[1][a], m[2][a])));
    return scene->estimator != VOL_ESTIMATE_EXACT && scene->step * most > 1.9;
}

static void mark_bricks(const VolScene *scene, VolEmptySpace *space)
{
    const VolGrid *grid = scene->volume.grid;
    bool over_invalid = steps_over_invalid(scene);
    for (size_t b = 0; b < grid->brick_count; b++) {
        const VolBrick *brick = &grid->bricks[b];
        bool seen = vol_tf_range_visible(scene->tf, brick->lo, brick->hi);
        bool entered = brick->lo <= brick->hi && (seen || !scene->skip || (brick->invalid && over_invalid));
        space->brick_visible[b] = seen ? VOL_BRICK_SEEN : entered ? VOL_BRICK_ENTERED : VOL_BRICK_LEFT_OUT;
        space->bricks_visible += entered;
    }
    space->bricks_skipped = grid->brick_count - space->bricks_visible;
    space->background_visible = space->brick_visible[0];
}

static size_t place_of(int x, int y, int z) { return (size_t)((x * SIDE + y) * SIDE + z); }

/* Whether the block of `size` bricks at (x, y, z) is invisible, its halves being marked `level` - 1 already. */
static bool block_is_invisible(const uint8_t *levels, int x, int y, int z, int size, unsigned level)
{
    for (int n = 0; n < 8; n++) {
        int half = size / 2;
        uint8_t at = levels[place_of(x + (n >> 2) * half, y + (n >> 1 & 1) * half, z + (n & 1) * half)];
        if (at == VOL_VISIBLE || at < level - 1)
            return false;
    }
    return true;
}

static void mark_block(uint8_t *levels, int x, int y, int z, int size, unsigned level)
{
    for (int i = 0; i < size; i++)
        for (int j = 0; j < size; j++)
            memset(&levels[place_of(x + i, y + j, z)], (int)level, (size_t)size);
}

static void mark_blocks(uint8_t *levels)
{
    for (unsigned level = 1; level <= VOL_NODE_LEVEL; level++) {
        int size = 1 << level;
        for (int x = 0; x < SIDE; x += size)
            for (int y = 0; y < SIDE; y += size)
                for (int z = 0; z < SIDE; z += size)
                    if (block_is_invisible(levels, x, y, z, size, level))
                        mark_block(levels, x, y, z, size, level);
    }
}

/* Widens the box by the bricks from `lo` to `hi`. */
static void widen(VolEmptySpace *space, const int32_t lo[3], const int32_t hi[3])
{
    for (int a = 0; a < 3; a++) {
        if (lo[a] < space->visible_min[a])
            space->visible_min[a] = lo[a];
        if (hi[a] > space->visible_max[a])
            space->visible_max[a] = hi[a];
    }
}

/* A block of 2^log2 bricks a side that is no more than its octants. */
static void mark_octants(VolEmptySpace *space, const int32_t block_at[3], int log2, const uint32_t octants[8])
{
    for (int k = 0; k < 8; k++) {
        if (!space->brick_visible[octants[k]])
            continue;
        int32_t lo[3], hi[3];
        for (int a = 0; a < 3; a++) {
            int32_t first = block_at[a] * (1 << log2), last = first + (1 << log2) - 1;
            lo[a] = k >> (2 - a) & 1 ? last : first;
            hi[a] = k >> (2 - a) & 1 ? last : last - 1;
        }
        widen(space, lo, hi);
    }
}

static void mark_node(VolEmptySpace *space, const VolNode *node)
{
    const int32_t *first = node->at;
    if (!node->bricks) {
        mark_octants(space, node->at, VOL_NODE_LOG2, node->octants);
        return;
    }
    uint8_t *levels = &space->levels[node->detail * VOL_NODE_ENTRIES];
    for (int p = 0; p < VOL_NODE_ENTRIES; p++) {
        bool visible = space->brick_visible[node->bricks[p]];
        levels[p] = visible ? VOL_VISIBLE : 0;
        if (!visible)
            continue;
        const int32_t at[3] = {first[0] * SIDE + (p >> 8), first[1] * SIDE + (p >> 4 & 15), first[2] * SIDE + (p & 15)};
        widen(space, at, at);
    }
    mark_blocks(levels);
}

/* Rays look at nothing outside the domain, nor outside the box around what is visible. */
static void settle_box(const VolGrid *grid, VolEmptySpace *space)
{
    for (int a = 0; a < 3; a++) {
        int32_t lo = grid->cell_min[a] >> 3, hi = grid->cell_max[a] >> 3;
        bool all = space->background_visible;
        space->visible_min[a] = all || space->visible_min[a] < lo ? lo : space->visible_min[a];
        space->visible_max[a] = all || space->visible_max[a] > hi ? hi : space->visible_max[a];
        if (space->visible_max[a] < space->visible_min[a]) { /* nothing: a box of no width */
            space->visible_min[a] = lo;
            space->visible_max[a] = lo - 1;
        }
    }
}

VolStatus vol_empty_space_find(const VolScene *scene, VolEmptySpace *space, VolError *err)
{
    const VolGrid *grid = scene->volume.grid;
    space->brick_visible = vol_alloc(grid->brick_count, 1);
    space->levels = vol_alloc(grid->detail_count, VOL_NODE_ENTRIES);
    if (!space->brick_visible || !space->levels)
        return vol_fail_memory(err, grid->brick_count + grid->detail_count * VOL_NODE_ENTRIES);
    space->bricks_visible = 0;
    for (int a = 0; a < 3; a++) {
        space->visible_min[a] = INT32_MAX;
        space->visible_max[a] = INT32_MIN;
    }
    mark_bricks(scene, space);
    for (size_t n = 0; n < grid->node_count; n++)
        mark_node(space, &grid->nodes[n]);
    for (size_t n = 0; n < grid->roots.count; n++) {
        const VolRoot *root = vol_cubes_item(&grid->roots, n);
        mark_octants(space, root->at, VOL_ROOT_LOG2, root->octants);
    }
    settle_box(grid, space);
    return VOL_OK;
}

bool vol_empty_space_is_left(const VolScene *scene, const VolEmptySpace *space, const VolRay *ray)
{
    IndexRay in_index = index_ray(vol_volume_to_index(&scene->volume), ray);
    double t = ray->t0, end = ray->t1;
    cut_to_visible(&in_index, space, &t, &end);
    return t < end;
}

void vol_empty_space_free(VolEmptySpace *space)
{
    free(space->brick_visible);
    free(space->levels);
    space->brick_visible = space->levels = NULL;
}
