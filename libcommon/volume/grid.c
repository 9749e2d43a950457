#include "volume/grid.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "volume/grid_internal.h"

const VolNode *vol_grid_hashed_node(const VolGrid *grid, int32_t x, int32_t y, int32_t z)
{
    size_t mask = grid->hash_size - 1;
    for (size_t slot = vol_cubes_hash(x, y, z) & mask; grid->hash[slot]; slot = (slot + 1) & mask) {
        const VolNode *node = &grid->nodes[grid->hash[slot] - 1];
        if (node->at[0] == x && node->at[1] == y && node->at[2] == z)
            return node;
    }
    return NULL;
}

void vol_grid_enter_node(VolGrid *grid, size_t number)
{
    const int32_t *at = grid->nodes[number].at;
    size_t slot = vol_cubes_hash(at[0], at[1], at[2]) & (grid->hash_size - 1);
    while (grid->hash[slot])
        slot = (slot + 1) & (grid->hash_size - 1);
    grid->hash[slot] = (uint32_t)number + 1;
}

VolStatus vol_grid_rehash(VolGrid *grid, size_t size, VolError *err)
{
    uint32_t *hash = vol_alloc_zero(size, sizeof *hash);
    if (!hash)
        return vol_fail_memory(err, size * sizeof *hash);
    free(grid->hash);
    grid->hash = hash;
    grid->hash_size = size;
    for (size_t n = 0; n < grid->node_count; n++)
        vol_grid_enter_node(grid, n);
    return VOL_OK;
}

/* A larger table would cost more than it saves. */
enum { TABLE_LIMIT = 1 << 22 };

VolStatus vol_grid_make_table(VolGrid *grid, VolError *err)
{
    int32_t lo[3] = {INT32_MAX, INT32_MAX, INT32_MAX}, hi[3] = {INT32_MIN, INT32_MIN, INT32_MIN};
    uint64_t entries = 1;
    for (size_t n = 0; n < grid->node_count; n++)
        for (int a = 0; a < 3; a++) {
            int32_t at = grid->nodes[n].at[a];
            lo[a] = at < lo[a] ? at : lo[a];
            hi[a] = at > hi[a] ? at : hi[a];
        }
    for (int a = 0; a < 3; a++) {
        uint64_t size = grid->node_count ? (uint64_t)((int64_t)hi[a] - lo[a] + 1) : 0;
        if (size > TABLE_LIMIT || (entries *= size) > TABLE_LIMIT)
            return VOL_OK;
        grid->table_min[a] = lo[a];
        grid->table_size[a] = (uint32_t)size;
    }
    grid->table = vol_alloc_zero((size_t)entries, sizeof *grid->table);
    if (!grid->table)
        return vol_fail_memory(err, (size_t)entries * sizeof *grid->table);
    for (size_t n = 0; n < grid->node_count; n++) {
        const int32_t *at = grid->nodes[n].at;
        size_t i = (size_t)(at[0] - lo[0]), j = (size_t)(at[1] - lo[1]), k = (size_t)(at[2] - lo[2]);
        grid->table[(i * grid->table_size[1] + j) * grid->table_size[2] + k] = (uint32_t)n + 1;
    }
    free(grid->hash);
    grid->hash = NULL;
    grid->hash_size = 0;
    return VOL_OK;
}

/* ---- What is empty ---- */

/* Blocks of 2^n nodes a side, as cubes: their size, too, tells them apart.  Node coordinates are below 2^23. */
enum { BLOCK_SIZES = 24, SIZE_SHIFT = 25 };

static void block_around(const int32_t node_at[3], int n, int32_t at[3])
{
    for (int a = 0; a < 3; a++)
        at[a] = node_at[a] >> n;
    at[0] += n << SIZE_SHIFT;
}

VolStatus vol_grid_occupy(VolGrid *grid, const int32_t node_at[3], int smallest, VolError *err)
{
    VolStatus status = VOL_OK;
    for (int n = smallest; n < BLOCK_SIZES && !status; n++) {
        int32_t at[3];
        void *block;
        size_t known = grid->occupied.count;
        block_around(node_at, n, at);
        status = vol_cubes_add(&grid->occupied, at, &block, err);
        if (grid->occupied.count == known)
            break; /* and so are all around it */
    }
    return status;
}

int vol_grid_empty_around(const VolGrid *grid, const int32_t node_at[3])
{
    int n = 1;
    for (; n < BLOCK_SIZES; n++) {
        int32_t at[3];
        block_around(node_at, n, at);
        if (vol_cubes_find(&grid->occupied, at))
            break;
    }
    return VOL_NODE_LOG2 + n - 1;
}

