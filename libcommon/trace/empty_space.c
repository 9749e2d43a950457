/* A brick is invisible where the transfer function is nothing over the whole range of its 9^3 voxels: the trilinear field
 * stays within that range, so that leaving the brick out changes no bit of any picture.  Blocks of 2^3, 4^3, 8^3 bricks and
 * whole nodes that are invisible throughout are marked as such in each of their places, for rays to pass in one step.
 * (Blocks of one value need no marks: walk.h.)
 *
 * Estimators that march also show what changes from one sample to the next.  Between samples in invisible bricks that is
 * nothing as long as a ray's bricks share a finite voxel each with the next: then their ranges are one connected range.
 * Where two share none, the ray passes from one to the other through cells that are holes, for a voxel's width before and
 * behind the plane between them, whatever its direction; both samples are finite only if the step is two voxels or more
 * along some axis.  With such steps bricks that have holes are entered even if they are invisible.  (Bricks without any
 * finite voxel need not be: whatever has values beside them has holes.) */
#include "trace/empty_space.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/mem.h"

enum { SIDE = VOL_NODE_BRICKS };

/* Whether two neighbouring samples may have a hole between them; a little below two voxels, for rounding. */
static bool steps_over_holes(const VolScene *scene)
{
    const double(*m)[3] = scene->grid->world_to_index.m;
    double most = 0;
    for (int a = 0; a < 3; a++)
        most = fmax(most, vol_length(vol_vec3(m[0][a], m[1][a], m[2][a])));
    return scene->estimator != VOL_ESTIMATE_EXACT && scene->step * most > 1.9;
}

static void mark_bricks(VolScene *scene)
{
    const VolGrid *grid = scene->grid;
    bool over_holes = steps_over_holes(scene);
    for (size_t b = 0; b < grid->brick_count; b++) {
        const VolBrick *brick = &grid->bricks[b];
        bool seen = vol_tf_range_visible(scene->tf, brick->lo, brick->hi);
        bool entered = brick->lo <= brick->hi && (seen || !scene->skip || (brick->invalid && over_holes));
        scene->brick_visible[b] = seen ? VOL_BRICK_SEEN : entered ? VOL_BRICK_ENTERED : VOL_BRICK_LEFT_OUT;
        scene->bricks_visible += entered;
    }
    scene->bricks_skipped = grid->brick_count - scene->bricks_visible;
    scene->background_visible = scene->brick_visible[0];
}

static size_t place_of(int x, int y, int z) { return (size_t)((x * SIDE + y) * SIDE + z); }

/* Whether the block of `size` bricks at (x, y, z) is invisible, its halves being marked `level` - 1 already. */
static bool block_is_invisible(const uint8_t *empty_levels, int x, int y, int z, int size, unsigned level)
{
    for (int n = 0; n < 8; n++) {
        int half = size / 2;
        uint8_t at = empty_levels[place_of(x + (n >> 2) * half, y + (n >> 1 & 1) * half, z + (n & 1) * half)];
        if (at == VOL_VISIBLE || at < level - 1)
            return false;
    }
    return true;
}

static void mark_block(uint8_t *empty_levels, int x, int y, int z, int size, unsigned level)
{
    for (int i = 0; i < size; i++)
        for (int j = 0; j < size; j++)
            memset(&empty_levels[place_of(x + i, y + j, z)], (int)level, (size_t)size);
}

static void mark_blocks(uint8_t *empty_levels)
{
    for (unsigned level = 1; level <= VOL_NODE_LEVEL; level++) {
        int size = 1 << level;
        for (int x = 0; x < SIDE; x += size)
            for (int y = 0; y < SIDE; y += size)
                for (int z = 0; z < SIDE; z += size)
                    if (block_is_invisible(empty_levels, x, y, z, size, level))
                        mark_block(empty_levels, x, y, z, size, level);
    }
}

