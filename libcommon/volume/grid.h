/* The sparse field that rays use: of one number per voxel, or of three floats (RGB: light, colour).
 *
 * Voxels are kept in bricks of 8^3 cells, that is 9^3 voxels: the last layer of each axis repeats the first of the next
 * brick, so that a cell never needs a second look-up.  z is fastest, as in OpenVDB's leaves: the two corners of a cell
 * along z lie side by side.  A node is 16^3 bricks; nodes are found in a table of the box that they lie in, or where that
 * box is too large by a hash of their coordinates, so that a volume may lie anywhere in index space.  A root is 32^3
 * nodes.  What none of them covers is background.
 *
 * What is of one value costs no more than that value, however large it is: a brick without storage; and nodes and roots
 * whose bricks are all alike but for the last ones along each axis, where the next block's value begins.  Those, eight
 * kinds at most, are named by which of the three axes they are last along.  A brick that ends in other blocks' single
 * values is itself no more than its own value and those of the seven bricks above: its octants.
 *
 * RGB lies in planes: a brick's red values, then its green ones, then its blue ones, each as a scalar brick's.  A single
 * value - of a brick, an octant, the background - is then the number of one of the grid's colours, so that all that deals
 * with single values deals with numbers alike.
 *
 * Index space: voxel (i, j, k) has its value at the point (i, j, k).  Cell (i, j, k) lies between voxels i and i+1 etc. */
#ifndef VOL_VOLUME_GRID_H
#define VOL_VOLUME_GRID_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include "base/mem.h"
#include "base/status.h"
#include "base/vec.h"
#include "volume/cubes.h"

enum {
    VOL_BRICK_CELLS = 8,
    VOL_BRICK_SIDE = 9,
    VOL_BRICK_VALUES = VOL_BRICK_SIDE * VOL_BRICK_SIDE * VOL_BRICK_SIDE,
    VOL_BRICK_STRIDE = 736, /* values from one brick to the next: a multiple of a cache line */
    VOL_NODE_BRICKS = 16,
    VOL_NODE_CELLS = VOL_NODE_BRICKS * VOL_BRICK_CELLS,
    VOL_NODE_ENTRIES = VOL_NODE_BRICKS * VOL_NODE_BRICKS * VOL_NODE_BRICKS,
    VOL_NODE_LOG2 = 4,  /* bricks along a node's side */
    VOL_ROOT_LOG2 = 9,  /* and a root's */
    VOL_ROOT_NODES = 1 << (VOL_ROOT_LOG2 - VOL_NODE_LOG2),
    VOL_ROOT_CELLS = VOL_ROOT_NODES * VOL_NODE_CELLS
};

#define VOL_NO_STORAGE UINT32_MAX

typedef struct VolBrick {
    double lo, hi;    /* range of the finite values of its 9^3 voxels inside the domain; lo > hi: there are none */
    double uniform;   /* the single value of its first 8^3 voxels, where it has no storage */
    uint32_t storage; /* place in the pool of values, or VOL_NO_STORAGE */
    bool invalid : 1;   /* some voxel is NaN or infinite: the cells around it are empty */
    bool shared : 1;  /* it stands in more than one place */
    uint32_t octants : 30; /* without storage: its last layers, place in the grid's octants + 1; 0: they are uniform too */
} VolBrick;

/* By octant (4: last along x, 2: along y, 1: along z), the single value of a brick's own voxels and of its last layers. */
typedef struct VolOctants {
    double value[8];
} VolOctants;

typedef struct VolNode {
    int32_t at[3];       /* node coordinates: index / 128, rounded down */
    uint32_t detail;     /* number among the nodes that have `bricks` */
    uint32_t octants[8]; /* where `bricks` is NULL: by octant, the brick at all these places */
    uint32_t *bricks;    /* [(x*16 + y)*16 + z] */
} VolNode;

/* 4096^3 cells of one value but for those beside other blocks; nodes that lie in it count before it. */
typedef struct VolRoot {
    int32_t at[3];
    bool has_nodes;
    uint32_t octants[8];
} VolRoot;

typedef enum VolDomainKind {
    VOL_DOMAIN_BOX,   /* ends at its outermost voxel centres */
    VOL_DOMAIN_SPARSE /* fades to its background over one voxel around the active bounding box */
} VolDomainKind;

