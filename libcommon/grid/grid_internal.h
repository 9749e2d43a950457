/* What the files of this folder share; not for others. */
#ifndef VOL_GRID_GRID_INTERNAL_H
#define VOL_GRID_GRID_INTERNAL_H

#include "base/mem.h"
#include "grid/grid.h"

typedef struct BrickPlace {
    int32_t at[3]; /* brick coordinates */
} BrickPlace;

struct VolGridBuilder {
    VolGridSource source;
    VolGrid *grid;
    BrickPlace *places; /* beside grid->bricks */
    size_t brick_capacity, node_capacity;
};

/* Enters node `number` into the hash, which must have room; a new hash with all nodes entered. */
void vol_grid_enter_node(VolGrid *grid, size_t number);
VolStatus vol_grid_rehash(VolGrid *grid, size_t size, VolError *err);

/* The table of all nodes in place of the hash, unless it would be too large.  No node may be made thereafter. */
VolStatus vol_grid_make_table(VolGrid *grid, VolError *err);

/* A brick of its own at `at` (a copy of what is there if that is shared by others). */
VolStatus vol_grid_own_brick(VolGridBuilder *builder, const int32_t at[3], uint32_t *number, VolError *err);

/* Gives a brick storage, filled with its uniform value. */
VolStatus vol_grid_store_brick(VolGridBuilder *builder, uint32_t number, VolError *err);

static inline size_t vol_grid_value_size(const VolGrid *grid) { return grid->is_double ? sizeof(double) : sizeof(float); }

/* Voxel (x, y, z) of a brick that has storage. */
static inline unsigned char *vol_grid_voxel_place(const VolGrid *grid, const VolBrick *brick, int x, int y, int z)
{
    size_t at = (size_t)brick->storage * VOL_BRICK_STRIDE + (size_t)((x * VOL_BRICK_SIDE + y) * VOL_BRICK_SIDE + z);
    return (unsigned char *)grid->values + at * vol_grid_value_size(grid);
}

static inline double vol_grid_stored_value(const VolGrid *grid, const VolBrick *brick, int x, int y, int z)
{
    if (brick->storage == VOL_NO_STORAGE)
        return brick->uniform;
    const void *place = vol_grid_voxel_place(grid, brick, x, y, z);
    return grid->is_double ? *(const double *)place : (double)*(const float *)place;
}

/* `value` as the pool holds it, `count` times. */
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
