/* VDB files and streams.
 *
 * The container (header, file metadata, grid descriptors, one blob of bytes per grid) is read and written in C by
 * vdb_container.c: damage is found before OpenVDB sees a byte, grids that are not needed are never decoded, grids that
 * OpenVDB cannot decode pass through as bytes, and the UUID is a hash of the content.  Values
 * are unpacked here as well, over threads where asked; OpenVDB itself, an adapter loaded on first use, writes new trees. */
#ifndef VOL_IO_VDB_H
#define VOL_IO_VDB_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/log.h"
#include "base/mem.h"
#include "base/status.h"
#include "base/vec.h"

/* ---- Metadata: a list of typed values, kept in order; types are OpenVDB's names. ---- */

typedef struct VolVdbMeta {
    char *name;
    char *type;           /* "string", "int32", "int64", "float", "double", "bool", "vec3i", "vec3s", "vec3d", ... */
    unsigned char *bytes; /* as stored in the file, little endian, without the length word; strings without a NUL */
    uint32_t size;
} VolVdbMeta;

typedef struct VolVdbMetaList {
    VolVdbMeta *items;
    size_t count;
} VolVdbMetaList;

const VolVdbMeta *vol_meta_find(const VolVdbMetaList *list, const char *name);
VolStatus vol_meta_set(VolVdbMetaList *list, const char *name, const char *type, const void *bytes, uint32_t size,
                       VolError *err); /* replaces one of that name */
VolStatus vol_meta_set_text(VolVdbMetaList *list, const char *name, const char *text, VolError *err);
VolStatus vol_meta_set_vec3i(VolVdbMetaList *list, const char *name, const int32_t v[3], VolError *err);
char *vol_meta_text(const VolVdbMeta *meta); /* printable, allocated: numbers in shortest round-trip form; NULL: no memory */
bool vol_meta_vec3i(const VolVdbMeta *meta, int32_t v[3]); /* false: another type */
void vol_meta_remove(VolVdbMetaList *list, const char *name);
VolStatus vol_meta_copy(VolVdbMetaList *to, const VolVdbMetaList *from, VolError *err);
void vol_meta_free(VolVdbMetaList *list);

/* ---- Reading ---- */

typedef struct VolVdb VolVdb; /* an open container; owns its bytes */

/* What the container alone tells of a grid, without decoding its tree. */
typedef struct VolVdbEntry {
    const char *name;       /* without the suffix that tells duplicates apart */
    const char *unique_name;
    const char *type;       /* "Tree_float_5_4_3", "ptdataidx32_5_4_3", ... without "_HalfFloat" */
    bool half;              /* saved as half */
    const char *instance_of; /* unique name of the grid whose tree it shares, or "" */
    size_t offset, size;    /* its blob in the file */
    VolVdbMetaList meta;    /* the grid's own metadata (class, file_bbox_min .., vol:domain ..) */
    bool transform_known;   /* false: a map kind not affine (frustum) or one we do not know */
    VolAffine index_to_world;
    const char *map;        /* kind of transform, "AffineMap", "NonlinearFrustumMap", ... */
    size_t map_offset, map_size; /* its numbers in the file; size 0: of a kind we do not know, and the tree is hidden */
} VolVdbEntry;

/* `name` is for messages.  Takes the bytes over, also on failure.  VOL_BAD_INPUT names the byte or the grid where the
 * damage is; a file of 0 grids is damage. */
VolStatus vol_vdb_open(VolBytes bytes, const char *name, VolVdb **out, VolError *err);
void vol_vdb_close(VolVdb *vdb);
size_t vol_vdb_count(const VolVdb *vdb);
const VolVdbEntry *vol_vdb_entry(const VolVdb *vdb, size_t i);
const VolVdbMetaList *vol_vdb_file_meta(const VolVdb *vdb);

/* Index of the grid of that name, to the letter or as vol_vdb_label() has it; VOL_BAD_INPUT lists what is there (names and
 * types).  Among duplicates: the first.  `name` NULL: "density" if there (of several the first scalar one), else the only
 * scalar grid that does not lie beside one, else the list. */
VolStatus vol_vdb_find(const VolVdb *vdb, const char *name, size_t *index, VolError *err);

/* Whether a grid of that name lies beside a volume and is none itself: light.K..., light.total, level0.light.total, mask. */
bool vol_vdb_is_beside(const char *name);

/* What users call grid `index`: its name; NAME[1] for the second of that name in the file, and so on; '' for none. */
enum { VOL_VDB_LABEL = 300 };
void vol_vdb_label(const VolVdb *vdb, size_t index, char *out, size_t size);
size_t vol_vdb_namesakes(const VolVdb *vdb, size_t index); /* how many have its name, itself included */

typedef enum VolVdbValue {
    VOL_VALUE_FLOAT, VOL_VALUE_DOUBLE, VOL_VALUE_HALF, VOL_VALUE_INT32, VOL_VALUE_INT64, VOL_VALUE_BOOL, VOL_VALUE_MASK,
    VOL_VALUE_VEC3S, VOL_VALUE_VEC3D, VOL_VALUE_VEC3I, VOL_VALUE_POINTS, VOL_VALUE_OTHER
} VolVdbValue;

/* Of the entry's type name; HALF is a float tree saved as half (or a true half tree). */
VolVdbValue vol_vdb_value(const VolVdbEntry *entry);
int vol_vdb_components(VolVdbValue value); /* 1, 3, or 0 where not numeric */

