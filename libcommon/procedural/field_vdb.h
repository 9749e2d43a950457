/* A field sampled on a box of voxels, written leaf by leaf: what is held beside the writer's own grid is one layer
 * of leaves, not the volume. */
#ifndef VOL_PROCEDURAL_FIELD_VDB_H
#define VOL_PROCEDURAL_FIELD_VDB_H

#include "procedural/field.h"
#include "io/vdb.h"

typedef struct VolFieldBox {
    const char *grid;          /* "density" */
    int32_t dims[3];           /* voxels (0,0,0) to dims - 1 */
    VolAffine index_to_world;  /* the field is evaluated at the world places of the voxels */
    VolVdbStore store;         /* FLOAT, HALF or DOUBLE */
    bool sparse;               /* only leaves with a value farther than `threshold` from 0; no vol:domain */
    double threshold;
    VolVdbMetaList meta;       /* further metadata of the grid; not taken over */
    void (*progress)(void *user, double fraction); /* may be NULL */
    void *progress_user;
} VolFieldBox;

typedef struct VolFieldCounts {
    uint64_t leaves, skipped_leaves, non_finite;
    double largest; /* magnitude of a finite value; only for VOL_STORE_HALF */
} VolFieldCounts;

/* The transform that puts the outermost voxel centres of `dims` voxels on `lo` and `hi`.  An axis of one voxel has
 * it in the middle, as wide as the extent. */
VolAffine vol_field_extent(const int32_t dims[3], VolVec3 lo, VolVec3 hi);

/* Writes the grid into `writer` (begin to end).  The bytes do not depend on `threads`. */
VolStatus vol_field_write(const VolFieldCase *field, const VolFieldBox *box, int threads, VolVdbWriter *writer,
                          VolFieldCounts *counts, VolError *err);

#endif
