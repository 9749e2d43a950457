/* What grid.c and build.c share; not for others. */
#ifndef VOL_GRID_GRID_INTERNAL_H
#define VOL_GRID_GRID_INTERNAL_H

#include "base/mem.h"
#include "grid/grid.h"

/* Enters node `number` into the hash, which must have room; a new table with all nodes entered. */
void vol_grid_enter_node(VolGrid *grid, size_t number);
VolStatus vol_grid_rehash(VolGrid *grid, size_t size, VolError *err);

/* Brick coordinates: index / 8, rounded down. */
uint32_t vol_grid_brick_number(const VolGrid *grid, int32_t bx, int32_t by, int32_t bz);

double vol_grid_stored_value(const VolGrid *grid, const VolBrick *brick, int x, int y, int z);

#endif
