/* The container of a VDB file: everything but the trees.
 *
 *     int64 magic; uint32 file version, library major, minor; byte has-offsets; 36 characters of UUID;
 *     file metadata; int32 grids; per grid: descriptor, blob
 *     descriptor: unique name, type, name of the grid whose tree it shares; int64 blob, buffers, end (0 in streams)
 *     blob: uint32 compression; metadata; kind of transform, transform; tree (instances have none)
 *     metadata: uint32 count; per item: name, type, uint32 size, value
 *     text: uint32 length, bytes
 *
 * All little endian.  Streams (has-offsets 0) do not say where a grid ends: there the trees are walked to find out. */
#include "io/vdb_private.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { HEADER_BYTES = 8 + 3 * 4 + 1 + 36, MAP_DOUBLES_MAX = 18 };

/* A place in the file, for reading on; `grid` is for messages and may be NULL. */
typedef struct Cursor {
    const VolVdb *vdb;
    const char *grid;
    size_t at, end;
    VolError *err;
} Cursor;

__attribute__((format(printf, 3, 4))) static VolStatus damaged(const Cursor *cursor, size_t at, const char *format, ...)
{
    char why[400];
    va_list args;
    va_start(args, format);
    vsnprintf(why, sizeof why, format, args);
    va_end(args);
    if (cursor->grid)
        return vol_fail(cursor->err, VOL_BAD_INPUT, "damaged VDB '%s': byte %zu, grid '%s': %s", cursor->vdb->name, at,
                        cursor->grid, why);
    return vol_fail(cursor->err, VOL_BAD_INPUT, "damaged VDB '%s': byte %zu: %s", cursor->vdb->name, at, why);
}

static VolStatus take(Cursor *cursor, uint64_t size, const char *what, const unsigned char **out)
{
    size_t left = cursor->end - cursor->at;
    *out = cursor->vdb->bytes.data + cursor->at;
    if (size > left)
        return damaged(cursor, cursor->at, "%s takes %llu bytes, %zu are left", what, (unsigned long long)size, left);
    cursor->at += (size_t)size;
    return VOL_OK;
}

static VolStatus take_u32(Cursor *cursor, const char *what, uint32_t *out)
{
    const unsigned char *p;
    VolStatus status = take(cursor, 4, what, &p);
    if (!status)
        *out = vol_load_u32(p);
    return status;
}

static VolStatus take_u64(Cursor *cursor, const char *what, uint64_t *out)
{
    uint32_t low = 0, high = 0;
    VolStatus status = take_u32(cursor, what, &low);
    if (!status)
        status = take_u32(cursor, what, &high);
    *out = low | (uint64_t)high << 32;
    return status;
}

/* A name: no control characters, save the separator where a unique name has it. */
static VolStatus take_name(Cursor *cursor, const char *what, bool unique, char **out)
{
    uint32_t length = 0;
    const unsigned char *p = NULL;
    VolStatus status = take_u32(cursor, what, &length);
    size_t where = cursor->at;
    if (!status)
        status = take(cursor, length, what, &p);
    if (status)
        return status;
    for (uint32_t i = 0; i < length; i++)
        if ((p[i] < 0x20 && !(unique && p[i] == VDB_NAME_SEPARATOR)) || p[i] == 0x7f)
            return damaged(cursor, where + i, "control character %u in %s", p[i], what);
    char *text = vol_alloc((size_t)length + 1, 1);
    if (!text)
        return vol_fail_memory(cursor->err, length);
    memcpy(text, p, length);
    text[length] = '\0';
    *out = text;
    return VOL_OK;
}

