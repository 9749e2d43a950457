/* Each cube of 8^3 voxels that holds anything but background has a hash of its own, of its place and its values, or of its
 * one value if all are equal; their sums stand for all of them, in any order and by any number of threads. */
#include "volume/content_hash.h"

#include <stdlib.h>

#include "base/hash.h"
#include "base/pool.h"

enum { SIDE = VOL_BRICK_CELLS, VOXELS = SIDE * SIDE * SIDE };

typedef struct Sum {
    uint64_t of[2];
} Sum;

typedef struct Hashing {
    const VolGrid *grid;
    double unit;
    Sum *sums; /* one per thread */
} Hashing;

/* As the user has it, 0 and NaN of one kind. */
static double plain(double value, double unit) { return isnan(value) ? (double)NAN : value * unit + 0.0; }

static double stored(const VolGrid *grid, const VolBrick *brick, int x, int y, int z)
{
    if (brick->storage == VOL_NO_STORAGE)
        return brick->uniform;
    size_t at = (size_t)brick->storage * VOL_BRICK_STRIDE + (size_t)((x * VOL_BRICK_SIDE + y) * VOL_BRICK_SIDE + z);
    return grid->is_double ? ((const double *)grid->values)[at] : (double)((const float *)grid->values)[at];
}

static bool is_same(double a, double b) { return a == b || (isnan(a) && isnan(b)); }

/* What lies beyond the voxels' box is background.  The number of values that tell all: 1 or VOXELS. */
static size_t values_of(const Hashing *h, const VolBrick *brick, const int32_t first[3], double *values)
{
    const VolGrid *grid = h->grid;
    double background = plain(grid->background, h->unit);
    bool same = true, inside = true;
    for (int a = 0; a < 3; a++)
        inside = inside && first[a] >= grid->voxel_min[a] && (int64_t)first[a] + SIDE - 1 <= grid->voxel_max[a];
    values[0] = plain(brick->uniform, h->unit);
    if (inside && brick->storage == VOL_NO_STORAGE)
        return 1;
    for (int n = 0; n < VOXELS; n++) {
        const int at[3] = {n >> 6, n >> 3 & 7, n & 7};
        bool holds = true;
        for (int a = 0; a < 3 && !inside; a++) {
            int64_t voxel = (int64_t)first[a] + at[a];
            holds = holds && voxel >= grid->voxel_min[a] && voxel <= grid->voxel_max[a];
        }
        values[n] = holds ? plain(stored(grid, brick, at[0], at[1], at[2]), h->unit) : background;
        same = same && is_same(values[n], values[0]);
    }
    return same ? 1 : VOXELS;
}

static void add_brick(const Hashing *h, const int32_t at[3], Sum *sum)
{
    const VolGrid *grid = h->grid;
    struct {
        int64_t first[3];
        double values[VOXELS];
    } content;
    int32_t first[3];
    for (int a = 0; a < 3; a++) {
        first[a] = at[a] * SIDE;
        content.first[a] = first[a];
        if (first[a] > grid->voxel_max[a] || (int64_t)first[a] + SIDE - 1 < grid->voxel_min[a])
            return;
    }
    const VolBrick *brick = &grid->bricks[vol_grid_brick_number(grid, at[0], at[1], at[2])];
    size_t count = values_of(h, brick, first, content.values);
    if (count == 1 && is_same(content.values[0], plain(grid->background, h->unit)))
        return;
    uint64_t hash[2];
    vol_hash_bytes(&content, sizeof content.first + count * sizeof *content.values, hash);
    sum->of[0] += hash[0];
    sum->of[1] += hash[1];
}

static void add_node(const Hashing *h, const int32_t at[3], Sum *sum)
{
    for (int n = 0; n < VOL_NODE_ENTRIES; n++) {
        const int32_t brick[3] = {at[0] * VOL_NODE_BRICKS + (n >> 8), at[1] * VOL_NODE_BRICKS + (n >> 4 & 15),
                                  at[2] * VOL_NODE_BRICKS + (n & 15)};
        add_brick(h, brick, sum);
    }
}

static VolStatus add_node_number(void *user, size_t index, int thread, VolError *err)
{
    (void)err;
    const Hashing *h = user;
    add_node(h, h->grid->nodes[index].at, &h->sums[thread]);
    return VOL_OK;
}

/* One of the places for nodes in a root, unless a node stands there. */
static VolStatus add_place_in_root(void *user, size_t index, int thread, VolError *err)
{
    enum { PLACES = VOL_ROOT_NODES * VOL_ROOT_NODES };
    (void)err;
    const Hashing *h = user;
    const VolRoot *root = vol_cubes_item(&h->grid->roots, index / (PLACES * VOL_ROOT_NODES));
    const int n = (int)(index % (PLACES * VOL_ROOT_NODES));
    const int32_t at[3] = {root->at[0] * VOL_ROOT_NODES + n / PLACES,
                           root->at[1] * VOL_ROOT_NODES + n / VOL_ROOT_NODES % VOL_ROOT_NODES,
                           root->at[2] * VOL_ROOT_NODES + n % VOL_ROOT_NODES};
    for (int a = 0; a < 3; a++)
        if ((int64_t)at[a] * VOL_NODE_CELLS > h->grid->voxel_max[a] ||
            ((int64_t)at[a] + 1) * VOL_NODE_CELLS <= h->grid->voxel_min[a])
            return VOL_OK;
    if (!vol_grid_node(h->grid, at[0], at[1], at[2]))
        add_node(h, at, &h->sums[thread]);
    return VOL_OK;
}

/* Where it lies, and what is around its values. */
static void add_frame(const Hashing *h, VolHash *hash)
{
    const VolGrid *grid = h->grid;
    double background = plain(grid->background, h->unit);
    for (int r = 0; r < 4; r++)
        for (int c = 0; c < 3; c++) {
            double number = grid->index_to_world.m[r][c] + 0.0;
            vol_hash_add(hash, &number, sizeof number);
        }
    const int32_t domain = grid->empty ? -1 : (int32_t)grid->domain;
    vol_hash_add(hash, &domain, sizeof domain);
    vol_hash_add(hash, grid->voxel_min, sizeof grid->voxel_min);
    vol_hash_add(hash, grid->voxel_max, sizeof grid->voxel_max);
    vol_hash_add(hash, &background, sizeof background);
}

VolStatus vol_volume_hash(const VolVolume *volume, double unit, int threads, uint64_t out[2], VolError *err)
{
    enum { PLACES = VOL_ROOT_NODES * VOL_ROOT_NODES * VOL_ROOT_NODES };
    const VolGrid *grid = volume->grid;
    size_t most = threads < 1 ? 1 : (size_t)threads;
    Hashing h = {grid, unit, vol_alloc_zero(most, sizeof *h.sums)};
    if (!h.sums)
        return vol_fail_memory(err, most * sizeof *h.sums);
    VolStatus status = vol_parallel((int)most, grid->node_count, add_node_number, &h, err);
    if (!status)
        status = vol_parallel((int)most, grid->roots.count * PLACES, add_place_in_root, &h, err);
    VolHash hash;
    vol_hash_begin(&hash);
    add_frame(&h, &hash);
    for (size_t t = 1; t < most; t++)
        for (int n = 0; n < 2; n++)
            h.sums[0].of[n] += h.sums[t].of[n];
    vol_hash_add(&hash, &h.sums[0], sizeof h.sums[0]);
    vol_hash_end(&hash, out);
    free(h.sums);
    return status;
}