/* A decoded grid.  Any numeric type arrives as doubles or floats, whichever the visitor asks for. */
typedef struct VolVdbGridInfo {
    VolVdbValue value;
    VolAffine index_to_world;
    double background[3];
    bool level_set;               /* class "level set": inactive voxels keep the sign of their value */
    bool empty;                   /* no active voxel */
    int32_t box_min[3], box_max[3]; /* active bounding box, voxels and tiles, inclusive */
    uint64_t active_voxels;       /* tiles counted by their voxels */
    uint64_t leaves, active_tiles;
} VolVdbGridInfo;

/* One callback per leaf and per tile (active or of a value other than the background).  A leaf is 8^3 values, z fastest
 * (index = (x*8 + y)*8 + z, OpenVDB's own order), interleaved components; bit n of `active` belongs to value n.
 * A tile is a cube of `size` voxels per axis (8, 128 or 4096).  Returning anything but VOL_OK ends the visit. */
typedef struct VolVdbVisitor {
    VolStatus (*begin)(void *user, const VolVdbGridInfo *info, VolError *err); /* before any other; may be NULL */
    VolStatus (*leaf_float)(void *user, const int32_t origin[3], const float *values, const uint64_t active[8],
                            VolError *err);
    VolStatus (*leaf_double)(void *user, const int32_t origin[3], const double *values, const uint64_t active[8],
                             VolError *err); /* used instead of leaf_float when not NULL */
    VolStatus (*tile)(void *user, const int32_t origin[3], int32_t size, const double value[3], bool active,
                      VolError *err);
    /* Where this is given, leaves come twice: in their order here, without values, among the tiles; then, when all has
     * been seen, with values through leaf_float or leaf_double, from `threads` threads at once and in any order. */
    VolStatus (*place)(void *user, const int32_t origin[3], VolError *err);
    int threads;
    bool last; /* no grid of this file will be visited again: its memory is given back as leaves are consumed */
} VolVdbVisitor;

/* Unpacks grid `index` and walks it in a fixed order (by origin, x first, within each node), one leaf at a time.  Types that
 * cannot be unpacked: VOL_BAD_INPUT with the type's name; so are grids whose transform hides the tree (map_size 0), but not
 * those of a transform that is merely not affine. */
VolStatus vol_vdb_visit(const VolVdb *vdb, size_t index, const VolVdbVisitor *visitor, void *user, VolError *err);

/* ---- Writing ---- */

typedef struct VolVdbWriter VolVdbWriter;

typedef enum VolVdbStore { VOL_STORE_FLOAT, VOL_STORE_HALF, VOL_STORE_DOUBLE, VOL_STORE_INT32, VOL_STORE_VEC3S } VolVdbStore;
typedef enum VolVdbCompression { VOL_COMPRESS_NONE, VOL_COMPRESS_ZIP, VOL_COMPRESS_BLOSC } VolVdbCompression;

VolStatus vol_vdb_writer_new(VolVdbCompression compression, VolVdbWriter **out, VolError *err); /* default: BLOSC */
void vol_vdb_writer_free(VolVdbWriter *writer);
VolVdbMetaList *vol_vdb_writer_file_meta(VolVdbWriter *writer);

typedef struct VolVdbNewGrid {
    const char *name;
    VolVdbStore store;
    VolAffine index_to_world;
    double background[3];
    const char *grid_class; /* "fog volume", "level set", "unknown"; NULL: that of `meta`, else "fog volume" */
    VolVdbMetaList meta;    /* added to the grid; not taken over */
} VolVdbNewGrid;

/* A grid is opened, filled leaf by leaf or from a dense array, and closed (which encodes it). */
VolStatus vol_vdb_begin_grid(VolVdbWriter *writer, const VolVdbNewGrid *grid, VolError *err);
/* Leaf of 8^3 values as in the visitor; inactive values are stored as given. */
VolStatus vol_vdb_put_leaf(VolVdbWriter *writer, const int32_t origin[3], const float *values, const uint64_t active[8],
                           VolError *err);
VolStatus vol_vdb_put_leaf_double(VolVdbWriter *writer, const int32_t origin[3], const double *values,
                                  const uint64_t active[8], VolError *err);
VolStatus vol_vdb_put_tile(VolVdbWriter *writer, const int32_t origin[3], int32_t size, const double value[3],
                           bool active, VolError *err);
/* A dense box, x fastest: every voxel active; writes vol:domain = "box", vol:domainMin and vol:domainMax.
 * Interleaved components (1 or 3 by store). */
VolStatus vol_vdb_put_dense(VolVdbWriter *writer, const int32_t origin[3], const int32_t dims[3], const float *values,
                            VolError *err);
VolStatus vol_vdb_put_dense_double(VolVdbWriter *writer, const int32_t origin[3], const int32_t dims[3],
                                   const double *values, VolError *err);
VolStatus vol_vdb_end_grid(VolVdbWriter *writer, VolError *err);

/* Passes a grid of an open file through unchanged (bytes where the file's version allows, else through OpenVDB). */
VolStatus vol_vdb_pass_grid(VolVdbWriter *writer, const VolVdb *from, size_t index, VolError *err);

/* The whole file; the writer is empty thereafter.  Same grids, same bytes: the UUID is a hash of everything else. */
VolStatus vol_vdb_finish(VolVdbWriter *writer, VolBytes *out, VolError *err);

/* "OpenVDB 10.0.1", or NULL where the adapter cannot be loaded. */
const char *vol_vdb_library_version(void);

#endif
