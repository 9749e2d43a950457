/* Ends the building of a grid: the layers that bricks share, and their ranges.
 *
 * The bricks one step below a brick along any axis, which share a layer of voxels with it, get storage if that layer differs
 * from what they are.  Then each brick's last layers are copied from the bricks above and its range is taken: over threads,
 * as a brick writes its last layers only, and reads others' first ones. */
#include <math.h>
#include <stdatomic.h>
#include <string.h>

#include "base/pool.h"
#include "grid/grid_internal.h"

#define REAL float
#define RANGE(name) name##_of_floats
#include "grid/range_tmpl.h"
#undef REAL
#undef RANGE

#define REAL double
#define RANGE(name) name##_of_doubles
#include "grid/range_tmpl.h"
#undef REAL
#undef RANGE

/* ---- Bricks that need storage ---- */

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
                    VolStatus status = vol_grid_own_brick(builder, at, &to, err);
                    if (!status)
                        status = vol_grid_store_brick(builder, to, err);
                    if (status)
                        return status;
                    for (int u = 0; u < 64; u++) {
                        int p[3], q[3];
                        p[a] = layer & 7;
                        q[a] = (layer + side) & 7;
                        p[(a + 1) % 3] = q[(a + 1) % 3] = u >> 3;
                        p[(a + 2) % 3] = q[(a + 2) % 3] = u & 7;
                        double v = vol_grid_stored_value(grid, &grid->bricks[n], p[0], p[1], p[2]);
                        vol_grid_fill(grid, vol_grid_voxel_place(grid, &grid->bricks[to], q[0], q[1], q[2]), 1, v);
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
    VolStatus status = vol_grid_own_brick(builder, below, &own, err);
    return status ? status : vol_grid_store_brick(builder, own, err);
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
    VolStatus status = vol_grid_own_brick(builder, at, &own, err);
    return status ? status : vol_grid_store_brick(builder, own, err);
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

/* ---- Shared layers and ranges ---- */

/* The voxels that a brick shares with the one `step` above, in rows along z.  Of a uniform one there is one row. */
static inline void copy_layer(unsigned char *to, const unsigned char *from, bool uniform, const int step[3],
                              size_t size)
{
    size_t last = VOL_BRICK_SIDE - 1;
    to += (size_t)step[0] * last * VOL_BRICK_SIDE * VOL_BRICK_SIDE * size + (size_t)step[1] * last * VOL_BRICK_SIDE * size +
          (size_t)step[2] * last * size;
    for (size_t x = 0; x < (step[0] ? 1 : 8); x++)
        for (size_t y = 0; y < (step[1] ? 1 : 8); y++) {
            size_t row = (x * VOL_BRICK_SIDE + y) * VOL_BRICK_SIDE * size;
            const unsigned char *source = uniform ? from : from + row;
            if (step[2])
                memcpy(to + row, source, size);
            else
                memcpy(to + row, source, 8 * size);
        }
}

static void copy_layers(const VolGrid *grid, const VolBrick *brick, const int32_t at[3])
{
    unsigned char *to = vol_grid_voxel_place(grid, brick, 0, 0, 0);
    for (int n = 1; n < 8; n++) {
        int step[3];
        step_of(n, step);
        const VolBrick *above =
            &grid->bricks[vol_grid_brick_number(grid, at[0] + step[0], at[1] + step[1], at[2] + step[2])];
        bool uniform = above->storage == VOL_NO_STORAGE;
        union {
            float floats[8];
            double doubles[8];
        } same; /* a row of what a uniform brick holds */
        const unsigned char *from = (const unsigned char *)&same;
        if (uniform)
            vol_grid_fill(grid, &same, 8, above->uniform);
        else
            from = vol_grid_voxel_place(grid, above, 0, 0, 0);
        if (grid->is_double)
            copy_layer(to, from, uniform, step, sizeof(double));
        else
            copy_layer(to, from, uniform, step, sizeof(float));
    }
}

/* Range over the voxels that cells inside the domain use; how many of the brick's own are not finite. */
static uint64_t take_range(const VolGrid *grid, VolBrick *brick, const int32_t at[3])
{
    const void *values = vol_grid_voxel_place(grid, brick, 0, 0, 0);
    bool whole = true;
    for (int a = 0; a < 3; a++)
        whole = whole && grid->cell_min[a] <= at[a] * VOL_BRICK_CELLS && grid->cell_max[a] >= at[a] * VOL_BRICK_CELLS + 7;
    if (grid->is_double)
        return whole && whole_range_of_doubles(values, brick) ? 0 : range_of_doubles(grid, values, at, brick);
    return whole && whole_range_of_floats(values, brick) ? 0 : range_of_floats(grid, values, at, brick);
}

static void take_uniform_range(VolBrick *brick)
{
    bool finite = isfinite(brick->uniform);
    brick->lo = finite ? brick->uniform : INFINITY;
    brick->hi = finite ? brick->uniform : -INFINITY;
    brick->holes = !finite;
}

enum { BRICKS_PER_ITEM = 256 };

typedef struct Finish {
    VolGrid *grid;
    const BrickPlace *places;
    _Atomic uint64_t bad_voxels;
} Finish;

static VolStatus finish_bricks(void *user, size_t index, int thread, VolError *err)
{
    Finish *finish = user;
    VolGrid *grid = finish->grid;
    size_t first = index * BRICKS_PER_ITEM, end = first + BRICKS_PER_ITEM;
    uint64_t bad = 0;
    (void)thread;
    (void)err;
    for (size_t b = first; b < end && b < grid->brick_count; b++) {
        VolBrick *brick = &grid->bricks[b];
        if (brick->storage == VOL_NO_STORAGE) {
            take_uniform_range(brick);
            continue;
        }
        copy_layers(grid, brick, finish->places[b].at);
        bad += take_range(grid, brick, finish->places[b].at);
    }
    atomic_fetch_add(&finish->bad_voxels, bad);
    return VOL_OK;
}

VolStatus vol_grid_finish(VolGridBuilder *builder, VolGrid **out, VolError *err)
{
    VolGrid *grid = builder->grid;
    Finish finish = {.grid = grid, .places = builder->places};
    VolStatus status = widen_thin_axes(builder, err);
    if (!status)
        status = store_all_neighbours(builder, err);
    if (!status)
        status = vol_grid_make_table(grid, err);
    finish.places = builder->places; /* they may have moved */
    if (!status)
        status = vol_parallel(builder->source.threads, (grid->brick_count + BRICKS_PER_ITEM - 1) / BRICKS_PER_ITEM,
                              finish_bricks, &finish, err);
    if (!status) {
        grid->bad_voxels = finish.bad_voxels;
        builder->grid = NULL;
        *out = grid;
    }
    vol_grid_builder_free(builder);
    return status;
}
