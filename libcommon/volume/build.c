/* From leaves and tiles to bricks: every leaf becomes a brick that holds its own 8^3 voxels, so that the caller can free
 * each leaf as it goes; layers.c does the rest.  Memory: the bricks and a few bytes per brick. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "volume/grid_internal.h"

enum { INDEX_LIMIT = 1 << 30, NODE_LIMIT = 1 << 24, ROOT_SHIFT = VOL_ROOT_LOG2 - VOL_NODE_LOG2 };

static VolStatus set_domain(VolGrid *grid, const VolGridSource *source, VolError *err)
{
    grid->domain = source->box ? VOL_DOMAIN_BOX : VOL_DOMAIN_SPARSE;
    grid->empty = source->empty;
    for (int a = 0; a < 3; a++) {
        int32_t lo = source->box_min[a], hi = source->box_max[a];
        if (lo < -INDEX_LIMIT || hi > INDEX_LIMIT)
            return vol_fail(err, VOL_BAD_INPUT, "the grid spans %d to %d along axis %d: indices beyond 2^30 are not served",
                            lo, hi, a);
        if (hi < lo)
            return vol_fail(err, VOL_BAD_INPUT, "the grid's box is inverted along axis %d: %d to %d", a, lo, hi);
        grid->voxel_min[a] = lo;
        grid->voxel_max[a] = hi;
        grid->thin[a] = source->box && lo == hi;
        double beyond = source->box ? (grid->thin[a] ? 0.5 : 0) : 1;
        grid->domain_min[a] = lo - beyond;
        grid->domain_max[a] = hi + beyond;
        bool margin = !source->box || grid->thin[a];
        grid->cell_min[a] = lo - (margin ? 1 : 0);
        grid->cell_max[a] = margin ? hi : hi - 1;
    }
    return VOL_OK;
}

/* RGB as a single value: the number of that colour, which is a new one where there is none like it yet. */
static VolStatus number_of_color(VolGrid *grid, const double rgb[3], double *number, VolError *err)
{
    float narrow[3];
    int32_t bits[3];
    void *color;
    for (int c = 0; c < 3; c++)
        narrow[c] = (float)rgb[c] + 0.0f; /* of two zeros the positive one */
    memcpy(bits, narrow, sizeof bits);
    VolStatus status = vol_cubes_add(&grid->colors, bits, &color, err);
    *number = status ? 0 : (double)vol_cubes_number(&grid->colors, color);
    return status;
}

static VolStatus set_values(VolGrid *grid, const VolGridSource *source, VolError *err)
{
    grid->is_rgb = source->is_rgb;
    grid->is_double = source->as_double && !source->is_rgb;
    grid->background = grid->is_double ? source->background : (double)(float)source->background;
    grid->colors.stride = 3 * sizeof(float);
    return grid->is_rgb ? number_of_color(grid, source->background_rgb, &grid->background, err) : VOL_OK;
}

VolStatus vol_grid_begin(const VolGridSource *source, VolGridBuilder **out, VolError *err)
{
    *out = NULL;
    VolGridBuilder *builder = vol_alloc_zero(1, sizeof *builder);
    VolGrid *grid = vol_alloc_zero(1, sizeof *grid);
    if (!builder || !grid) {
        free(builder);
        free(grid);
        return vol_fail_memory(err, sizeof *grid);
    }
    builder->source = *source;
    builder->grid = grid;
    grid->index_to_world = source->index_to_world;
    grid->active_voxels = source->active_voxels;
    VolStatus status = set_domain(grid, source, err);
    if (!status)
        status = set_values(grid, source, err);
    if (!status && !vol_affine_invert(&source->index_to_world, &grid->world_to_index))
        status = vol_fail(err, VOL_BAD_INPUT, "the grid's transform is singular or not finite");
    grid->roots.stride = sizeof(VolRoot);
    grid->occupied.stride = 3 * sizeof(int32_t);
    grid->voxel = vol_affine_voxel(&source->index_to_world);
    if (!status)
        status = vol_grid_rehash(grid, 64, err);
    builder->brick_capacity = 64;
    grid->bricks = vol_alloc(builder->brick_capacity, sizeof *grid->bricks);
    builder->places = vol_alloc(builder->brick_capacity, sizeof *builder->places);
    if (!status && (!grid->bricks || !builder->places))
        status = vol_fail_memory(err, builder->brick_capacity * sizeof *grid->bricks);
    if (status) {
        vol_grid_builder_free(builder);
        return status;
    }
    grid->bricks[0] = (VolBrick){.uniform = grid->background, .storage = VOL_NO_STORAGE, .shared = true};
    builder->places[0] = (BrickPlace){.at = {INT32_MIN, INT32_MIN, INT32_MIN}};
    grid->brick_count = 1;
    *out = builder;
    return VOL_OK;
}

