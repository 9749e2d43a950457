/* What the files of this folder share; not for others. */
#ifndef VOL_VOLUME_GRID_INTERNAL_H
#define VOL_VOLUME_GRID_INTERNAL_H

#include <math.h>

#include "base/mem.h"
#include "volume/grid.h"

typedef struct BrickPlace {
    int32_t at[3]; /* brick coordinates */
    bool of_tile;  /* cut from a larger tile, whose voxels have been counted */
} BrickPlace;

struct VolGridBuilder {
    VolGridSource source;
    VolGrid *grid;
    BrickPlace *places; /* beside grid->bricks */
    size_t brick_capacity, node_capacity, octant_capacity;
    VolCubes shared_octants; /* bricks made of octants alone, by what they hold: octants.c */
    uint64_t bad_in_tiles;   /* voxels of large tiles that are not finite, in the domain */
};

/* ---- build.c ---- */

/* Enters node `number` into the hash, which must have room; a new hash with all nodes entered. */
void vol_grid_enter_node(VolGrid *grid, size_t number);
VolStatus vol_grid_rehash(VolGrid *grid, size_t size, VolError *err);

/* The table of all nodes in place of the hash, unless it would be too large.  No node may be made thereafter. */
VolStatus vol_grid_make_table(VolGrid *grid, VolError *err);

/* A brick of its own at `at` (a copy of what is there if that is shared by others). */
VolStatus vol_grid_own_brick(VolGridBuilder *builder, const int32_t at[3], uint32_t *number, VolError *err);

/* Gives a brick storage, filled with its uniform value. */
VolStatus vol_grid_store_brick(VolGridBuilder *builder, uint32_t number, VolError *err);

/* The node at `at`, made where there is none: as the root around it, or background.  Pointers to others die. */
VolStatus vol_grid_make_node(VolGridBuilder *builder, const int32_t at[3], VolNode **out, VolError *err);
/* Gives a node bricks of its own, unless it has some. */
VolStatus vol_grid_detail_node(VolNode *node, VolError *err);
VolStatus vol_grid_new_brick(VolGridBuilder *builder, const int32_t at[3], double uniform, uint32_t *number, VolError *err);

/* ---- octants.c ---- */

/* The last layers of bricks, nodes and roots, where another value begins there: octants, or storage. */
VolStatus vol_grid_settle_last_layers(VolGridBuilder *builder, VolError *err);

/* ---- grid.c ---- */

/* The blocks of 2^smallest nodes a side and more around `node_at` are not empty. */
VolStatus vol_grid_occupy(VolGrid *grid, const int32_t node_at[3], int smallest, VolError *err);

/* The n-th of the seven steps up along some axes; n is also the octant that lies there. */
static inline void vol_grid_step(int n, int step[3])
{
    step[0] = n >> 2 & 1;
    step[1] = n >> 1 & 1;
    step[2] = n & 1;
}

/* Whether the block of `size` cells at `at` has cells in the domain. */
static inline bool vol_grid_in_domain(const VolGrid *grid, const int32_t at[3], int32_t size)
{
    for (int a = 0; a < 3; a++)
        if ((int64_t)at[a] * size > grid->cell_max[a] || ((int64_t)at[a] + 1) * size <= grid->cell_min[a])
            return false;
    return true;
}

static inline size_t vol_grid_value_size(const VolGrid *grid) { return grid->is_double ? sizeof(double) : sizeof(float); }

/* Voxel (x, y, z) of a brick that has storage. */
static inline unsigned char *vol_grid_voxel_place(const VolGrid *grid, const VolBrick *brick, int plane, int x, int y,
                                                  int z)
{
    size_t before = ((size_t)brick->storage * (size_t)vol_grid_planes(grid) + (size_t)plane) * VOL_BRICK_STRIDE;
    size_t at = before + (size_t)((x * VOL_BRICK_SIDE + y) * VOL_BRICK_SIDE + z);
    return (unsigned char *)grid->values + at * vol_grid_value_size(grid);
}

/* What a plane of a brick holds at voxel (x, y, z), 0 to 8. */
static inline double vol_grid_held(const VolGrid *grid, const VolBrick *brick, int plane, int x, int y, int z)
{
    if (vol_brick_is_uniform(brick))
        return vol_grid_in_plane(grid, brick->uniform, plane);
    if (brick->storage == VOL_NO_STORAGE) {
        const double *octant = grid->octants[brick->octants - 1].value;
        return vol_grid_in_plane(grid, octant[(x >> 3) * 4 + (y >> 3) * 2 + (z >> 3)], plane);
    }
    const void *place = vol_grid_voxel_place(grid, brick, plane, x, y, z);
    return grid->is_double ? *(const double *)place : (double)*(const float *)place;
}

/* Whether a single value is finite, all of it. */
static inline bool vol_grid_is_finite(const VolGrid *grid, double value)
{
    bool finite = true;
    for (int c = 0; c < vol_grid_planes(grid); c++)
        finite = finite && isfinite(vol_grid_in_plane(grid, value, c));
    return finite;
}

/* `value` as the pool holds it, `count` times: of one plane. */
static inline void vol_grid_fill(const VolGrid *grid, void *to, size_t count, double value)
{
    float narrow = (float)value;
    if (grid->is_double)
        for (size_t n = 0; n < count; n++)
            ((double *)to)[n] = value;
    else
        for (size_t n = 0; n < count; n++)
            ((float *)to)[n] = narrow;
}

#endif
