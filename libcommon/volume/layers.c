/* Ends the building of a grid: the layers that bricks share, and their ranges.
 *
 * Once it is settled which bricks need storage for their last layers (octants.c), these are copied from the bricks above
 * and each brick's range is taken: over threads, as a brick writes its last layers only, and reads others' first ones. */
#include <math.h>
#include <stdatomic.h>
#include <string.h>

#include "base/pool.h"
#include "volume/grid_internal.h"

#define REAL float
#define RANGE(name) name##_of_floats
#include "volume/range_tmpl.h"
#undef REAL
#undef RANGE

#define REAL double
#define RANGE(name) name##_of_doubles
#include "volume/range_tmpl.h"
#undef REAL
#undef RANGE

/* ---- Bricks that need storage ---- */

static void copy_voxel(const VolGrid *grid, const VolBrick *from, const int p[3], const VolBrick *to, const int q[3])
{
    for (int c = 0; c < vol_grid_planes(grid); c++)
        vol_grid_fill(grid, vol_grid_voxel_place(grid, to, c, q[0], q[1], q[2]), 1,
                      vol_grid_held(grid, from, c, p[0], p[1], p[2]));
}

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
                        copy_voxel(grid, &grid->bricks[n], p, &grid->bricks[to], q);
                    }
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

static void copy_layer_of_plane(const VolGrid *grid, const VolBrick *brick, const VolBrick *above, int plane,
                                const int step[3])
{
    unsigned char *to = vol_grid_voxel_place(grid, brick, plane, 0, 0, 0);
    bool uniform = above->storage == VOL_NO_STORAGE;
    union {
        float floats[8];
        double doubles[8];
    } same; /* a row of what a uniform brick holds */
    const unsigned char *from = (const unsigned char *)&same;
    if (uniform)
        vol_grid_fill(grid, &same, 8, vol_grid_in_plane(grid, above->uniform, plane));
    else
        from = vol_grid_voxel_place(grid, above, plane, 0, 0, 0);
    if (grid->is_double)
        copy_layer(to, from, uniform, step, sizeof(double));
    else
        copy_layer(to, from, uniform, step, sizeof(float));
}

static void copy_layers(const VolGrid *grid, const VolBrick *brick, const int32_t at[3])
{
    for (int n = 1; n < 8; n++) {
        int step[3];
        vol_grid_step(n, step);
        const VolBrick *above =
            &grid->bricks[vol_grid_brick_number(grid, at[0] + step[0], at[1] + step[1], at[2] + step[2])];
        for (int c = 0; c < vol_grid_planes(grid); c++)
            copy_layer_of_plane(grid, brick, above, c, step);
    }
}

/* Range over the voxels that cells inside the domain use; how many of the brick's own are not finite. */
static uint64_t take_range(const VolGrid *grid, VolBrick *brick, const int32_t at[3])
{
    const void *values = vol_grid_voxel_place(grid, brick, 0, 0, 0, 0);
    bool whole = true;
    for (int a = 0; a < 3; a++)
        whole = whole && grid->cell_min[a] <= at[a] * VOL_BRICK_CELLS && grid->cell_max[a] >= at[a] * VOL_BRICK_CELLS + 7;
    if (grid->is_double)
        return whole && whole_range_of_doubles(values, 1, brick) ? 0 : range_of_doubles(grid, values, at, brick);
    whole = whole && whole_range_of_floats(values, vol_grid_planes(grid), brick);
    return whole ? 0 : range_of_floats(grid, values, at, brick);
}

/* Voxels of a brick's own that are in the domain. */
static uint64_t own_voxels(const VolGrid *grid, const int32_t at[3])
{
    uint64_t voxels = 1;
    for (int a = 0; a < 3; a++) {
        int64_t first = (int64_t)at[a] * 8, last = first + 7;
        first = first < grid->voxel_min[a] ? grid->voxel_min[a] : first;
        last = last > grid->voxel_max[a] ? grid->voxel_max[a] : last;
        voxels *= last < first ? 0 : (uint64_t)(last - first + 1);
    }
    return voxels;
}

/* Of a brick without storage; as take_range.  One that many places share is nowhere: all of it counts. */
static uint64_t take_octants_range(const VolGrid *grid, VolBrick *brick, const BrickPlace *place)
{
    unsigned beyond = 0; /* axes along which the last layer lies outside */
    for (int a = 0; a < 3 && !brick->shared; a++)
        beyond |= (unsigned)(grid->cell_max[a] + 1 < place->at[a] * VOL_BRICK_CELLS + VOL_BRICK_CELLS) << (2 - a);
    brick->lo = INFINITY;
    brick->hi = -INFINITY;
    for (unsigned k = 0; k < 8; k++) {
        double value = brick->octants ? grid->octants[brick->octants - 1].value[k] : brick->uniform;
        for (int c = 0; c < vol_grid_planes(grid) && !(k & beyond); c++) {
            double v = vol_grid_in_plane(grid, value, c);
            if (isfinite(v)) {
                brick->lo = fmin(brick->lo, v) + 0.0;
                brick->hi = fmax(brick->hi, v) + 0.0;
            } else
                brick->invalid = true;
        }
    }
    return brick->shared || vol_grid_is_finite(grid, brick->uniform) ? 0 : own_voxels(grid, place->at);
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
        const BrickPlace *place = &finish->places[b];
        uint64_t strange = 0;
        if (brick->storage == VOL_NO_STORAGE) {
            strange = take_octants_range(grid, brick, place);
        } else {
            copy_layers(grid, brick, place->at);
            strange = take_range(grid, brick, place->at);
        }
        bad += place->of_tile ? 0 : strange;
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
        status = vol_grid_settle_last_layers(builder, err);
    if (!status)
        status = vol_grid_make_table(grid, err);
    finish.places = builder->places; /* they may have moved */
    if (!status)
        status = vol_parallel(builder->source.threads, (grid->brick_count + BRICKS_PER_ITEM - 1) / BRICKS_PER_ITEM,
                              finish_bricks, &finish, err);
    if (!status) {
        grid->bad_voxels = finish.bad_voxels + builder->bad_in_tiles;
        builder->grid = NULL;
        *out = grid;
    }
    vol_grid_builder_free(builder);
    return status;
}
