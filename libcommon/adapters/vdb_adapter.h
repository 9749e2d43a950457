/* What the OpenVDB adapter (pellucid-vdb.so) offers: new trees, and the lengths of points.  Header, names, metadata,
 * transforms and the reading of trees are handled in C by io/vdb_*.c. */
#ifndef VOL_ADAPTERS_VDB_ADAPTER_H
#define VOL_ADAPTERS_VDB_ADAPTER_H

#include "io/vdb.h"

/* The bytes of one tree of points: topology, then buffers. */
typedef struct VolVdbTreeBytes {
    const unsigned char *data;
    size_t size;
    const char *type;     /* "Tree_float_5_4_3" */
    bool half;            /* reals saved as half */
    uint32_t version;     /* of the file format */
    uint32_t compression; /* the grid's flags: 1 zip, 2 active mask, 4 blosc */
} VolVdbTreeBytes;

typedef struct VolVdbEncodedTree {
    unsigned char *data;     /* allocated with malloc; topology, then buffers */
    size_t size;
    size_t buffers;          /* where the buffers begin */
    VolVdbGridInfo info;     /* background, counts and active box */
} VolVdbEncodedTree;

typedef struct VolVdbTree VolVdbTree; /* under construction */

/* `err` may not be NULL; messages tell the reason only, the caller adds file and grid. */
typedef struct VolVdbAdapter {
    const char *version; /* "OpenVDB 10.0.1" */

    /* How many of the bytes the tree takes, by reading it: for points, of which the C code walks the topology only. */
    VolStatus (*measure)(const VolVdbTreeBytes *tree, size_t *size, VolError *err);

    VolStatus (*tree_new)(VolVdbStore store, const double background[3], VolVdbTree **out, VolError *err);
    void (*tree_free)(VolVdbTree *tree);
    /* Values come either as floats or as doubles; the other pointer is NULL. */
    VolStatus (*tree_leaf)(VolVdbTree *tree, const int32_t origin[3], const float *floats, const double *doubles,
                           const uint64_t active[8], VolError *err);
    VolStatus (*tree_tile)(VolVdbTree *tree, const int32_t origin[3], int32_t size, const double value[3], bool active,
                           VolError *err);
    /* `most`: bytes that it may take; more are VOL_NOMEM. */
    VolStatus (*tree_encode)(const VolVdbTree *tree, uint32_t compression, size_t most, VolVdbEncodedTree *out,
                             VolError *err);
} VolVdbAdapter;

#endif