static int32_t clamp(int32_t v, int32_t lo, int32_t hi) { return v < lo ? lo : v > hi ? hi : v; }

/* Of one plane. */
static double voxel(const VolGrid *grid, int plane, int32_t i, int32_t j, int32_t k)
{
    int32_t at[3] = {i, j, k};
    for (int a = 0; a < 3; a++) {
        int32_t inside = clamp(at[a], grid->voxel_min[a], grid->voxel_max[a]);
        if (inside != at[a] && grid->domain == VOL_DOMAIN_SPARSE)
            return vol_grid_in_plane(grid, grid->background, plane);
        at[a] = inside;
    }
    const VolBrick *brick = &grid->bricks[vol_grid_brick_at(grid, at[0], at[1], at[2])];
    return vol_grid_held(grid, brick, plane, at[0] & 7, at[1] & 7, at[2] & 7);
}

double vol_grid_voxel(const VolGrid *grid, int32_t i, int32_t j, int32_t k) { return voxel(grid, 0, i, j, k); }

void vol_grid_voxel_rgb(const VolGrid *grid, int32_t i, int32_t j, int32_t k, double rgb[3])
{
    for (int c = 0; c < 3; c++)
        rgb[c] = voxel(grid, c, i, j, k);
}

void vol_grid_voxel_gradient(const VolGrid *grid, int32_t i, int32_t j, int32_t k, double gradient[3])
{
    double here = vol_grid_voxel(grid, i, j, k);
    for (int a = 0; a < 3; a++) {
        int32_t before[3] = {i, j, k}, after[3] = {i, j, k};
        before[a]--;
        after[a]++;
        int span = 2;
        double lo = vol_grid_voxel(grid, before[0], before[1], before[2]);
        double hi = vol_grid_voxel(grid, after[0], after[1], after[2]);
        bool box = grid->domain == VOL_DOMAIN_BOX;
        if ((box && before[a] < grid->voxel_min[a]) || !isfinite(lo)) {
            lo = here;
            span--;
        }
        if ((box && after[a] > grid->voxel_max[a]) || !isfinite(hi)) {
            hi = here;
            span--;
        }
        gradient[a] = span > 0 ? (hi - lo) / span : 0;
    }
}

bool vol_grid_range(const VolGrid *grid, double *lo, double *hi)
{
    *lo = INFINITY;
    *hi = -INFINITY;
    if (grid->empty)
        return false;
    for (size_t b = grid->domain == VOL_DOMAIN_SPARSE ? 0 : 1; b < grid->brick_count; b++) {
        *lo = fmin(*lo, grid->bricks[b].lo);
        *hi = fmax(*hi, grid->bricks[b].hi);
    }
    return *lo <= *hi;
}

/* Holes stay holes. */
static double rescaled(double v, int exponent, double most)
{
    return isfinite(v) ? fmax(fmin(ldexp(v, exponent), most), -most) : v;
}

void vol_grid_rescale(VolGrid *grid, int exponent)
{
    /* A little below the largest numbers, so that differences are finite. */
    const double most = grid->is_double ? 0x1p500 : 0x1p125;
    size_t count = grid->stored_bricks * VOL_BRICK_STRIDE;
    for (size_t n = 0; n < count; n++) {
        if (grid->is_double)
            ((double *)grid->values)[n] = rescaled(((double *)grid->values)[n], exponent, most);
        else
            ((float *)grid->values)[n] = (float)rescaled((double)((float *)grid->values)[n], exponent, most);
    }
    for (size_t b = 0; b < grid->brick_count; b++) {
        VolBrick *brick = &grid->bricks[b];
        brick->lo = rescaled(brick->lo, exponent, most);
        brick->hi = rescaled(brick->hi, exponent, most);
        brick->uniform = rescaled(brick->uniform, exponent, most);
    }
    for (size_t n = 0; n < grid->octant_count; n++)
        for (int k = 0; k < 8; k++)
            grid->octants[n].value[k] = rescaled(grid->octants[n].value[k], exponent, most);
    grid->background = rescaled(grid->background, exponent, most);
}

void vol_grid_free(VolGrid *grid)
{
    if (!grid)
        return;
    for (size_t n = 0; n < grid->node_count; n++)
        free(grid->nodes[n].bricks);
    free(grid->nodes);
    free(grid->table);
    free(grid->hash);
    free(grid->bricks);
    free(grid->octants);
    vol_cubes_free(&grid->colors);
    vol_cubes_free(&grid->roots);
    vol_cubes_free(&grid->occupied);
    vol_pages_free(&grid->pool);
    free(grid);
}