static VolStatus take_meta_item(Cursor *cursor, VolVdbMetaList *list)
{
    char *name = NULL, *type = NULL;
    uint32_t size = 0;
    const unsigned char *value = NULL;
    size_t where = cursor->at;
    VolStatus status = take_name(cursor, "a metadata name", false, &name);
    if (!status)
        status = take_name(cursor, "a metadata type", false, &type);
    if (!status)
        status = take_u32(cursor, "a metadata size", &size);
    if (!status)
        status = take(cursor, size, "a metadata value", &value);
    if (!status && (!*name || !*type))
        status = damaged(cursor, where, "metadata without a name or type");
    if (!status && !vol_meta_size_fits(type, size))
        status = damaged(cursor, where, "metadata '%s' of type %s has %u bytes", name, type, size);
    if (!status)
        status = vol_meta_append(list, name, type, value, size, cursor->err);
    free(name);
    free(type);
    return status;
}

static VolStatus take_meta(Cursor *cursor, VolVdbMetaList *list)
{
    uint32_t count = 0;
    size_t where = cursor->at;
    VolStatus status = take_u32(cursor, "the number of metadata", &count);
    if (!status && count > (cursor->end - cursor->at) / 12)
        status = damaged(cursor, where, "%u metadata in %zu bytes", count, cursor->end - cursor->at);
    for (uint32_t i = 0; i < count && !status; i++)
        status = take_meta_item(cursor, list);
    return status;
}

/* ---- transforms ---- */

static VolStatus take_doubles(Cursor *cursor, int count, double *out)
{
    size_t where = cursor->at;
    for (int i = 0; i < count; i++) {
        uint64_t bits = 0;
        VolStatus status = take_u64(cursor, "the transform", &bits);
        if (status)
            return status;
        memcpy(&out[i], &bits, sizeof bits);
        if (!isfinite(out[i]))
            return damaged(cursor, where + 8 * (size_t)i, "the transform is not finite");
    }
    return VOL_OK;
}

static VolAffine scale_translate(const double scale[3], const double translate[3])
{
    VolAffine a = {{{0}}};
    for (int k = 0; k < 3; k++) {
        a.m[k][k] = scale[k];
        a.m[3][k] = translate[k];
    }
    return a;
}

static VolStatus take_matrix(Cursor *cursor, VolAffine *out)
{
    double m[16];
    size_t where = cursor->at;
    VolStatus status = take_doubles(cursor, 16, m);
    if (status)
        return status;
    if (m[3] != 0 || m[7] != 0 || m[11] != 0 || m[15] != 1)
        return damaged(cursor, where, "the transform's matrix is not affine");
    for (int i = 0; i < 4; i++)
        for (int j = 0; j < 3; j++)
            out->m[i][j] = m[4 * i + j];
    return VOL_OK;
}

static VolStatus take_map(Cursor *cursor, const char *map, bool *found, VolAffine *out)
{
    static const double none[3] = {0, 0, 0}, unit[3] = {1, 1, 1};
    double v[MAP_DOUBLES_MAX];
    VolStatus status;
    *found = true;
    if (strcmp(map, "AffineMap") == 0 || strcmp(map, "UnitaryMap") == 0)
        return take_matrix(cursor, out);
    if (strcmp(map, "ScaleMap") == 0 || strcmp(map, "UniformScaleMap") == 0) { /* and four vectors derived from it */
        if ((status = take_doubles(cursor, 15, v)) == VOL_OK)
            *out = scale_translate(v, none);
        return status;
    }
    if (strcmp(map, "ScaleTranslateMap") == 0 || strcmp(map, "UniformScaleTranslateMap") == 0) {
        if ((status = take_doubles(cursor, 18, v)) == VOL_OK)
            *out = scale_translate(v + 3, v);
        return status;
    }
    if (strcmp(map, "TranslationMap") == 0) {
        if ((status = take_doubles(cursor, 3, v)) == VOL_OK)
            *out = scale_translate(unit, v);
        return status;
    }
    *found = false;
    return VOL_OK;
}

