/* Writing VDB files: the blobs of new grids (vdb_encode.c) and of grids passed through are put together with their
 * names and offsets.  The layout is told in vdb_container.c. */
#include "io/vdb_private.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/hash.h"

enum { FILE_VERSION = 224, LIBRARY_MAJOR = 10, LIBRARY_MINOR = 0 };
enum { UUID_AT = 21, UUID_SIZE = 36, HEADER_SIZE = UUID_AT + UUID_SIZE };

/* ---- grids of other files ---- */

/* The item that holds the very tree that `tree` is. */
static bool find_tree(const VolVdbWriter *writer, const char *type, const unsigned char *tree, size_t size,
                      size_t *index)
{
    for (size_t i = 0; i < writer->count; i++) {
        const VdbItem *item = &writer->items[i];
        if (!item->is_instance && item->blob.size - item->tree == size && strcmp(item->type, type) == 0 &&
            memcmp(item->blob.data + item->tree, tree, size) == 0) {
            *index = i;
            return true;
        }
    }
    return false;
}

VolStatus vol_vdb_pass_grid(VolVdbWriter *writer, const VolVdb *from, size_t index, VolError *err)
{
    const VdbGrid *grid = &from->grids[index], *parent = &from->grids[grid->parent];
    const VolVdbEntry *entry = &grid->entry;
    bool is_instance = grid->parent != index;
    VdbTree checked = {0};
    VdbItem *item = NULL;
    VolStatus status = VOL_OK;
    if (vol_vdb_value(entry) == VOL_VALUE_POINTS && from->version < VDB_VERSION_POINTS)
        status = vol_fail(err, VOL_BAD_INPUT, "cannot carry grid '%s' of '%s': type %s of file version %u", entry->name,
                          from->name, entry->type, from->version);
    if (!status && vol_vdb_tree_kind(entry->type) && parent->tree)
        status = vol_vdb_checked_tree(from, index, &checked, err);
    vol_vdb_tree_free(&checked);
    if (!status && is_instance && (!parent->tree || !grid->tree))
        status = vol_fail(err, VOL_BAD_INPUT, "cannot carry grid '%s' of '%s': unknown kind of transform '%s'",
                          entry->name, from->name, parent->tree ? grid->entry.map : parent->entry.map);
    if (status)
        return status;

    const unsigned char *data = from->bytes.data;
    size_t tree_size = is_instance ? parent->entry.offset + parent->entry.size - parent->tree : 0, found = 0;
    bool shared = is_instance && find_tree(writer, grid->file_type, data + parent->tree, tree_size, &found);
    if ((status = vol_vdb_new_item(writer, entry->name, grid->file_type, &item, err)) != VOL_OK)
        return status;
    item->unique = vol_copy_text(entry->unique_name);
    if (!item->unique) {
        vol_vdb_drop_item(writer);
        return vol_fail_memory(err, strlen(entry->unique_name));
    }
    item->half_tree = strcmp(entry->type, "Tree_half_5_4_3") == 0;
    item->is_instance = shared;
    item->parent = found;

    VdbOut out = {.err = err};
    vol_vdb_out_u32(&out, parent->compression);
    vol_vdb_out(&out, data + entry->offset + 4, entry->size - 4);
    item->tree = grid->tree ? grid->tree - entry->offset : entry->size;
    item->buffers = is_instance || !grid->buffers ? entry->size : grid->buffers - entry->offset;
    if (is_instance && !shared) { /* its parent is not in this file: it gets the tree */
        vol_vdb_out(&out, data + parent->tree, tree_size);
        item->buffers = item->tree + (parent->buffers - parent->tree);
    }
    item->blob = out.bytes;
    if (out.status)
        vol_vdb_drop_item(writer);
    return out.status;
}

/* ---- the file ---- */

static bool taken(const VolVdbWriter *writer, size_t self, const char *unique)
{
    for (size_t i = 0; i < writer->count; i++)
        if (i != self && writer->items[i].unique && strcmp(writer->items[i].unique, unique) == 0)
            return true;
    return false;
}

static bool name_is_shared(const VolVdbWriter *writer, size_t self)
{
    for (size_t i = 0; i < writer->count; i++)
        if (i != self && strcmp(writer->items[i].name, writer->items[self].name) == 0)
            return true;
    return false;
}