typedef struct VolGrid {
    bool is_double;           /* values are double, else float */
    bool is_rgb;              /* three per voxel */
    VolCubes colors;          /* of RGB: those that are single values; `at` is the three floats' bits */
    void *values;             /* the pool: brick b's voxel (x, y, z) at (storage*planes + plane)*STRIDE + (x*9 + y)*9 + z.
                               * Bricks begin at multiples of 64 bytes; at least 64 bytes behind the last one may be read. */
    VolPages pool;            /* where `values` lies */
    size_t stored_bricks;
    VolBrick *bricks;         /* brick 0: the background */
    size_t brick_count;
    VolOctants *octants;
    size_t octant_count;
    VolNode *nodes;
    size_t node_count, detail_count; /* with bricks of their own */
    uint32_t *table;          /* node number + 1, 0: none; NULL: nodes are in the hash */
    int32_t table_min[3];     /* the node at table_min + (x, y, z) stands at (x*size[1] + y)*size[2] + z */
    uint32_t table_size[3];
    uint32_t *hash;           /* node number + 1, 0 empty; linear probing; NULL: nodes are in the table */
    size_t hash_size;         /* a power of two */
    VolCubes roots;           /* VolRoot */
    VolCubes occupied;        /* blocks of 2^n nodes a side that are not empty: vol_grid_empty_around() */

    VolAffine index_to_world, world_to_index;
    double voxel;             /* length of the shortest basis vector */
    double background;        /* a single value */
    VolDomainKind domain;
    int32_t voxel_min[3], voxel_max[3]; /* voxels that carry values of their own: the box, or the active bounding box */
    double domain_min[3], domain_max[3]; /* index space, closed */
    int32_t cell_min[3], cell_max[3];   /* cells that the domain touches, inclusive */
    bool thin[3];             /* a box of one voxel along this axis: constant along it, gradient 0 */
    bool empty;               /* nothing active */
    uint64_t bad_voxels;      /* NaN or infinite, or one of the three is, inside the domain */
    uint64_t active_voxels;
} VolGrid;

/* ---- Building ---- */

typedef struct VolGridSource {
    VolAffine index_to_world;
    double background;
    bool is_rgb;              /* three floats per voxel; `background_rgb` counts then, and `as_double` does not */
    double background_rgb[3];
    bool level_set;           /* inactive voxels of a sparse grid keep their values (their sign is meant) */
    bool box;                 /* inactive voxels inside count with their values */
    int32_t box_min[3], box_max[3]; /* the box, or the active bounding box; where nothing is active any one voxel */
    bool empty;
    bool as_double;
    uint64_t active_voxels;
    int threads;              /* that finish the grid; 0 or 1: the caller's alone.  The grid does not depend on it. */
} VolGridSource;

typedef struct VolGridBuilder VolGridBuilder;

/* VOL_BAD_INPUT: singular transform, or a domain too large to index. */
VolStatus vol_grid_begin(const VolGridSource *source, VolGridBuilder **out, VolError *err);

/* Makes room for the leaf at `origin`.  When all leaves are placed and all tiles there, vol_grid_leaf() may be called for
 * them in any order and from several threads at once. */
VolStatus vol_grid_place(VolGridBuilder *builder, const int32_t origin[3], VolError *err);

/* 8^3 values, z fastest; bit n of `active` belongs to value n.  Exactly one of the two value pointers is not NULL; of RGB it
 * is `floats`, three for each voxel. */
VolStatus vol_grid_leaf(VolGridBuilder *builder, const int32_t origin[3], const float *floats, const double *doubles,
                        const uint64_t active[8], VolError *err);
/* A cube of 8, 128 or 4096 voxels. */
VolStatus vol_grid_tile(VolGridBuilder *builder, const int32_t origin[3], int32_t size, double value, bool active,
                        VolError *err);

VolStatus vol_grid_tile_rgb(VolGridBuilder *builder, const int32_t origin[3], int32_t size, const double rgb[3],
                            bool active, VolError *err);

/* Fills the shared layers and the ranges, and ends the builder, also on failure. */
VolStatus vol_grid_finish(VolGridBuilder *builder, VolGrid **out, VolError *err);
void vol_grid_builder_free(VolGridBuilder *builder);
void vol_grid_free(VolGrid *grid);

/* All values times 2^exponent; those that would not be finite any more become the largest that are.  Not of RGB. */
void vol_grid_rescale(VolGrid *grid, int exponent);

/* ---- Looking up ---- */

/* Whether all voxels of a brick hold one value. */
static inline bool vol_brick_is_uniform(const VolBrick *brick)
{
    return brick->storage == VOL_NO_STORAGE && !brick->octants;
}

/* How many numbers there are per voxel. */
static inline int vol_grid_planes(const VolGrid *grid) { return grid->is_rgb ? 3 : 1; }