/* A frustum: box, taper and depth, then an affine map. */
static VolStatus skip_frustum(Cursor *cursor)
{
    double v[8];
    char *map = NULL;
    VolAffine second;
    bool found = false;
    VolStatus status = take_doubles(cursor, 8, v);
    if (!status)
        status = take_name(cursor, "the kind of transform", false, &map);
    size_t where = cursor->at;
    if (!status)
        status = take_map(cursor, map, &found, &second);
    if (!status && !found)
        status = damaged(cursor, where, "the frustum's second transform is of kind '%s'", map);
    free(map);
    return status;
}

/* Leaves the cursor at the tree, or sets *known to false where the kind of transform is not known. */
static VolStatus take_transform(Cursor *cursor, VdbGrid *grid, bool *known)
{
    VolVdbEntry *entry = &grid->entry;
    char *map = NULL;
    VolStatus status = take_name(cursor, "the kind of transform", false, &map);
    entry->map = map;
    entry->map_offset = cursor->at;
    if (!status)
        status = take_map(cursor, map, &entry->transform_known, &entry->index_to_world);
    *known = entry->transform_known;
    if (!status && strcmp(map, "NonlinearFrustumMap") == 0) {
        *known = true;
        status = skip_frustum(cursor);
    }
    entry->map_size = *known && !status ? cursor->at - entry->map_offset : 0;
    return status;
}

/* ---- grids ---- */

/* Where the library writes the active box of an empty grid, it is this. */
static bool is_empty_box(const int32_t lo[3], const int32_t hi[3])
{
    for (int k = 0; k < 3; k++)
        if (lo[k] != INT32_MAX || hi[k] != INT32_MIN)
            return false;
    return true;
}

static bool is_empty_tree(const Cursor *cursor, const VdbTreeKind *kind, size_t tree)
{
    static const unsigned char nothing[8];
    size_t root = 4 + (size_t)kind->components * kind->component_size;
    return cursor->end - tree == root + 8 &&
           memcmp(cursor->vdb->bytes.data + tree + root, nothing, sizeof nothing) == 0;
}

/* The box in the metadata is never relied on, but one that contradicts itself or an empty tree is a sign of damage. */
static VolStatus check_box(const Cursor *cursor, const VdbGrid *grid, size_t where)
{
    const VolVdbMeta *min = vol_meta_find(&grid->entry.meta, "file_bbox_min");
    const VolVdbMeta *max = vol_meta_find(&grid->entry.meta, "file_bbox_max");
    const VdbTreeKind *kind = vol_vdb_tree_kind(grid->entry.type);
    int32_t lo[3], hi[3];
    if (!min || !max || !vol_meta_vec3i(min, lo) || !vol_meta_vec3i(max, hi) || is_empty_box(lo, hi))
        return VOL_OK;
    for (int k = 0; k < 3; k++)
        if (lo[k] > hi[k])
            return damaged(cursor, where, "its active box runs from %d to %d", lo[k], hi[k]);
    if (kind && grid->tree && !grid->entry.instance_of[0] && is_empty_tree(cursor, kind, grid->tree))
        return damaged(cursor, where, "its active box runs from %d,%d,%d to %d,%d,%d, but its tree is empty", lo[0], lo[1],
                       lo[2], hi[0], hi[1], hi[2]);
    for (int k = 0; k < 3; k++)
        if ((int64_t)hi[k] - lo[k] >= INT32_MAX)
            return vol_fail(cursor->err, VOL_BAD_INPUT,
                            "cannot read VDB '%s': grid '%s': its active box runs from %d to %d: %s", cursor->vdb->name,
                            cursor->grid, lo[k], hi[k], "voxels so far apart are not supported");
    return VOL_OK;
}

