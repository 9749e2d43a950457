/* What the files of the VDB reader and writer share. */
#ifndef VOL_IO_VDB_PRIVATE_H
#define VOL_IO_VDB_PRIVATE_H

#include "adapters/vdb_adapter.h"
#include "base/little.h"
#include "io/vdb.h"

/* File format versions.  222 (2013) brought the node masks that everything since has; 224 the point grids of today; 225
 * differs only in allowing trees of half. */
enum { VDB_VERSION_MIN = 222, VDB_VERSION_POINTS = 224, VDB_VERSION_HALF = 225, VDB_VERSION_MAX = 225 };

enum { VDB_COMPRESS_ZIP = 1, VDB_COMPRESS_ACTIVE_MASK = 2, VDB_COMPRESS_BLOSC = 4 };

/* In a grid's unique name: what stands between its name and the number that tells duplicates apart. */
#define VDB_NAME_SEPARATOR '\x1e'

typedef struct VdbGrid {
    VolVdbEntry entry;   /* its strings are owned */
    char *file_type;     /* as in the descriptor, with "_HalfFloat" */
    uint32_t compression;
    size_t parent;       /* index of the grid that holds the tree; its own where it is no instance */
    size_t tree;         /* byte where the tree begins; 0 where a transform of unknown kind hides it */
    size_t buffers;      /* byte where the buffers begin; 0 in files without offsets until walked */
    bool gone;           /* after a last visit: its bytes may be */
} VdbGrid;

struct VolVdb {
    VolBytes bytes;
    char *name;
    uint32_t version;
    bool has_offsets;
    VolVdbMetaList meta;
    VdbGrid *grids;
    size_t count;
};

/* Adds without looking for one of that name. */
VolStatus vol_meta_append(VolVdbMetaList *list, const char *name, const char *type, const void *bytes, uint32_t size,
                          VolError *err);

/* False where the type has another size. */
bool vol_meta_size_fits(const char *type, uint32_t bytes);

/* What the kind of tree says about its bytes. */
typedef struct VdbTreeKind {
    VolVdbValue value;
    uint32_t components;
    uint32_t component_size; /* in memory, and in the file unless saved as half */
    bool real;               /* may be saved as half */
} VdbTreeKind;

/* NULL for types that are trees neither of numbers nor of points. */
const VdbTreeKind *vol_vdb_tree_kind(const char *type);
bool vol_vdb_is_numeric(const char *type);

/* How the values of a tree are kept. */
typedef struct VdbCodec {
    const VdbTreeKind *kind;
    uint32_t compression;
    bool half;          /* reals saved as half */
    size_t value_size;  /* of one value in memory, all components */
    size_t stored_size; /* in a block */
} VdbCodec;

/* How inactive values are stored with a node's values.  BACKGROUND: outside it, nothing else (0); inside it, negated (1). */
enum {
    VDB_BACKGROUND = 0,
    VDB_NEGATED_BACKGROUND = 1,
    VDB_ONE_INACTIVE_VALUE = 2,
    VDB_MASK_NO_VALUE = 3,
    VDB_MASK_ONE_VALUE = 4,
    VDB_MASK_TWO_VALUES = 5,
    VDB_ALL_VALUES = 6
};

enum { VDB_ROOT_CHILD_DIM = 4096, VDB_LEAF_MASK_BYTES = 64, VDB_LEAF_VALUES = 512 };
enum { VDB_UPPER_LOG2 = 5, VDB_LOWER_LOG2 = 4 }; /* entries per axis of the two inner levels */

typedef struct VdbLeaf {
    size_t mask;   /* byte of its mask in the topology */
    size_t values; /* byte behind its mask in the buffers */
    int32_t origin[3];
} VdbLeaf;

/* A tree whose every length is known to be right. */
typedef struct VdbTree {
    const unsigned char *data; /* of the file */
    size_t begin, buffers, end;
    VdbCodec codec;
    VdbLeaf *leaves; /* in the file's order; allocated */
    size_t leaf_count;
} VdbTree;