void vol_grid_builder_free(VolGridBuilder *builder)
{
    if (!builder)
        return;
    vol_grid_free(builder->grid);
    vol_cubes_free(&builder->shared_octants);
    free(builder->places);
    free(builder);
}

/* ---- Nodes and bricks ---- */

VolStatus vol_grid_make_node(VolGridBuilder *builder, const int32_t at[3], VolNode **out, VolError *err)
{
    VolGrid *grid = builder->grid;
    VolNode *found = (VolNode *)(size_t)vol_grid_node(grid, at[0], at[1], at[2]);
    if (found) {
        *out = found;
        return VOL_OK;
    }
    const VolRoot *around = vol_grid_root(grid, at[0] >> ROOT_SHIFT, at[1] >> ROOT_SHIFT, at[2] >> ROOT_SHIFT);
    if (grid->node_count >= NODE_LIMIT)
        return vol_fail(err, VOL_BAD_INPUT, "the grid's tiles cover more than %d blocks of 128^3 voxels", NODE_LIMIT);
    if (grid->node_count == builder->node_capacity) {
        size_t grown = builder->node_capacity ? builder->node_capacity * 2 : 64;
        VolNode *nodes = vol_resize(grid->nodes, grown, sizeof *nodes);
        if (!nodes)
            return vol_fail_memory(err, grown * sizeof *nodes);
        grid->nodes = nodes;
        builder->node_capacity = grown;
    }
    VolNode *node = &grid->nodes[grid->node_count++];
    *node = (VolNode){.at = {at[0], at[1], at[2]}};
    for (int k = 0; k < 8; k++)
        node->octants[k] = around ? around->octants[0] : 0;
    *out = node;
    /* Kept at most half full; a new table enters all nodes. */
    size_t size = grid->hash_size;
    while (size < 2 * grid->node_count + 2)
        size *= 2;
    if (size != grid->hash_size)
        return vol_grid_rehash(grid, size, err);
    vol_grid_enter_node(grid, grid->node_count - 1);
    return VOL_OK;
}

VolStatus vol_grid_detail_node(VolNode *node, VolError *err)
{
    if (node->bricks)
        return VOL_OK;
    node->bricks = vol_alloc(VOL_NODE_ENTRIES, sizeof *node->bricks);
    if (!node->bricks)
        return vol_fail_memory(err, VOL_NODE_ENTRIES * sizeof *node->bricks);
    for (size_t n = 0; n < VOL_NODE_ENTRIES; n++)
        node->bricks[n] = node->octants[0];
    return VOL_OK;
}

VolStatus vol_grid_new_brick(VolGridBuilder *builder, const int32_t at[3], double uniform, uint32_t *number, VolError *err)
{
    VolGrid *grid = builder->grid;
    if (grid->brick_count == builder->brick_capacity) {
        size_t grown = builder->brick_capacity * 2;
        VolBrick *bricks = vol_resize(grid->bricks, grown, sizeof *bricks);
        if (bricks)
            grid->bricks = bricks;
        BrickPlace *places = vol_resize(builder->places, grown, sizeof *places);
        if (places)
            builder->places = places;
        if (!bricks || !places || grown >= UINT32_MAX)
            return vol_fail_memory(err, grown * sizeof *bricks);
        builder->brick_capacity = grown;
    }
    *number = (uint32_t)grid->brick_count++;
    grid->bricks[*number] = (VolBrick){.uniform = uniform, .storage = VOL_NO_STORAGE, .shared = at[0] == INT32_MIN};
    builder->places[*number] = (BrickPlace){.at = {at[0], at[1], at[2]}};
    return VOL_OK;
}