/* What stands before the tree: flags, metadata, transform.  The cursor's end is the blob's. */
static VolStatus take_blob_head(Cursor *cursor, VdbGrid *grid)
{
    bool known = false;
    size_t where = cursor->at;
    VolStatus status = take_u32(cursor, "the grid's compression", &grid->compression);
    if (!status && (grid->compression & ~(uint32_t)7))
        status = damaged(cursor, where, "unknown compression %u", grid->compression);
    if (!status)
        status = take_meta(cursor, &grid->entry.meta);
    if (!status)
        status = take_transform(cursor, grid, &known);
    if (status)
        return status;
    if (!known && !cursor->vdb->has_offsets)
        return damaged(cursor, cursor->at, "unknown kind of transform '%s'", grid->entry.map);
    grid->tree = known ? cursor->at : 0;
    return VOL_OK;
}

static VolStatus measure_points(Cursor *cursor, VdbGrid *grid)
{
    const VolVdbAdapter *adapter;
    VolStatus status = vol_vdb_adapter(&adapter, cursor->err);
    if (status)
        return status;
    VolVdbTreeBytes tree = {cursor->vdb->bytes.data + cursor->at, cursor->end - cursor->at, grid->entry.type,
                            grid->entry.half, cursor->vdb->version, grid->compression};
    size_t size = 0;
    VolError why = {""};
    if ((status = adapter->measure(&tree, &size, &why)) == VOL_BAD_INPUT)
        return damaged(cursor, cursor->at, "%s", why.text);
    if (status)
        return vol_fail(cursor->err, status, "%s", why.text);
    cursor->at += size;
    return VOL_OK;
}

/* In a stream the tree itself tells where it ends. */
static VolStatus measure_tree(Cursor *cursor, VdbGrid *grid)
{
    const VdbTreeKind *kind = vol_vdb_tree_kind(grid->entry.type);
    if (!kind)
        return damaged(cursor, cursor->at, "its type %s is unknown, and a stream does not say where it ends",
                       grid->entry.type);
    VdbTree tree;
    VolStatus status = vol_vdb_walk_tree(cursor->vdb, grid, cursor->end, &tree, cursor->err);
    if (status)
        return vol_vdb_tree_failed(cursor->vdb, cursor->grid, status, cursor->err);
    vol_vdb_tree_free(&tree);
    grid->buffers = tree.buffers;
    if (kind->value == VOL_VALUE_POINTS)
        return measure_points(cursor, grid);
    cursor->at = tree.end;
    return VOL_OK;
}

/* Instances have no buffers, and say 0 for where they begin. */
static VolStatus check_offsets(const Cursor *cursor, bool is_instance, uint64_t offsets[3])
{
    if (!cursor->vdb->has_offsets)
        return VOL_OK;
    if (is_instance && offsets[1] == 0)
        offsets[1] = offsets[2];
    if (offsets[0] < cursor->at || offsets[0] > offsets[1] || offsets[1] > offsets[2])
        return damaged(cursor, cursor->at - 24, "offsets %lld, %lld, %lld are out of order", (long long)offsets[0],
                       (long long)offsets[1], (long long)offsets[2]);
    if (offsets[2] > cursor->end)
        return damaged(cursor, cursor->at - 24, "the grid ends at byte %llu, the file at byte %zu",
                       (unsigned long long)offsets[2], cursor->end);
    return VOL_OK;
}

static VolStatus split_names(Cursor *cursor, VdbGrid *grid)
{
    static const char suffix[] = "_HalfFloat";
    char *name = vol_copy_text(grid->entry.unique_name), *type = vol_copy_text(grid->file_type);
    grid->entry.name = name;
    grid->entry.type = type;
    if (!name || !type)
        return vol_fail_memory(cursor->err, strlen(grid->entry.unique_name));
    char *separator = strchr(name, VDB_NAME_SEPARATOR);
    if (separator)
        *separator = '\0';
    size_t length = strlen(type), tail = sizeof suffix - 1;
    if (length > tail && strcmp(type + length - tail, suffix) == 0) {
        grid->entry.half = true;
        type[length - tail] = '\0';
    }
    return VOL_OK;
}

