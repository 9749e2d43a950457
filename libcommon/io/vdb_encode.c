/* New grids: values go into a tree of OpenVDB's, and when the grid is closed its metadata, transform and tree become the
 * blob that the file will hold. */
#include "io/vdb_private.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"

static uint32_t compression_flags(VolVdbCompression compression)
{
    switch (compression) {
    case VOL_COMPRESS_NONE: return VDB_COMPRESS_ACTIVE_MASK;
    case VOL_COMPRESS_ZIP: return VDB_COMPRESS_ACTIVE_MASK | VDB_COMPRESS_ZIP;
    case VOL_COMPRESS_BLOSC: break;
    }
    return VDB_COMPRESS_ACTIVE_MASK | VDB_COMPRESS_BLOSC;
}

static const char *compression_name(VolVdbCompression compression)
{
    switch (compression) {
    case VOL_COMPRESS_NONE: return "active values";
    case VOL_COMPRESS_ZIP: return "zip + active values";
    case VOL_COMPRESS_BLOSC: break;
    }
    return "blosc + active values";
}

static const char *store_type(VolVdbStore store)
{
    switch (store) {
    case VOL_STORE_FLOAT: break;
    case VOL_STORE_HALF: return "Tree_float_5_4_3_HalfFloat";
    case VOL_STORE_DOUBLE: return "Tree_double_5_4_3";
    case VOL_STORE_INT32: return "Tree_int32_5_4_3";
    case VOL_STORE_VEC3S: return "Tree_vec3s_5_4_3";
    }
    return "Tree_float_5_4_3";
}

/* ---- a new grid ---- */

static VolStatus check_new(const VolVdbWriter *writer, const VolVdbNewGrid *grid, VolError *err)
{
    VolAffine inverse;
    if (writer->tree)
        return vol_fail(err, VOL_USAGE, "cannot begin grid '%s': grid '%s' is still open", grid->name, writer->grid_name);
    for (const unsigned char *c = (const unsigned char *)grid->name; *c; c++)
        if (*c < 0x20 || *c == 0x7f)
            return vol_fail(err, VOL_USAGE, "cannot write grid '%s': control character %u in its name", grid->name, *c);
    if (!vol_affine_invert(&grid->index_to_world, &inverse))
        return vol_fail(err, VOL_BAD_INPUT, "cannot write grid '%s': its transform is singular or not finite", grid->name);
    return VOL_OK;
}

static VolStatus within_grid(const VolVdbWriter *writer, VolStatus status, const VolError *why, VolError *err)
{
    if (!status)
        return VOL_OK;
    return vol_fail(err, status, "cannot write grid '%s': %s", writer->grid_name, why->text);
}

VolStatus vol_vdb_begin_grid(VolVdbWriter *writer, const VolVdbNewGrid *grid, VolError *err)
{
    const VolVdbAdapter *adapter;
    VolError why = {""};
    VolStatus status = check_new(writer, grid, err);
    if (!status)
        status = vol_vdb_adapter(&adapter, err);
    if (status)
        return status;
    writer->grid = *grid;
    writer->grid.meta = (VolVdbMetaList){0};
    writer->dense = false;
    writer->grid_name = vol_copy_text(grid->name);
    const VolVdbMeta *class_meta = vol_meta_find(&grid->meta, "class");
    if (grid->grid_class || !class_meta)
        writer->grid_class = vol_copy_text(grid->grid_class ? grid->grid_class : "fog volume");
    if (!writer->grid_name || (!writer->grid_class && !class_meta))
        status = vol_fail_memory(err, strlen(grid->name));
    if (!status)
        status = vol_meta_copy(&writer->grid.meta, &grid->meta, err);
    if (!status)
        status = within_grid(writer, adapter->tree_new(grid->store, grid->background, &writer->tree, &why), &why, err);
    if (status)
        vol_vdb_close_grid(writer);
    return status;
}

static VolStatus check_cube(const VolVdbWriter *writer, const int32_t origin[3], int32_t size, VolError *err)
{
    if (!writer->tree)
        return vol_fail(err, VOL_USAGE, "cannot write values: no grid is open");
    if ((size != 8 && size != 128 && size != 4096) || origin[0] % size || origin[1] % size || origin[2] % size)
        return vol_fail(err, VOL_USAGE, "cannot write grid '%s': no cube of %d voxels lies at %d,%d,%d", writer->grid_name,
                        size, origin[0], origin[1], origin[2]);
    return VOL_OK;
}