VolStatus vol_grid_own_brick(VolGridBuilder *builder, const int32_t at[3], uint32_t *number, VolError *err)
{
    int32_t node_at[3] = {at[0] >> 4, at[1] >> 4, at[2] >> 4};
    VolNode *node;
    VolStatus status = vol_grid_make_node(builder, node_at, &node, err);
    if (!status)
        status = vol_grid_detail_node(node, err);
    if (status)
        return status;
    uint32_t *entry = &node->bricks[((at[0] & 15) * 16 + (at[1] & 15)) * 16 + (at[2] & 15)];
    *number = *entry;
    if (*number && memcmp(builder->places[*number].at, at, sizeof builder->places[*number].at) == 0)
        return VOL_OK;
    status = vol_grid_new_brick(builder, at, builder->grid->bricks[*entry].uniform, number, err);
    if (status)
        return status;
    builder->places[*number].of_tile = *entry != 0;
    *entry = *number;
    return VOL_OK;
}

/* Storage that holds zeros so far. */
static VolStatus reserve_brick(VolGridBuilder *builder, uint32_t number, VolError *err)
{
    VolGrid *grid = builder->grid;
    enum { SLACK = 64 }; /* bytes behind the last brick */
    size_t size = VOL_BRICK_STRIDE * vol_grid_value_size(grid) * (size_t)vol_grid_planes(grid);
    size_t count = grid->stored_bricks + 1;
    if (count * size + SLACK > grid->pool.bytes) {
        size_t grown = count < 64 ? 64 : 2 * count;
        if (grown >= UINT32_MAX || !vol_pages_grow(&grid->pool, grown, size))
            return vol_fail_memory(err, grown * size);
        grid->values = grid->pool.data;
    }
    grid->bricks[number].storage = (uint32_t)grid->stored_bricks++;
    return VOL_OK;
}

VolStatus vol_grid_store_brick(VolGridBuilder *builder, uint32_t number, VolError *err)
{
    VolGrid *grid = builder->grid;
    if (grid->bricks[number].storage != VOL_NO_STORAGE)
        return VOL_OK;
    VolStatus status = reserve_brick(builder, number, err);
    const VolBrick *brick = &grid->bricks[number];
    for (int c = 0; c < vol_grid_planes(grid) && !status; c++)
        vol_grid_fill(grid, vol_grid_voxel_place(grid, brick, c, 0, 0, 0), VOL_BRICK_VALUES,
                      vol_grid_in_plane(grid, brick->uniform, c));
    return status;
}

/* ---- Taking leaves and tiles ---- */

VolStatus vol_grid_place(VolGridBuilder *builder, const int32_t origin[3], VolError *err)
{
    const int32_t at[3] = {origin[0] >> 3, origin[1] >> 3, origin[2] >> 3};
    uint32_t number;
    VolStatus status = vol_grid_own_brick(builder, at, &number, err);
    if (!status && builder->grid->bricks[number].storage == VOL_NO_STORAGE)
        status = reserve_brick(builder, number, err);
    return status;
}

typedef union LeafValues {
    float floats[3 * 512];
    double doubles[512];
} LeafValues;

/* The values as the pool holds them, plane after plane. */
static const void *as_pool(const VolGrid *grid, const float *floats, const double *doubles, LeafValues *converted)
{
    if (grid->is_rgb)
        for (int n = 0; n < 3 * 512; n++)
            converted->floats[n] = floats[n % 512 * 3 + n / 512];
    else if (grid->is_double && floats)
        for (int n = 0; n < 512; n++)
            converted->doubles[n] = (double)floats[n];
    else if (!grid->is_double && doubles)
        for (int n = 0; n < 512; n++)
            converted->floats[n] = (float)doubles[n];
    else
        return floats ? (const void *)floats : (const void *)doubles;
    return converted;
}