static VolStatus take_descriptor(Cursor *cursor, VdbGrid *grid, uint64_t offsets[3])
{
    char *unique_name = NULL, *instance_of = NULL;
    VolStatus status = take_name(cursor, "a grid's name", true, &unique_name);
    grid->entry.unique_name = unique_name;
    if (!status)
        status = take_name(cursor, "a grid's type", false, &grid->file_type);
    if (!status)
        status = take_name(cursor, "the name of a grid's parent", true, &instance_of);
    grid->entry.instance_of = instance_of;
    if (!status)
        status = split_names(cursor, grid);
    if (status)
        return status;
    cursor->grid = grid->entry.name;
    for (int k = 0; k < 3 && !status; k++)
        status = take_u64(cursor, "a grid's offset", &offsets[k]);
    return status ? status : check_offsets(cursor, grid->entry.instance_of[0] != '\0', offsets);
}

static VolStatus take_grid(Cursor *cursor, VdbGrid *grid)
{
    uint64_t offsets[3] = {0};
    VolStatus status = take_descriptor(cursor, grid, offsets);
    if (status)
        return status;
    Cursor blob = *cursor;
    if (cursor->vdb->has_offsets) {
        blob.at = (size_t)offsets[0];
        blob.end = (size_t)offsets[2];
    }
    size_t begin = blob.at;
    if ((status = take_blob_head(&blob, grid)) != VOL_OK)
        return status;
    bool instance = grid->entry.instance_of[0] != '\0';
    if (cursor->vdb->has_offsets) {
        grid->buffers = (size_t)offsets[1];
        if (grid->tree > grid->buffers)
            return damaged(&blob, grid->tree, "the tree begins behind its buffers at byte %zu", grid->buffers);
        if (instance && grid->tree && grid->tree != blob.end)
            return damaged(&blob, grid->tree, "an instance of '%s' holds a tree of its own", grid->entry.instance_of);
        blob.at = blob.end;
    } else if (!instance && (status = measure_tree(&blob, grid)) != VOL_OK) {
        return status;
    }
    grid->entry.offset = begin;
    grid->entry.size = blob.at - begin;
    cursor->at = blob.end = blob.at;
    return check_box(&blob, grid, begin);
}

static VolStatus find_parent(Cursor *cursor, size_t index)
{
    const VolVdb *vdb = cursor->vdb;
    VdbGrid *grid = &vdb->grids[index];
    grid->parent = index;
    if (!grid->entry.instance_of[0])
        return VOL_OK;
    cursor->grid = grid->entry.name;
    for (size_t i = 0; i < vdb->count; i++) {
        const VdbGrid *other = &vdb->grids[i];
        if (strcmp(other->entry.unique_name, grid->entry.instance_of) != 0 || other->entry.instance_of[0])
            continue;
        if (strcmp(other->file_type, grid->file_type) != 0)
            return damaged(cursor, grid->entry.offset, "it shares the tree of a grid of another type");
        grid->parent = i;
        return VOL_OK;
    }
    return damaged(cursor, grid->entry.offset, "it shares the tree of '%s', which is not there", grid->entry.instance_of);
}

/* ---- the file ---- */

