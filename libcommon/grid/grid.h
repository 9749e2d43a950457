/* The sparse scalar field that rays use.
 *
 * Voxels are kept in bricks of 8^3 cells, that is 9^3 voxels: the last layer of each axis repeats the first of the next
 * brick, so that a cell never needs a second look-up.  z is fastest, as in OpenVDB's leaves: the two corners of a cell
 * along z lie side by side.  Bricks that hold one value have no storage.  A node is 16^3 bricks; nodes are found by a
 * hash of their coordinates, so that a volume may lie anywhere in index space.  What no brick covers is background.
 *
 * Index space: voxel (i, j, k) has its value at the point (i, j, k).  Cell (i, j, k) lies between voxels i and i+1 etc. */
#ifndef VOL_GRID_GRID_H
#define VOL_GRID_GRID_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/status.h"
#include "base/vec.h"

enum {
    VOL_BRICK_CELLS = 8,
    VOL_BRICK_SIDE = 9,
    VOL_BRICK_VALUES = VOL_BRICK_SIDE * VOL_BRICK_SIDE * VOL_BRICK_SIDE,
    VOL_BRICK_STRIDE = 736, /* values from one brick to the next: a multiple of a cache line */
    VOL_NODE_BRICKS = 16,
    VOL_NODE_CELLS = VOL_NODE_BRICKS * VOL_BRICK_CELLS,
    VOL_NODE_ENTRIES = VOL_NODE_BRICKS * VOL_NODE_BRICKS * VOL_NODE_BRICKS
};

#define VOL_NO_STORAGE UINT32_MAX

typedef struct VolBrick {
    double lo, hi;    /* range of the finite values of its 9^3 voxels inside the domain; lo > hi: there are none */
    double uniform;   /* the value of all its voxels where it has no storage */
    uint32_t storage; /* place in the pool of values, or VOL_NO_STORAGE */
    bool holes;       /* some voxel is NaN or infinite: the cells around it are empty */
} VolBrick;

typedef struct VolNode {
    int32_t at[3];     /* node coordinates: index / 128, rounded down */
    uint32_t uniform;  /* brick shared by all 16^3 places where `bricks` is NULL */
    uint32_t *bricks;  /* [(x*16 + y)*16 + z] */
} VolNode;

typedef enum VolDomainKind {
    VOL_DOMAIN_BOX,   /* ends at its outermost voxel centres */
    VOL_DOMAIN_SPARSE /* fades to its background over one voxel around the active bounding box */
} VolDomainKind;

typedef struct VolGrid {
    bool is_double;           /* values are double, else float */
    void *values;             /* the pool: brick b's voxel (x, y, z) at storage*STRIDE + (x*9 + y)*9 + z */
    size_t stored_bricks;
    VolBrick *bricks;         /* brick 0: the background */
    size_t brick_count;
    VolNode *nodes;
    size_t node_count;
    uint32_t *hash;           /* node number + 1, 0 empty; linear probing */
    size_t hash_size;         /* a power of two */

    VolAffine index_to_world, world_to_index;
    double voxel;             /* length of the shortest basis vector */
    double background;
    VolDomainKind domain;
    int32_t voxel_min[3], voxel_max[3]; /* voxels that carry values of their own: the box, or the active bounding box */
    double domain_min[3], domain_max[3]; /* index space, closed */
    int32_t cell_min[3], cell_max[3];   /* cells that the domain touches, inclusive */
    bool thin[3];             /* a box of one voxel along this axis: constant along it, gradient 0 */
    bool empty;               /* nothing active */
    uint64_t bad_voxels;      /* NaN or infinite, inside the domain */
    uint64_t active_voxels;
} VolGrid;

/* ---- Building ---- */

typedef struct VolGridSource {
    VolAffine index_to_world;
    double background;
    bool level_set;           /* inactive voxels of a sparse grid keep their values (their sign is meant) */
    bool box;                 /* inactive voxels inside count with their values */
    int32_t box_min[3], box_max[3]; /* the box, or the active bounding box */
    bool empty;
    bool as_double;
    uint64_t active_voxels;
} VolGridSource;

typedef struct VolGridBuilder VolGridBuilder;

/* VOL_BAD_INPUT: singular transform, or a domain too large to index. */
VolStatus vol_grid_begin(const VolGridSource *source, VolGridBuilder **out, VolError *err);

/* 8^3 values, z fastest; bit n of `active` belongs to value n.  Exactly one of the two value pointers is not NULL. */
VolStatus vol_grid_leaf(VolGridBuilder *builder, const int32_t origin[3], const float *floats, const double *doubles,
                        const uint64_t active[8], VolError *err);
/* A cube of 8, 128 or 4096 voxels. */
VolStatus vol_grid_tile(VolGridBuilder *builder, const int32_t origin[3], int32_t size, double value, bool active,
                        VolError *err);

/* Fills the shared layers and the ranges, and ends the builder, also on failure. */
VolStatus vol_grid_finish(VolGridBuilder *builder, VolGrid **out, VolError *err);
void vol_grid_builder_free(VolGridBuilder *builder);
void vol_grid_free(VolGrid *grid);

/* ---- Looking up ---- */

/* NULL: all of that node is background. */
const VolNode *vol_grid_node(const VolGrid *grid, int32_t x, int32_t y, int32_t z);

/* Brick number that holds cell (i, j, k); 0 for background. */
uint32_t vol_grid_brick_at(const VolGrid *grid, int32_t i, int32_t j, int32_t k);

/* The value of one voxel, clamped into the box of a box domain; background outside a sparse one. */
double vol_grid_voxel(const VolGrid *grid, int32_t i, int32_t j, int32_t k);

/* The range of the finite values in the domain; false: there are none. */
bool vol_grid_range(const VolGrid *grid, double *lo, double *hi);

/* Central difference at a voxel, per index step along each axis: one-sided at the faces of a box and where a neighbour is
 * not finite, 0 along thin axes. */
void vol_grid_voxel_gradient(const VolGrid *grid, int32_t i, int32_t j, int32_t k, double gradient[3]);

#endif