/* Widens the box by the bricks from `lo` to `hi`. */
static void widen(VolScene *scene, const int32_t lo[3], const int32_t hi[3])
{
    for (int a = 0; a < 3; a++) {
        if (lo[a] < scene->visible_min[a])
            scene->visible_min[a] = lo[a];
        if (hi[a] > scene->visible_max[a])
            scene->visible_max[a] = hi[a];
    }
}

/* A block of 2^log2 bricks a side that is no more than its octants. */
static void mark_octants(VolScene *scene, const int32_t block_at[3], int log2, const uint32_t octants[8])
{
    for (int k = 0; k < 8; k++) {
        if (!scene->brick_visible[octants[k]])
            continue;
        int32_t lo[3], hi[3];
        for (int a = 0; a < 3; a++) {
            int32_t first = block_at[a] * (1 << log2), last = first + (1 << log2) - 1;
            lo[a] = k >> (2 - a) & 1 ? last : first;
            hi[a] = k >> (2 - a) & 1 ? last : last - 1;
        }
        widen(scene, lo, hi);
    }
}

static void mark_node(VolScene *scene, const VolNode *node)
{
    const int32_t *first = node->at;
    if (!node->bricks) {
        mark_octants(scene, node->at, VOL_NODE_LOG2, node->octants);
        return;
    }
    uint8_t *empty_levels = &scene->empty_levels[node->detail * VOL_NODE_ENTRIES];
    for (int p = 0; p < VOL_NODE_ENTRIES; p++) {
        bool visible = scene->brick_visible[node->bricks[p]];
        empty_levels[p] = visible ? VOL_VISIBLE : 0;
        if (!visible)
            continue;
        const int32_t at[3] = {first[0] * SIDE + (p >> 8), first[1] * SIDE + (p >> 4 & 15), first[2] * SIDE + (p & 15)};
        widen(scene, at, at);
    }
    mark_blocks(empty_levels);
}

/* Rays look at nothing outside the domain, nor outside the box around what is visible. */
static void settle_box(VolScene *scene)
{
    const VolGrid *grid = scene->grid;
    for (int a = 0; a < 3; a++) {
        int32_t lo = grid->cell_min[a] >> 3, hi = grid->cell_max[a] >> 3;
        bool all = scene->background_visible;
        scene->visible_min[a] = all || scene->visible_min[a] < lo ? lo : scene->visible_min[a];
        scene->visible_max[a] = all || scene->visible_max[a] > hi ? hi : scene->visible_max[a];
        if (scene->visible_max[a] < scene->visible_min[a]) { /* nothing: a box of no width */
            scene->visible_min[a] = lo;
            scene->visible_max[a] = lo - 1;
        }
    }
}

VolStatus vol_empty_space_prepare(VolScene *scene, VolError *err)
{
    const VolGrid *grid = scene->grid;
    scene->brick_visible = vol_alloc(grid->brick_count, 1);
    scene->empty_levels = vol_alloc(grid->detail_count, VOL_NODE_ENTRIES);
    if (!scene->brick_visible || !scene->empty_levels)
        return vol_fail_memory(err, grid->brick_count + grid->detail_count * VOL_NODE_ENTRIES);
    scene->bricks_visible = 0;
    for (int a = 0; a < 3; a++) {
        scene->visible_min[a] = INT32_MAX;
        scene->visible_max[a] = INT32_MIN;
    }
    mark_bricks(scene);
    for (size_t n = 0; n < grid->node_count; n++)
        mark_node(scene, &grid->nodes[n]);
    for (size_t n = 0; n < grid->roots.count; n++) {
        const VolRoot *root = vol_cubes_item(&grid->roots, n);
        mark_octants(scene, root->at, VOL_ROOT_LOG2, root->octants);
    }
    settle_box(scene);
    return VOL_OK;
}

void vol_empty_space_release(VolScene *scene)
{
    free(scene->brick_visible);
    free(scene->empty_levels);
    scene->brick_visible = scene->empty_levels = NULL;
}