/* What plane `plane` holds where there is this single value. */
static inline double vol_grid_in_plane(const VolGrid *grid, double value, int plane)
{
    float of_color[3];
    if (!grid->is_rgb)
        return value;
    memcpy(of_color, vol_cubes_item(&grid->colors, (size_t)value), sizeof of_color);
    return (double)of_color[plane];
}

/* vol_grid_node() where there is no table. */
const VolNode *vol_grid_hashed_node(const VolGrid *grid, int32_t x, int32_t y, int32_t z);

/* The node at node coordinates (x, y, z); NULL: it is as the root around it, or background. */
static inline const VolNode *vol_grid_node(const VolGrid *grid, int32_t x, int32_t y, int32_t z)
{
    if (!grid->table)
        return vol_grid_hashed_node(grid, x, y, z);
    const uint32_t *size = grid->table_size;
    uint32_t i = (uint32_t)x - (uint32_t)grid->table_min[0], j = (uint32_t)y - (uint32_t)grid->table_min[1],
             k = (uint32_t)z - (uint32_t)grid->table_min[2];
    if (i >= size[0] || j >= size[1] || k >= size[2])
        return NULL;
    uint32_t number = grid->table[((size_t)i * size[1] + j) * size[2] + k];
    return number ? &grid->nodes[number - 1] : NULL;
}

/* The root at root coordinates (index / 4096, rounded down); NULL: what no node covers there is background. */
static inline const VolRoot *vol_grid_root(const VolGrid *grid, int32_t x, int32_t y, int32_t z)
{
    return grid->roots.count ? vol_cubes_find(&grid->roots, (const int32_t[3]){x, y, z}) : NULL;
}

/* How large the block around the place of a node that is not there may be: aligned, of 2^n bricks a side, no node in it,
 * no root in it other than around it. */
int vol_grid_empty_around(const VolGrid *grid, const int32_t node_at[3]);

/* In which octant of its block of 2^log2 bricks a side a brick lies. */
static inline unsigned vol_octant_of(int32_t bx, int32_t by, int32_t bz, int log2)
{
    const int32_t last = (1 << log2) - 1;
    return (unsigned)((bx & last) == last) << 2 | (unsigned)((by & last) == last) << 1 | (unsigned)((bz & last) == last);
}

/* Brick number at brick coordinates (index / 8, rounded down); 0 for background. */
static inline uint32_t vol_grid_brick_number(const VolGrid *grid, int32_t bx, int32_t by, int32_t bz)
{
    const VolNode *node = vol_grid_node(grid, bx >> 4, by >> 4, bz >> 4);
    if (node && node->bricks)
        return node->bricks[((bx & 15) * 16 + (by & 15)) * 16 + (bz & 15)];
    if (node)
        return node->octants[vol_octant_of(bx, by, bz, VOL_NODE_LOG2)];
    const VolRoot *root = vol_grid_root(grid, bx >> VOL_ROOT_LOG2, by >> VOL_ROOT_LOG2, bz >> VOL_ROOT_LOG2);
    return root ? root->octants[vol_octant_of(bx, by, bz, VOL_ROOT_LOG2)] : 0;
}

/* Brick number that holds cell (i, j, k); 0 for background. */
static inline uint32_t vol_grid_brick_at(const VolGrid *grid, int32_t i, int32_t j, int32_t k)
{
    return vol_grid_brick_number(grid, i >> 3, j >> 3, k >> 3);
}

/* The value of one voxel, clamped into the box of a box domain; background outside a sparse one. */
double vol_grid_voxel(const VolGrid *grid, int32_t i, int32_t j, int32_t k);
void vol_grid_voxel_rgb(const VolGrid *grid, int32_t i, int32_t j, int32_t k, double rgb[3]);

/* The range of the finite values in the domain (of RGB: of all three); false: there are none. */
bool vol_grid_range(const VolGrid *grid, double *lo, double *hi);

/* Whether some cell of the domain has finite values at all its corners: all others are left empty. */
bool vol_grid_has_cell(const VolGrid *grid);

/* A bound of the change of the value along any straight line of this length, world units: see vol_volume_change(). */
double vol_grid_change(const VolGrid *grid, double length);

/* Central difference at a voxel, per index step along each axis: one-sided at the faces of a box and where a neighbour is
 * not finite, 0 along thin axes. */
void vol_grid_voxel_gradient(const VolGrid *grid, int32_t i, int32_t j, int32_t k, double gradient[3]);

#endif