/* The mask once more, beside the values. */
static inline const unsigned char *vol_vdb_leaf_mask(const VdbTree *tree, const VdbLeaf *leaf)
{
    return tree->data + leaf->values - VDB_LEAF_MASK_BYTES;
}

uint32_t vol_vdb_count_bits(const unsigned char *mask, size_t bytes);

/* How many values the block behind a node's `form` holds. */
uint32_t vol_vdb_block_count(const VdbCodec *codec, unsigned form, const unsigned char *mask, uint32_t capacity);

/* Walks topology and buffers of a tree that ends at or before `limit`, checking every length against the bytes that are
 * there, all origins and masks.  Of points the topology only: the end is `limit`.  Messages begin with the byte. */
VolStatus vol_vdb_walk_tree(const VolVdb *vdb, const VdbGrid *grid, size_t limit, VdbTree *out, VolError *err);
void vol_vdb_tree_free(VdbTree *tree);

/* Unpacks the values of a node of `capacity` entries, of which `mask` tells the active ones; *at is the byte where they
 * begin, and receives where they end.  `background` is one value; `values` has room for all, `scratch` for twice as many.
 * bool and mask trees: a byte 0 or 1 per value. */
VolStatus vol_vdb_unpack_values(const VdbTree *tree, size_t *at, const unsigned char *mask, uint32_t capacity,
                                const void *background, void *values, void *scratch, VolError *err);
/* Likewise for a leaf. */
VolStatus vol_vdb_unpack_leaf(const VdbTree *tree, const VdbLeaf *leaf, const void *background, void *values,
                              void *scratch, VolError *err);

/* `count` unpacked values, all components, as numbers. */
void vol_vdb_to_floats(const VdbTreeKind *kind, const void *values, size_t count, float *out);
void vol_vdb_to_doubles(const VdbTreeKind *kind, const void *values, size_t count, double *out);

VolStatus vol_vdb_adapter(const VolVdbAdapter **adapter, VolError *err);

/* Says whose tree could not be read, and that it is damaged where it is: not for want of memory or of a library. */
VolStatus vol_vdb_tree_failed(const VolVdb *vdb, const char *grid, VolStatus status, VolError *err);

/* The tree of a grid (its parent's, for an instance) after a full check, as far as vol_vdb_walk_tree() goes. */
VolStatus vol_vdb_checked_tree(const VolVdb *vdb, size_t index, VdbTree *out, VolError *err);

/* A grid that is ready: its blob is compression, metadata, transform, tree. */
typedef struct VdbItem {
    char *name;
    char *unique; /* wanted by a passed grid until names are settled; NULL: any */
    char *type;   /* as in the descriptor */
    bool is_instance;
    size_t parent; /* where it is one */
    bool half_tree; /* needs file version 225 */
    VolBytes blob;
    size_t tree, buffers; /* bytes in the blob */
} VdbItem;

struct VolVdbWriter {
    VolVdbCompression compression;
    VolVdbMetaList meta;
    VdbItem *items;
    size_t count, capacity;
    VolVdbTree *tree; /* of the grid that is open, NULL if none is */
    VolVdbNewGrid grid;
    char *grid_name, *grid_class;
    bool dense;
    int32_t domain_min[3], domain_max[3];
};

/* A block being put together. */
typedef struct VdbOut {
    VolBytes bytes;
    size_t capacity;
    VolStatus status; /* of the first append that failed */
    VolError *err;
} VdbOut;

/* Appends; after a failure nothing more is done. */
void vol_vdb_out(VdbOut *out, const void *data, size_t size);
void vol_vdb_out_u32(VdbOut *out, uint32_t v);
void vol_vdb_out_u64(VdbOut *out, uint64_t v);
void vol_vdb_out_text(VdbOut *out, const char *text);
void vol_vdb_out_meta(VdbOut *out, const VolVdbMetaList *list);

VolStatus vol_vdb_new_item(VolVdbWriter *writer, const char *name, const char *type, VdbItem **out, VolError *err);
void vol_vdb_drop_item(VolVdbWriter *writer); /* the last one */
void vol_vdb_close_grid(VolVdbWriter *writer);

#endif
