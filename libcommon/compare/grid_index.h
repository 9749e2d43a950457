/* The leaves and tiles of one grid in memory, found by place. */
#ifndef VOL_COMPARE_GRID_INDEX_H
#define VOL_COMPARE_GRID_INDEX_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/status.h"

/* A cube of `size` voxels per axis: 8 (a leaf, or a tile of its size), 128 or 4096. */
typedef struct VolCube {
    int32_t origin[3], size;
    double value[3];     /* of a tile */
    double *values;      /* of a leaf: 512 x components, z fastest; NULL in a tile */
    uint64_t active[8];  /* of a leaf */
    bool tile_active;
    bool done;           /* compared as a whole */
    uint64_t covered;    /* voxels of a tile that finer cubes of the other grid were compared with */
} VolCube;

typedef struct VolGridIndex {
    VolCube *cubes;
    size_t count, capacity;
    uint32_t *slots; /* open addressing: index + 1, 0 is free */
    size_t slot_count;
} VolGridIndex;

/* NULL on want of memory.  Pointers to other cubes die. */
VolCube *vol_grid_index_add(VolGridIndex *index, const int32_t origin[3], int32_t size);
/* The cube of at least `min_size` that holds the voxel, or NULL. */
VolCube *vol_grid_index_find(const VolGridIndex *index, const int32_t voxel[3], int32_t min_size);
void vol_grid_index_free(VolGridIndex *index);

#endif