/* Passed grids keep their unique names where they can; duplicates get the lowest number that is free. */
static VolStatus settle_names(VolVdbWriter *writer, VolError *err)
{
    for (size_t i = writer->count; i-- > 0;)
        if (writer->items[i].unique && taken(writer, i, writer->items[i].unique)) {
            free(writer->items[i].unique);
            writer->items[i].unique = NULL;
        }
    for (size_t i = 0; i < writer->count; i++) {
        VdbItem *item = &writer->items[i];
        bool plain = !item->unique && !name_is_shared(writer, i);
        for (unsigned n = 0; !item->unique; n++) {
            char *wanted = plain && n == 0 ? vol_copy_text(item->name)
                                 : vol_format_text("%s%c%u", item->name, VDB_NAME_SEPARATOR, n);
            if (!wanted)
                return vol_fail_memory(err, strlen(item->name));
            if (taken(writer, i, wanted))
                free(wanted);
            else
                item->unique = wanted;
        }
    }
    return VOL_OK;
}

static void put_header(VdbOut *out, const VolVdbWriter *writer)
{
    static const char no_uuid[UUID_SIZE];
    static const unsigned char has_offsets = 1;
    uint32_t version = FILE_VERSION;
    for (size_t i = 0; i < writer->count; i++)
        if (writer->items[i].half_tree)
            version = VDB_VERSION_HALF;
    vol_vdb_out_u64(out, 0x56444220);
    vol_vdb_out_u32(out, version);
    vol_vdb_out_u32(out, LIBRARY_MAJOR);
    vol_vdb_out_u32(out, LIBRARY_MINOR);
    vol_vdb_out(out, &has_offsets, 1);
    vol_vdb_out(out, no_uuid, sizeof no_uuid);
}

static void put_item(VdbOut *out, const VolVdbWriter *writer, const VdbItem *item)
{
    vol_vdb_out_text(out, item->unique);
    vol_vdb_out_text(out, item->type);
    vol_vdb_out_text(out, item->is_instance ? writer->items[item->parent].unique : "");
    size_t begin = out->bytes.size + 3 * 8;
    vol_vdb_out_u64(out, begin);
    vol_vdb_out_u64(out, item->is_instance ? 0 : begin + item->buffers);
    vol_vdb_out_u64(out, begin + item->blob.size);
    vol_vdb_out(out, item->blob.data, item->blob.size);
}

/* Room for the whole file at once, so that nothing is copied while it grows. */
static void reserve(VdbOut *out, const VolVdbWriter *writer)
{
    size_t size = 4096;
    for (size_t i = 0; i < writer->meta.count; i++)
        size += writer->meta.items[i].size + 256;
    for (size_t i = 0; i < writer->count; i++)
        size += writer->items[i].blob.size + 1024;
    out->bytes.data = vol_alloc(size, 1);
    if (out->bytes.data)
        out->capacity = size;
    else
        out->status = vol_fail_memory(out->err, size);
}

/* The UUID: the hash of the file with zeros in its place, in the usual groups of digits. */
static void stamp_uuid(VolBytes *bytes)
{
    VolHash hash;
    uint64_t digest[2];
    char hex[33], uuid[UUID_SIZE + 1];
    vol_hash_begin(&hash);
    vol_hash_add(&hash, bytes->data, bytes->size);
    vol_hash_end(&hash, digest);
    vol_hash_hex(digest, hex);
    snprintf(uuid, sizeof uuid, "%.8s-%.4s-%.4s-%.4s-%.12s", hex, hex + 8, hex + 12, hex + 16, hex + 20);
    memcpy(bytes->data + UUID_AT, uuid, UUID_SIZE);
}

VolStatus vol_vdb_finish(VolVdbWriter *writer, VolBytes *out_bytes, VolError *err)
{
    *out_bytes = (VolBytes){0};
    if (writer->tree)
        return vol_fail(err, VOL_USAGE, "cannot finish a VDB: grid '%s' is still open", writer->grid_name);
    if (writer->count == 0)
        return vol_fail(err, VOL_USAGE, "cannot finish a VDB: it has no grids");
    VolStatus status = settle_names(writer, err);
    if (status)
        return status;
    VdbOut out = {.err = err};
    reserve(&out, writer);
    put_header(&out, writer);
    vol_vdb_out_meta(&out, &writer->meta);
    vol_vdb_out_u32(&out, (uint32_t)writer->count);
    for (size_t i = 0; i < writer->count && !out.status; i++) {
        put_item(&out, writer, &writer->items[i]);
        vol_bytes_free(&writer->items[i].blob); /* the file holds it now */
    }
    while (writer->count)
        vol_vdb_drop_item(writer);
    if (out.status) {
        vol_bytes_free(&out.bytes);
        return out.status;
    }
    stamp_uuid(&out.bytes);
    *out_bytes = out.bytes;
    return VOL_OK;
}