static VolStatus take_header(Cursor *cursor, VolVdb *vdb)
{
    static const unsigned char magic[8] = {0x20, 0x42, 0x44, 0x56, 0, 0, 0, 0};
    const unsigned char *p;
    size_t known = cursor->end < sizeof magic ? cursor->end : sizeof magic;
    if (cursor->end == 0)
        return vol_fail(cursor->err, VOL_BAD_INPUT, "not a VDB '%s': it is empty", vdb->name);
    if (memcmp(vdb->bytes.data, magic, known) != 0)
        return vol_fail(cursor->err, VOL_BAD_INPUT, "not a VDB '%s': it does not begin with a VDB's magic number",
                        vdb->name);
    VolStatus status = take(cursor, HEADER_BYTES, "the header", &p);
    if (status)
        return status;
    vdb->version = (uint32_t)p[8] | (uint32_t)p[9] << 8 | (uint32_t)p[10] << 16 | (uint32_t)p[11] << 24;
    if (vdb->version < VDB_VERSION_MIN || vdb->version > VDB_VERSION_MAX)
        return damaged(cursor, 8, "file version %u, can read %d to %d", vdb->version, VDB_VERSION_MIN, VDB_VERSION_MAX);
    if (p[20] > 1)
        return damaged(cursor, 20, "the flag for offsets is %u", p[20]);
    vdb->has_offsets = p[20] == 1;
    for (size_t i = 21; i < HEADER_BYTES; i++)
        if (p[i] < 0x20 || p[i] > 0x7e)
            return damaged(cursor, i, "character %u in the file's identifier", p[i]);
    return VOL_OK;
}

static VolStatus take_grids(Cursor *cursor, VolVdb *vdb)
{
    uint32_t count = 0;
    size_t where = cursor->at;
    VolStatus status = take_u32(cursor, "the number of grids", &count);
    if (status)
        return status;
    if (count == 0) /* a file like any other, to whoever only looks at it */
        return cursor->at == cursor->end ? VOL_OK
                                         : damaged(cursor, where, "no grids, but %zu bytes", cursor->end - cursor->at);
    if (count > (cursor->end - cursor->at) / 36) /* the shortest descriptor */
        return damaged(cursor, where, "%u grids in %zu bytes", count, cursor->end - cursor->at);
    vdb->grids = vol_alloc_zero(count, sizeof *vdb->grids);
    if (!vdb->grids)
        return vol_fail_memory(cursor->err, count * sizeof *vdb->grids);
    while (vdb->count < count && !status) {
        cursor->grid = NULL;
        status = take_grid(cursor, &vdb->grids[vdb->count++]);
    }
    cursor->grid = NULL;
    if (!status && cursor->at != cursor->end)
        status = damaged(cursor, cursor->at, "%zu bytes behind the last grid", cursor->end - cursor->at);
    for (size_t i = 0; i < vdb->count && !status; i++)
        status = find_parent(cursor, i);
    return status;
}

VolStatus vol_vdb_open(VolBytes bytes, const char *name, VolVdb **out, VolError *err)
{
    *out = NULL;
    VolVdb *vdb = vol_alloc_zero(1, sizeof *vdb);
    if (!vdb) {
        vol_bytes_free(&bytes);
        return vol_fail_memory(err, sizeof *vdb);
    }
    vdb->bytes = bytes;
    vdb->name = vol_copy_text(name);
    Cursor cursor = {.vdb = vdb, .end = bytes.size, .err = err};
    VolStatus status = vdb->name ? take_header(&cursor, vdb) : vol_fail_memory(err, strlen(name));
    if (!status)
        status = take_meta(&cursor, &vdb->meta);
    if (!status)
        status = take_grids(&cursor, vdb);
    if (status) {
        vol_vdb_close(vdb);
        return status;
    }
    *out = vdb;
    return VOL_OK;
}

void vol_vdb_close(VolVdb *vdb)
{
    if (!vdb)
        return;
    for (size_t i = 0; i < vdb->count; i++) {
        VdbGrid *grid = &vdb->grids[i];
        free((void *)(uintptr_t)grid->entry.name);
        free((void *)(uintptr_t)grid->entry.unique_name);
        free((void *)(uintptr_t)grid->entry.type);
        free((void *)(uintptr_t)grid->entry.instance_of);
        free((void *)(uintptr_t)grid->entry.map);
        vol_meta_free(&grid->entry.meta);
        free(grid->file_type);
    }
    free(vdb->grids);
    vol_meta_free(&vdb->meta);
    vol_bytes_free(&vdb->bytes);
    free(vdb->name);
    free(vdb);
}