/* Copies 8^3 values of `size` bytes row by row; `instead` stands for the inactive ones. */
static inline void copy_rows(unsigned char *to, const unsigned char *from, const uint64_t active[8], size_t size,
                             const void *instead)
{
    for (int x = 0; x < 8; x++)
        for (int y = 0; y < 8; y++) {
            unsigned row = (unsigned)(active[x] >> (8 * y)) & 255u;
            unsigned char *out = to + (size_t)(x * VOL_BRICK_SIDE + y) * VOL_BRICK_SIDE * size;
            memcpy(out, from, 8 * size);
            from += 8 * size;
            for (unsigned off = ~row & 255u; off; off &= off - 1)
                memcpy(out + (unsigned)__builtin_ctz(off) * size, instead, size);
        }
}

VolStatus vol_grid_leaf(VolGridBuilder *builder, const int32_t origin[3], const float *floats, const double *doubles,
                        const uint64_t active[8], VolError *err)
{
    static const uint64_t all[8] = {UINT64_MAX, UINT64_MAX, UINT64_MAX, UINT64_MAX,
                                    UINT64_MAX, UINT64_MAX, UINT64_MAX, UINT64_MAX};
    const VolGrid *grid = builder->grid;
    const int32_t at[3] = {origin[0] >> 3, origin[1] >> 3, origin[2] >> 3};
    uint32_t number;
    VolStatus status = vol_grid_place(builder, origin, err); /* where it has been placed already: changes nothing */
    if (!status)
        status = vol_grid_own_brick(builder, at, &number, err);
    if (status)
        return status;
    LeafValues converted;
    const unsigned char *from = as_pool(grid, floats, doubles, &converted);
    if (builder->source.box || builder->source.level_set)
        active = all;
    for (int c = 0; c < vol_grid_planes(grid); c++) {
        double wide = vol_grid_in_plane(grid, grid->background, c);
        float narrow = (float)wide;
        unsigned char *to = vol_grid_voxel_place(grid, &grid->bricks[number], c, 0, 0, 0);
        if (grid->is_double)
            copy_rows(to, from, active, sizeof wide, &wide);
        else
            copy_rows(to, from + (size_t)c * 512 * sizeof narrow, active, sizeof narrow, &narrow);
    }
    return VOL_OK;
}

/* A brick that many places share: no place owns it. */
static VolStatus new_shared_brick(VolGridBuilder *builder, double value, uint32_t *number, VolError *err)
{
    return vol_grid_new_brick(builder, (const int32_t[3]){INT32_MIN, INT32_MIN, INT32_MIN}, value, number, err);
}

static VolStatus put_uniform_node(VolGridBuilder *builder, const int32_t at[3], uint32_t number, VolError *err)
{
    VolNode *node;
    VolStatus status = vol_grid_make_node(builder, at, &node, err);
    if (status)
        return status;
    free(node->bricks);
    node->bricks = NULL;
    for (int k = 0; k < 8; k++)
        node->octants[k] = number;
    return VOL_OK;
}

/* The nodes from `lo` to `hi`, voxels. */
static VolStatus put_uniform_nodes(VolGridBuilder *builder, const int32_t lo[3], const int32_t hi[3], uint32_t number,
                                   VolError *err)
{
    VolStatus status = VOL_OK;
    for (int32_t x = lo[0] >> 7; x <= hi[0] >> 7 && !status; x++)
        for (int32_t y = lo[1] >> 7; y <= hi[1] >> 7 && !status; y++)
            for (int32_t z = lo[2] >> 7; z <= hi[2] >> 7 && !status; z++)
                status = put_uniform_node(builder, (int32_t[3]){x, y, z}, number, err);
    return status;
}

static VolStatus put_uniform_root(VolGridBuilder *builder, const int32_t origin[3], uint32_t number, VolError *err)
{
    enum { SHIFT = VOL_ROOT_LOG2 + 3 };
    const int32_t at[3] = {origin[0] >> SHIFT, origin[1] >> SHIFT, origin[2] >> SHIFT};
    void *root;
    VolStatus status = vol_cubes_add(&builder->grid->roots, at, &root, err);
    for (int k = 0; k < 8 && !status; k++)
        ((VolRoot *)root)->octants[k] = number;
    return status;
}

/* A value as the pool holds it. */
static double as_stored(const VolGrid *grid, double value) { return grid->is_double ? value : (double)(float)value; }