static VolStatus put_any_leaf(VolVdbWriter *writer, const int32_t origin[3], const float *floats, const double *doubles,
                              const uint64_t active[8], VolError *err)
{
    const VolVdbAdapter *adapter;
    VolError why = {""};
    VolStatus status = check_cube(writer, origin, 8, err);
    if (!status)
        status = vol_vdb_adapter(&adapter, err);
    if (status)
        return status;
    status = adapter->tree_leaf(writer->tree, origin, floats, doubles, active, &why);
    return within_grid(writer, status, &why, err);
}

VolStatus vol_vdb_put_leaf(VolVdbWriter *writer, const int32_t origin[3], const float *values, const uint64_t active[8],
                           VolError *err)
{
    return put_any_leaf(writer, origin, values, NULL, active, err);
}

VolStatus vol_vdb_put_leaf_double(VolVdbWriter *writer, const int32_t origin[3], const double *values,
                                  const uint64_t active[8], VolError *err)
{
    return put_any_leaf(writer, origin, NULL, values, active, err);
}

VolStatus vol_vdb_put_tile(VolVdbWriter *writer, const int32_t origin[3], int32_t size, const double value[3],
                           bool active, VolError *err)
{
    const VolVdbAdapter *adapter;
    VolError why = {""};
    VolStatus status = check_cube(writer, origin, size, err);
    if (!status)
        status = vol_vdb_adapter(&adapter, err);
    if (status)
        return status;
    return within_grid(writer, adapter->tree_tile(writer->tree, origin, size, value, active, &why), &why, err);
}

/* ---- dense boxes ---- */

/* A dense array, x fastest, of `voxel` bytes per voxel. */
typedef struct Dense {
    const int32_t *origin, *dims;
    const unsigned char *values;
    size_t voxel;
    bool doubles;
    const unsigned char *background; /* one voxel */
} Dense;

static int64_t floor8(int64_t v) { return v & ~(int64_t)7; }

/* Copies what of the leaf at `at` lies in the box; the rest is background, and inactive.  Counts the active ones. */
static int fill_leaf(const Dense *dense, const int64_t at[3], unsigned char *leaf, uint64_t active[8])
{
    int count = 0;
    for (int x = 0; x < 8; x++) {
        active[x] = 0;
        for (int yz = 0; yz < 64; yz++) {
            int64_t i = at[0] + x - dense->origin[0], j = at[1] + yz / 8 - dense->origin[1],
                    k = at[2] + yz % 8 - dense->origin[2];
            bool inside = i >= 0 && i < dense->dims[0] && j >= 0 && j < dense->dims[1] && k >= 0 && k < dense->dims[2];
            size_t from = inside ? ((size_t)k * (size_t)dense->dims[1] + (size_t)j) * (size_t)dense->dims[0] + (size_t)i : 0;
            memcpy(leaf + (size_t)(64 * x + yz) * dense->voxel,
                   inside ? dense->values + from * dense->voxel : dense->background, dense->voxel);
            active[x] |= (uint64_t)inside << yz;
            count += inside;
        }
    }
    return count;
}

static VolStatus put_dense_leaf(VolVdbWriter *writer, const Dense *dense, const int64_t at[3], VolError *err)
{
    double values[512 * 3], tile[3] = {0};
    uint64_t active[8];
    int32_t origin[3] = {(int32_t)at[0], (int32_t)at[1], (int32_t)at[2]};
    unsigned char *leaf = (unsigned char *)values;
    int count = fill_leaf(dense, at, leaf, active);
    /* A constant leaf becomes a tile; the comparison is of bytes, so that it comes back as it was. */
    if (count == 512 && memcmp(leaf, leaf + dense->voxel, 511 * dense->voxel) == 0) {
        size_t components = dense->voxel / (dense->doubles ? sizeof(double) : sizeof(float));
        for (size_t c = 0; c < components; c++) {
            float single;
            memcpy(&single, leaf + c * sizeof single, sizeof single);
            tile[c] = dense->doubles ? values[c] : (double)single;
        }
        return vol_vdb_put_tile(writer, origin, 8, tile, true, err);
    }
    float floats[512 * 3];
    if (!dense->doubles)
        memcpy(floats, leaf, 512 * dense->voxel);
    return put_any_leaf(writer, origin, dense->doubles ? NULL : floats, dense->doubles ? values : NULL, active, err);
}

