/* From leaves and tiles to bricks.
 *
 * First every leaf becomes a brick that holds its own 8^3 voxels, so that the caller can free each leaf as it goes.
 * Then the bricks one step below a brick along any axis, which share a layer of voxels with it, get storage if that layer
 * differs from what they are; last the shared layers are copied and the ranges taken.  Memory: the bricks and a few
 * bytes per brick. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "grid/grid_internal.h"

typedef struct BrickPlace {
    int32_t at[3]; /* brick coordinates */
} BrickPlace;

struct VolGridBuilder {
    VolGridSource source;
    VolGrid *grid;
    BrickPlace *places; /* beside grid->bricks */
    size_t brick_capacity, stored_capacity, node_capacity;
};

enum { INDEX_LIMIT = 1 << 30, NODE_LIMIT = 1 << 24 };

static VolStatus set_domain(VolGrid *grid, const VolGridSource *source, VolError *err)
{
    grid->domain = source->box ? VOL_DOMAIN_BOX : VOL_DOMAIN_SPARSE;
    grid->empty = source->empty;
    for (int a = 0; a < 3; a++) {
        int32_t lo = source->empty ? 0 : source->box_min[a], hi = source->empty ? -1 : source->box_max[a];
        if (lo < -INDEX_LIMIT || hi > INDEX_LIMIT)
            return vol_fail(err, VOL_BAD_INPUT, "the grid spans %d to %d along axis %d: indices beyond 2^30 are not served",
                            lo, hi, a);
        if (!source->empty && hi < lo)
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
    grid->is_double = source->as_double;
    grid->background = source->as_double ? source->background : (double)(float)source->background;
    grid->index_to_world = source->index_to_world;
    grid->active_voxels = source->active_voxels;
    VolStatus status = set_domain(grid, source, err);
    if (!status && !vol_affine_invert(&source->index_to_world, &grid->world_to_index))
        status = vol_fail(err, VOL_BAD_INPUT, "the grid's transform is singular or not finite");
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
    grid->bricks[0] = (VolBrick){.uniform = grid->background, .storage = VOL_NO_STORAGE};
    builder->places[0] = (BrickPlace){{0, 0, 0}};
    grid->brick_count = 1;
    *out = builder;
    return VOL_OK;
}

void vol_grid_builder_free(VolGridBuilder *builder)
{
    if (!builder)
        return;
    vol_grid_free(builder->grid);
    free(builder->places);
    free(builder);
}

/* ---- Nodes and bricks ---- */

static VolStatus make_node(VolGridBuilder *builder, const int32_t at[3], VolNode **out, VolError *err)
{
    VolGrid *grid = builder->grid;
    VolNode *found = (VolNode *)(size_t)vol_grid_node(grid, at[0], at[1], at[2]);
    if (found) {
        *out = found;
        return VOL_OK;
    }
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
    *node = (VolNode){{at[0], at[1], at[2]}, 0, NULL};
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

static VolStatus make_table(VolNode *node, VolError *err)
{
    if (node->bricks)
        return VOL_OK;
    node->bricks = vol_alloc(VOL_NODE_ENTRIES, sizeof *node->bricks);
    if (!node->bricks)
        return vol_fail_memory(err, VOL_NODE_ENTRIES * sizeof *node->bricks);
    for (size_t n = 0; n < VOL_NODE_ENTRIES; n++)
        node->bricks[n] = node->uniform;
    return VOL_OK;
}

static VolStatus new_brick(VolGridBuilder *builder, const int32_t at[3], double uniform, uint32_t *number, VolError *err)
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
    grid->bricks[*number] = (VolBrick){.uniform = uniform, .storage = VOL_NO_STORAGE};
    memcpy(builder->places[*number].at, at, sizeof builder->places[*number].at);
    return VOL_OK;
}

/* A brick of its own at `at` (a copy of what is there if that is shared by others). */
static VolStatus own_brick(VolGridBuilder *builder, const int32_t at[3], uint32_t *number, VolError *err)
{
    int32_t node_at[3] = {at[0] >> 4, at[1] >> 4, at[2] >> 4};
    VolNode *node;
    VolStatus status = make_node(builder, node_at, &node, err);
    if (!status)
        status = make_table(node, err);
    if (status)
        return status;
    uint32_t *entry = &node->bricks[((at[0] & 15) * 16 + (at[1] & 15)) * 16 + (at[2] & 15)];
    *number = *entry;
    if (*number && memcmp(builder->places[*number].at, at, sizeof builder->places[*number].at) == 0)
        return VOL_OK;
    status = new_brick(builder, at, builder->grid->bricks[*entry].uniform, number, err);
    if (!status)
        *entry = *number;
    return status;
}

static void *voxels_of(VolGrid *grid, const VolBrick *brick)
{
    size_t at = (size_t)brick->storage * VOL_BRICK_STRIDE;
    return grid->is_double ? (void *)((double *)grid->values + at) : (void *)((float *)grid->values + at);
}

/* Gives a brick storage, filled with its uniform value. */
static VolStatus store_brick(VolGridBuilder *builder, uint32_t number, VolError *err)
{
    VolGrid *grid = builder->grid;
    VolBrick *brick = &grid->bricks[number];
    if (brick->storage != VOL_NO_STORAGE)
        return VOL_OK;
    size_t size = grid->is_double ? sizeof(double) : sizeof(float);
    if (grid->stored_bricks == builder->stored_capacity) {
        /* Growing a block this large moves its pages, not its bytes; untouched pages cost nothing. */
        size_t grown = builder->stored_capacity ? builder->stored_capacity * 2 : 64;
        void *values = vol_resize(grid->values, grown, VOL_BRICK_STRIDE * size);
        if (!values || grown >= UINT32_MAX)
            return vol_fail_memory(err, grown * VOL_BRICK_STRIDE * size);
        grid->values = values;
        builder->stored_capacity = grown;
    }
    brick->storage = (uint32_t)grid->stored_bricks++;
    if (grid->is_double) {
        double *v = voxels_of(grid, brick);
        for (int n = 0; n < VOL_BRICK_STRIDE; n++)
            v[n] = n < VOL_BRICK_VALUES ? brick->uniform : 0;
    } else {
        float *v = voxels_of(grid, brick);
        for (int n = 0; n < VOL_BRICK_STRIDE; n++)
            v[n] = n < VOL_BRICK_VALUES ? (float)brick->uniform : 0;
    }
    return VOL_OK;
}

static void set_voxel(VolGrid *grid, const VolBrick *brick, int x, int y, int z, double value)
{
    size_t at = (size_t)((x * VOL_BRICK_SIDE + y) * VOL_BRICK_SIDE + z);
    if (grid->is_double)
        ((double *)voxels_of(grid, brick))[at] = value;
    else
        ((float *)voxels_of(grid, brick))[at] = (float)value;
}

/* ---- Taking leaves and tiles ---- */

VolStatus vol_grid_leaf(VolGridBuilder *builder, const int32_t origin[3], const float *floats, const double *doubles,
                        const uint64_t active[8], VolError *err)
{
    VolGrid *grid = builder->grid;
    int32_t at[3] = {origin[0] >> 3, origin[1] >> 3, origin[2] >> 3};
    uint32_t number;
    VolStatus status = own_brick(builder, at, &number, err);
    if (!status)
        status = store_brick(builder, number, err);
    if (status)
        return status;
    bool keep_inactive = builder->source.box || builder->source.level_set;
    const VolBrick *brick = &grid->bricks[number];
    for (int n = 0; n < 512; n++) {
        bool on = active[n >> 6] >> (n & 63) & 1;
        double value = on || keep_inactive ? (floats ? (double)floats[n] : doubles[n]) : grid->background;
        set_voxel(grid, brick, n >> 6, n >> 3 & 7, n & 7, value);
    }
    return VOL_OK;
}

static VolStatus put_uniform_node(VolGridBuilder *builder, const int32_t at[3], double value, VolError *err)
{
    VolNode *node;
    VolStatus status = make_node(builder, at, &node, err);
    if (status)
        return status;
    int32_t nowhere[3] = {INT32_MIN, INT32_MIN, INT32_MIN}; /* shared by many places: no place owns it */
    size_t node_number = (size_t)(node - builder->grid->nodes);
    uint32_t number;
    status = new_brick(builder, nowhere, value, &number, err);
    if (status)
        return status;
    node = &builder->grid->nodes[node_number];
    free(node->bricks);
    node->bricks = NULL;
    node->uniform = number;
    return VOL_OK;
}

/* A value as the pool holds it. */
static double as_stored(const VolGrid *grid, double value) { return grid->is_double ? value : (double)(float)value; }

VolStatus vol_grid_tile(VolGridBuilder *builder, const int32_t origin[3], int32_t size, double value, bool active,
                        VolError *err)
{
    VolGrid *grid = builder->grid;
    if (!active && !builder->source.box && !builder->source.level_set)
        return VOL_OK;
    value = as_stored(grid, value);
    if (value == grid->background)
        return VOL_OK;
    if (size == VOL_BRICK_CELLS) {
        int32_t at[3] = {origin[0] >> 3, origin[1] >> 3, origin[2] >> 3};
        uint32_t number;
        VolStatus status = own_brick(builder, at, &number, err);
        if (!status)
            grid->bricks[number].uniform = value;
        return status;
    }
    /* Larger tiles: the nodes among those that the domain touches. */
    int32_t lo[3], hi[3];
    for (int a = 0; a < 3; a++) {
        int64_t end = (int64_t)origin[a] + size - 1;
        lo[a] = origin[a] < grid->voxel_min[a] ? grid->voxel_min[a] : origin[a];
        hi[a] = end > grid->voxel_max[a] ? grid->voxel_max[a] : (int32_t)end;
        if (lo[a] > hi[a])
            return VOL_OK;
    }
    for (int32_t x = lo[0] >> 7; x <= hi[0] >> 7; x++)
        for (int32_t y = lo[1] >> 7; y <= hi[1] >> 7; y++)
            for (int32_t z = lo[2] >> 7; z <= hi[2] >> 7; z++) {
                VolStatus status = put_uniform_node(builder, (int32_t[3]){x, y, z}, value, err);
                if (status)
                    return status;
            }
    return VOL_OK;
}

/* ---- Shared layers ---- */

/* Box domains of one voxel along an axis: the field is constant along it, so the voxels on either side repeat it. */
static VolStatus widen_thin_axes(VolGridBuilder *builder, VolError *err)
{
    VolGrid *grid = builder->grid;
    for (int a = 0; a < 3; a++) {
        if (!grid->thin[a] || grid->empty)
            continue;
        int32_t layer = grid->voxel_min[a];
        size_t count = grid->brick_count;
        for (size_t n = 1; n < count; n++)
            if (builder->places[n].at[a] == layer >> 3)
                for (int side = -1; side <= 1; side += 2) {
                    int32_t at[3];
                    memcpy(at, builder->places[n].at, sizeof at);
                    at[a] = (layer + side) >> 3;
                    uint32_t to;
                    VolStatus status = own_brick(builder, at, &to, err);
                    if (!status)
                        status = store_brick(builder, to, err);
                    if (status)
                        return status;
                    for (int u = 0; u < 64; u++) {
                        int p[3], q[3];
                        p[a] = layer & 7;
                        q[a] = (layer + side) & 7;
                        p[(a + 1) % 3] = q[(a + 1) % 3] = u >> 3;
                        p[(a + 2) % 3] = q[(a + 2) % 3] = u & 7;
                        double v = vol_grid_stored_value(grid, &grid->bricks[n], p[0], p[1], p[2]);
                        set_voxel(grid, &grid->bricks[to], q[0], q[1], q[2], v);
                    }
                }
    }
    return VOL_OK;
}

/* Whether the domain has cells in the brick at `at`. */
static bool inside_domain(const VolGrid *grid, const int32_t at[3])
{
    for (int a = 0; a < 3; a++)
        if (at[a] < grid->cell_min[a] >> 3 || at[a] > grid->cell_max[a] >> 3)
            return false;
    return true;
}

/* Whether some voxel that brick `number` shares with its neighbour `step` below differs from `value`. */
static bool layer_differs(const VolGrid *grid, uint32_t number, const int step[3], double value)
{
    const VolBrick *brick = &grid->bricks[number];
    if (brick->storage == VOL_NO_STORAGE)
        return !(brick->uniform == value);
    for (int x = 0; x < (step[0] ? 1 : 8); x++)
        for (int y = 0; y < (step[1] ? 1 : 8); y++)
            for (int z = 0; z < (step[2] ? 1 : 8); z++)
                if (!(vol_grid_stored_value(grid, brick, x, y, z) == value))
                    return true;
    return false;
}

/* The brick one `step` below brick `number` at `at` gets storage where the layer they share differs from its value. */
static VolStatus store_neighbour(VolGridBuilder *builder, uint32_t number, const int32_t at[3], const int step[3],
                                 VolError *err)
{
    VolGrid *grid = builder->grid;
    int32_t below[3] = {at[0] - step[0], at[1] - step[1], at[2] - step[2]};
    if (!inside_domain(grid, below))
        return VOL_OK;
    const VolBrick *there = &grid->bricks[vol_grid_brick_number(grid, below[0], below[1], below[2])];
    if (there->storage != VOL_NO_STORAGE || !layer_differs(grid, number, step, there->uniform))
        return VOL_OK;
    uint32_t own;
    VolStatus status = own_brick(builder, below, &own, err);
    return status ? status : store_brick(builder, own, err);
}

static void step_of(int n, int step[3])
{
    step[0] = n >> 2 & 1;
    step[1] = n >> 1 & 1;
    step[2] = n & 1;
}

/* A brick of one value at `at` gets storage where the layer it shares with the one `step` above differs. */
static VolStatus store_uniform(VolGridBuilder *builder, uint32_t number, const int32_t at[3], const int step[3],
                               VolError *err)
{
    VolGrid *grid = builder->grid;
    if (grid->bricks[number].storage != VOL_NO_STORAGE || !inside_domain(grid, at))
        return VOL_OK;
    uint32_t above = vol_grid_brick_number(grid, at[0] + step[0], at[1] + step[1], at[2] + step[2]), own;
    if (!layer_differs(grid, above, step, grid->bricks[number].uniform))
        return VOL_OK;
    VolStatus status = own_brick(builder, at, &own, err);
    return status ? status : store_brick(builder, own, err);
}

/* Both neighbours of the brick at `at` along `step`. */
static VolStatus store_around(VolGridBuilder *builder, uint32_t number, const int32_t at[3], const int step[3],
                              VolError *err)
{
    VolStatus status = store_neighbour(builder, number, at, step, err);
    return status ? status : store_uniform(builder, number, at, step, err);
}

/* A uniform node shares one brick among 16^3 places: those on its faces have neighbours that differ. */
static VolStatus store_around_node(VolGridBuilder *builder, size_t number, const int step[3], VolError *err)
{
    for (int p = 0; p < VOL_NODE_ENTRIES; p++) {
        VolNode node = builder->grid->nodes[number];
        int local[3] = {p >> 8, p >> 4 & 15, p & 15};
        bool on_face = false;
        for (int a = 0; a < 3; a++)
            on_face = on_face || (step[a] && (local[a] == 0 || local[a] == VOL_NODE_BRICKS - 1));
        int32_t at[3] = {node.at[0] * 16 + local[0], node.at[1] * 16 + local[1], node.at[2] * 16 + local[2]};
        if (!on_face || vol_grid_brick_number(builder->grid, at[0], at[1], at[2]) != node.uniform)
            continue;
        VolStatus status = store_around(builder, node.uniform, at, step, err);
        if (status)
            return status;
    }
    return VOL_OK;
}

static VolStatus store_all_neighbours(VolGridBuilder *builder, VolError *err)
{
    VolGrid *grid = builder->grid;
    size_t bricks = grid->brick_count, nodes = grid->node_count;
    for (int n = 1; n < 8; n++) {
        int step[3];
        step_of(n, step);
        for (uint32_t b = 1; b < bricks; b++) {
            BrickPlace place = builder->places[b];
            if (vol_grid_brick_number(grid, place.at[0], place.at[1], place.at[2]) != b)
                continue; /* shared, or replaced by a tile that came later */
            VolStatus status = store_around(builder, b, place.at, step, err);
            if (status)
                return status;
        }
        for (size_t m = 0; m < nodes; m++) {
            VolStatus status = grid->nodes[m].uniform ? store_around_node(builder, m, step, err) : VOL_OK;
            if (status)
                return status;
        }
    }
    return VOL_OK;
}

static void copy_layers(VolGridBuilder *builder, uint32_t number)
{
    VolGrid *grid = builder->grid;
    const VolBrick *brick = &grid->bricks[number];
    const int32_t *at = builder->places[number].at;
    for (int n = 1; n < 8; n++) {
        int step[3];
        step_of(n, step);
        uint32_t above = vol_grid_brick_number(grid, at[0] + step[0], at[1] + step[1], at[2] + step[2]);
        const VolBrick *from = &grid->bricks[above];
        for (int x = 0; x < (step[0] ? 1 : 8); x++)
            for (int y = 0; y < (step[1] ? 1 : 8); y++)
                for (int z = 0; z < (step[2] ? 1 : 8); z++)
                    set_voxel(grid, brick, x + 8 * step[0], y + 8 * step[1], z + 8 * step[2],
                              vol_grid_stored_value(grid, from, x, y, z));
    }
}

/* Range over the voxels that cells inside the domain use; counts what is not finite among the brick's own voxels. */
static void take_range(VolGridBuilder *builder, uint32_t number)
{
    VolGrid *grid = builder->grid;
    VolBrick *brick = &grid->bricks[number];
    const int32_t *at = builder->places[number].at;
    int first[3], last[3];
    for (int a = 0; a < 3; a++) {
        int32_t base = at[a] * VOL_BRICK_CELLS;
        first[a] = grid->cell_min[a] > base ? grid->cell_min[a] - base : 0;
        last[a] = grid->cell_max[a] + 1 < base + 8 ? grid->cell_max[a] + 1 - base : 8;
    }
    brick->lo = INFINITY;
    brick->hi = -INFINITY;
    for (int x = first[0]; x <= last[0]; x++)
        for (int y = first[1]; y <= last[1]; y++)
            for (int z = first[2]; z <= last[2]; z++) {
                double v = vol_grid_stored_value(grid, brick, x, y, z);
                if (isfinite(v)) {
                    brick->lo = v < brick->lo ? v : brick->lo;
                    brick->hi = v > brick->hi ? v : brick->hi;
                    continue;
                }
                brick->holes = true;
                bool own = x < 8 && y < 8 && z < 8;
                for (int a = 0; a < 3; a++) {
                    int32_t voxel = at[a] * 8 + (a == 0 ? x : a == 1 ? y : z);
                    own = own && voxel >= grid->voxel_min[a] && voxel <= grid->voxel_max[a];
                }
                grid->bad_voxels += own;
            }
}

static void take_uniform_range(VolBrick *brick)
{
    bool finite = isfinite(brick->uniform);
    brick->lo = finite ? brick->uniform : INFINITY;
    brick->hi = finite ? brick->uniform : -INFINITY;
    brick->holes = !finite;
}

VolStatus vol_grid_finish(VolGridBuilder *builder, VolGrid **out, VolError *err)
{
    VolGrid *grid = builder->grid;
    VolStatus status = widen_thin_axes(builder, err);
    if (!status)
        status = store_all_neighbours(builder, err);
    if (status) {
        vol_grid_builder_free(builder);
        return status;
    }
    for (uint32_t b = 1; b < grid->brick_count; b++)
        if (grid->bricks[b].storage != VOL_NO_STORAGE)
            copy_layers(builder, b);
    for (uint32_t b = 0; b < grid->brick_count; b++)
        if (grid->bricks[b].storage != VOL_NO_STORAGE)
            take_range(builder, b);
        else
            take_uniform_range(&grid->bricks[b]);
    builder->grid = NULL;
    vol_grid_builder_free(builder);
    *out = grid;
    return VOL_OK;
}