static VolStatus put_small_tile(VolGridBuilder *builder, const int32_t origin[3], double value, VolError *err)
{
    int32_t at[3] = {origin[0] >> 3, origin[1] >> 3, origin[2] >> 3};
    uint32_t number;
    VolStatus status = vol_grid_own_brick(builder, at, &number, err);
    if (!status)
        builder->grid->bricks[number].uniform = value;
    return status;
}

/* Along an axis of one voxel the layers beside it repeat it: the one below a tile's first is another block's. */
static VolStatus repeat_below_thin(VolGridBuilder *builder, const int32_t origin[3], int32_t size, uint32_t number,
                                   VolError *err)
{
    const VolGrid *grid = builder->grid;
    VolStatus status = VOL_OK;
    for (int n = 1; n < 8 && !status; n++) {
        int32_t at[3];
        int step[3];
        bool wanted = true;
        vol_grid_step(n, step);
        for (int a = 0; a < 3; a++) {
            wanted = wanted && (!step[a] || (grid->thin[a] && origin[a] == grid->voxel_min[a]));
            at[a] = origin[a] - step[a] * size;
        }
        if (!wanted)
            continue;
        status = size == VOL_ROOT_CELLS
                     ? put_uniform_root(builder, at, number, err)
                     : put_uniform_node(builder, (int32_t[3]){at[0] >> 7, at[1] >> 7, at[2] >> 7}, number, err);
    }
    return status;
}

/* A tile of more than one brick. */
static VolStatus put_large_tile(VolGridBuilder *builder, const int32_t origin[3], int32_t size, uint32_t number,
                                VolError *err)
{
    const VolGrid *grid = builder->grid;
    int32_t lo[3], hi[3];
    uint64_t inside = 1;
    bool whole = true; /* or no voxel of the rest is ever looked at */
    for (int a = 0; a < 3; a++) {
        int64_t end = (int64_t)origin[a] + size - 1;
        lo[a] = origin[a] < grid->voxel_min[a] ? grid->voxel_min[a] : origin[a];
        hi[a] = end > grid->voxel_max[a] ? grid->voxel_max[a] : (int32_t)end;
        if (lo[a] > hi[a])
            return VOL_OK;
        inside *= (uint64_t)(hi[a] - lo[a]) + 1;
        whole = whole && (grid->domain == VOL_DOMAIN_BOX || (lo[a] >> 7 == origin[a] >> 7 && hi[a] >> 7 == end >> 7));
    }
    if (!vol_grid_is_finite(grid, grid->bricks[number].uniform))
        builder->bad_in_tiles += inside;
    VolStatus status = size == VOL_ROOT_CELLS && whole ? put_uniform_root(builder, origin, number, err)
                                                       : put_uniform_nodes(builder, lo, hi, number, err);
    return status ? status : repeat_below_thin(builder, origin, size, number, err);
}

static bool tile_counts(const VolGridBuilder *builder, bool active)
{
    return active || builder->source.box || builder->source.level_set;
}

/* Of a single value as it is stored. */
static VolStatus put_tile(VolGridBuilder *builder, const int32_t origin[3], int32_t size, double value, VolError *err)
{
    if (value == builder->grid->background)
        return VOL_OK;
    if (size == VOL_BRICK_CELLS)
        return put_small_tile(builder, origin, value, err);
    uint32_t number;
    VolStatus status = new_shared_brick(builder, value, &number, err);
    return status ? status : put_large_tile(builder, origin, size, number, err);
}

VolStatus vol_grid_tile(VolGridBuilder *builder, const int32_t origin[3], int32_t size, double value, bool active,
                        VolError *err)
{
    return tile_counts(builder, active) ? put_tile(builder, origin, size, as_stored(builder->grid, value), err) : VOL_OK;
}

VolStatus vol_grid_tile_rgb(VolGridBuilder *builder, const int32_t origin[3], int32_t size, const double rgb[3],
                            bool active, VolError *err)
{
    double value;
    if (!tile_counts(builder, active))
        return VOL_OK;
    VolStatus status = number_of_color(builder->grid, rgb, &value, err);
    return status ? status : put_tile(builder, origin, size, value, err);
}