/* The box in the metadata: of all dense arrays that were put. */
static void extend_domain(VolVdbWriter *writer, const Dense *dense)
{
    for (int k = 0; k < 3; k++) {
        int32_t lo = dense->origin[k], hi = lo + (dense->dims[k] - 1);
        writer->domain_min[k] = writer->dense && writer->domain_min[k] < lo ? writer->domain_min[k] : lo;
        writer->domain_max[k] = writer->dense && writer->domain_max[k] > hi ? writer->domain_max[k] : hi;
    }
    writer->dense = true;
}

static VolStatus put_dense(VolVdbWriter *writer, const Dense *dense, VolError *err)
{
    if (!writer->tree)
        return vol_fail(err, VOL_USAGE, "cannot write values: no grid is open");
    int64_t lo[3], hi[3];
    for (int k = 0; k < 3; k++) {
        lo[k] = dense->origin[k];
        hi[k] = lo[k] + dense->dims[k] - 1;
        if (dense->dims[k] <= 0 || hi[k] > INT32_MAX)
            return vol_fail(err, VOL_BAD_INPUT, "cannot write grid '%s': box of %d x %d x %d voxels at %d,%d,%d",
                            writer->grid_name, dense->dims[0], dense->dims[1], dense->dims[2], dense->origin[0],
                            dense->origin[1], dense->origin[2]);
    }
    VolStatus status = VOL_OK;
    int64_t at[3];
    for (at[0] = floor8(lo[0]); at[0] <= hi[0] && !status; at[0] += 8)
        for (at[1] = floor8(lo[1]); at[1] <= hi[1] && !status; at[1] += 8)
            for (at[2] = floor8(lo[2]); at[2] <= hi[2] && !status; at[2] += 8)
                status = put_dense_leaf(writer, dense, at, err);
    if (!status)
        extend_domain(writer, dense);
    return status;
}

VolStatus vol_vdb_put_dense(VolVdbWriter *writer, const int32_t origin[3], const int32_t dims[3], const float *values,
                            VolError *err)
{
    size_t components = writer->grid.store == VOL_STORE_VEC3S ? 3 : 1;
    float background[3];
    for (int c = 0; c < 3; c++)
        background[c] = (float)writer->grid.background[c];
    Dense dense = {origin, dims, (const unsigned char *)values, components * sizeof(float), false,
                   (const unsigned char *)background};
    return put_dense(writer, &dense, err);
}

VolStatus vol_vdb_put_dense_double(VolVdbWriter *writer, const int32_t origin[3], const int32_t dims[3],
                                   const double *values, VolError *err)
{
    size_t components = writer->grid.store == VOL_STORE_VEC3S ? 3 : 1;
    Dense dense = {origin, dims, (const unsigned char *)values, components * sizeof(double), true,
                   (const unsigned char *)writer->grid.background};
    return put_dense(writer, &dense, err);
}

/* ---- transforms ---- */

static void put_double(VdbOut *out, double v)
{
    uint64_t bits;
    memcpy(&bits, &v, sizeof bits);
    vol_vdb_out_u64(out, bits);
}

static void put_matrix(VdbOut *out, const VolAffine *a)
{
    vol_vdb_out_text(out, "AffineMap");
    for (int i = 0; i < 4; i++) {
        for (int j = 0; j < 3; j++)
            put_double(out, a->m[i][j]);
        put_double(out, i == 3 ? 1 : 0);
    }
}

/* Scales are followed by what OpenVDB derives from them. */
static void put_scale(VdbOut *out, const VolAffine *a)
{
    double s[3] = {a->m[0][0], a->m[1][1], a->m[2][2]};
    bool uniform = s[0] == s[1] && s[1] == s[2] && s[0] > 0;
    bool moved = a->m[3][0] != 0 || a->m[3][1] != 0 || a->m[3][2] != 0;
    char kind[32];
    snprintf(kind, sizeof kind, "%sScale%sMap", uniform ? "Uniform" : "", moved ? "Translate" : "");
    vol_vdb_out_text(out, kind);
    for (int k = 0; k < 3 && moved; k++)
        put_double(out, a->m[3][k]);
    for (int k = 0; k < 3; k++)
        put_double(out, s[k]);
    for (int k = 0; k < 3; k++)
        put_double(out, fabs(s[k]));
    for (int k = 0; k < 3; k++)
        put_double(out, 1 / s[k]);
    for (int k = 0; k < 3; k++)
        put_double(out, 1 / s[k] * (1 / s[k]));
    for (int k = 0; k < 3; k++)
        put_double(out, 1 / s[k] / 2);
}

static void put_transform(VdbOut *out, const VolAffine *a)
{
    bool diagonal = true;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            diagonal = diagonal && (i == j || a->m[i][j] == 0);
    if (diagonal)
        put_scale(out, a);
    else
        put_matrix(out, a);
}

/* ---- closing a grid ---- */

/* The metadata that every writer of VDB leaves; the box of an empty grid is OpenVDB's. */
static VolStatus add_standard_meta(VolVdbWriter *writer, const VolVdbGridInfo *info, VolError *err)
{
    static const int32_t none_min[3] = {INT32_MAX, INT32_MAX, INT32_MAX}, none_max[3] = {INT32_MIN, INT32_MIN, INT32_MIN};
    static const unsigned char yes = 1;
    VolVdbMetaList *meta = &writer->grid.meta;
    vol_meta_remove(meta, "file_delayed_load"); /* offsets into a file that is not this one */
    vol_meta_remove(meta, "file_mem_bytes");
    vol_meta_remove(meta, "is_saved_as_half_float");
    VolStatus status = vol_meta_set_text(meta, "name", writer->grid_name, err);
    if (!status && writer->grid_class)
        status = vol_meta_set_text(meta, "class", writer->grid_class, err);
    if (!status && writer->grid.store == VOL_STORE_HALF)
        status = vol_meta_set(meta, "is_saved_as_half_float", "bool", &yes, 1, err);
    if (!status)
        status = vol_meta_set_text(meta, "file_compression", compression_name(writer->compression), err);
    if (!status)
        status = vol_meta_set_vec3i(meta, "file_bbox_min", info->empty ? none_min : info->box_min, err);
    if (!status)
        status = vol_meta_set_vec3i(meta, "file_bbox_max", info->empty ? none_max : info->box_max, err);
    int64_t voxels = (int64_t)info->active_voxels;
    if (!status)
        status = vol_meta_set(meta, "file_voxel_count", "int64", &voxels, sizeof voxels, err);
    if (!status && writer->dense) {
        status = vol_meta_set_text(meta, "vol:domain", "box", err);
        if (!status)
            status = vol_meta_set_vec3i(meta, "vol:domainMin", writer->domain_min, err);
        if (!status)
            status = vol_meta_set_vec3i(meta, "vol:domainMax", writer->domain_max, err);
    }
    return status;
}

/* Once encoded it is copied behind its header. */
static size_t room_for_tree(void)
{
    double half = vol_memory_available() / 2;
    return half < (double)SIZE_MAX / 2 ? (size_t)half : SIZE_MAX / 2;
}

VolStatus vol_vdb_end_grid(VolVdbWriter *writer, VolError *err)
{
    if (!writer->tree)
        return vol_fail(err, VOL_USAGE, "cannot end a grid: none is open");
    const VolVdbAdapter *adapter;
    VolVdbEncodedTree tree = {0};
    VolError why = {""};
    VdbItem *item = NULL;
    uint32_t flags = compression_flags(writer->compression);
    VolStatus status = vol_vdb_adapter(&adapter, err);
    if (!status)
        status = within_grid(writer, adapter->tree_encode(writer->tree, flags, room_for_tree(), &tree, &why), &why, err);
    if (!status)
        status = add_standard_meta(writer, &tree.info, err);
    if (!status)
        status = vol_vdb_new_item(writer, writer->grid_name, store_type(writer->grid.store), &item, err);
    if (!status) {
        VdbOut out = {.err = err};
        vol_vdb_out_u32(&out, flags);
        vol_vdb_out_meta(&out, &writer->grid.meta);
        put_transform(&out, &writer->grid.index_to_world);
        item->tree = out.bytes.size;
        item->buffers = item->tree + tree.buffers;
        vol_vdb_out(&out, tree.data, tree.size);
        item->blob = out.bytes;
        if ((status = out.status) != VOL_OK)
            vol_vdb_drop_item(writer);
    }
    free(tree.data);
    vol_vdb_close_grid(writer);
    return status;
}
