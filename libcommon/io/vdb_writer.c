/* What is being written: bytes in the order of the file, items to come, the grid under way. */
#include "io/vdb_private.h"

#include <stdlib.h>
#include <string.h>

/* ---- bytes ---- */

void vol_vdb_out(VdbOut *out, const void *data, size_t size)
{
    if (!out->status)
        out->status = vol_bytes_append(&out->bytes, &out->capacity, data, size, out->err);
}

void vol_vdb_out_u32(VdbOut *out, uint32_t v)
{
    unsigned char b[4] = {(unsigned char)v, (unsigned char)(v >> 8), (unsigned char)(v >> 16), (unsigned char)(v >> 24)};
    vol_vdb_out(out, b, sizeof b);
}

void vol_vdb_out_u64(VdbOut *out, uint64_t v)
{
    vol_vdb_out_u32(out, (uint32_t)v);
    vol_vdb_out_u32(out, (uint32_t)(v >> 32));
}

void vol_vdb_out_text(VdbOut *out, const char *text)
{
    size_t size = strlen(text);
    vol_vdb_out_u32(out, (uint32_t)size);
    vol_vdb_out(out, text, size);
}

static int by_name(const void *a, const void *b)
{
    return strcmp(((const VolVdbMeta *)a)->name, ((const VolVdbMeta *)b)->name);
}

/* Sorted by name, as OpenVDB has it. */
void vol_vdb_out_meta(VdbOut *out, const VolVdbMetaList *list)
{
    VolVdbMeta *sorted = vol_alloc(list->count, sizeof *sorted);
    if (!sorted) {
        out->status = vol_fail_memory(out->err, list->count * sizeof *sorted);
        return;
    }
    if (list->count) {
        memcpy(sorted, list->items, list->count * sizeof *sorted);
        qsort(sorted, list->count, sizeof *sorted, by_name);
    }
    vol_vdb_out_u32(out, (uint32_t)list->count);
    for (size_t i = 0; i < list->count; i++) {
        vol_vdb_out_text(out, sorted[i].name);
        vol_vdb_out_text(out, sorted[i].type);
        vol_vdb_out_u32(out, sorted[i].size);
        vol_vdb_out(out, sorted[i].bytes, sorted[i].size);
    }
    free(sorted);
}

/* ---- the writer ---- */

VolStatus vol_vdb_writer_new(VolVdbCompression compression, VolVdbWriter **out, VolError *err)
{
    *out = vol_alloc_zero(1, sizeof **out);
    if (!*out)
        return vol_fail_memory(err, sizeof **out);
    (*out)->compression = compression;
    return VOL_OK;
}

static void free_item(VdbItem *item)
{
    free(item->name);
    free(item->unique);
    free(item->type);
    vol_bytes_free(&item->blob);
}

void vol_vdb_close_grid(VolVdbWriter *writer)
{
    const VolVdbAdapter *adapter;
    if (writer->tree && vol_vdb_adapter(&adapter, NULL) == VOL_OK)
        adapter->tree_free(writer->tree);
    writer->tree = NULL;
    vol_meta_free(&writer->grid.meta);
    free(writer->grid_name);
    free(writer->grid_class);
    writer->grid_name = writer->grid_class = NULL;
}

void vol_vdb_writer_free(VolVdbWriter *writer)
{
    if (!writer)
        return;
    vol_vdb_close_grid(writer);
    for (size_t i = 0; i < writer->count; i++)
        free_item(&writer->items[i]);
    free(writer->items);
    vol_meta_free(&writer->meta);
    free(writer);
}

VolVdbMetaList *vol_vdb_writer_file_meta(VolVdbWriter *writer) { return &writer->meta; }

VolStatus vol_vdb_new_item(VolVdbWriter *writer, const char *name, const char *type, VdbItem **out, VolError *err)
{
    if (writer->count == writer->capacity) {
        size_t capacity = writer->capacity ? 2 * writer->capacity : 8;
        VdbItem *grown = vol_resize(writer->items, capacity, sizeof *grown);
        if (!grown)
            return vol_fail_memory(err, capacity * sizeof *grown);
        writer->items = grown;
        writer->capacity = capacity;
    }
    VdbItem *item = &writer->items[writer->count];
    *item = (VdbItem){.name = vol_copy_text(name), .type = vol_copy_text(type)};
    if (!item->name || !item->type) {
        free_item(item);
        return vol_fail_memory(err, strlen(name) + strlen(type));
    }
    writer->count++;
    *out = item;
    return VOL_OK;
}

void vol_vdb_drop_item(VolVdbWriter *writer) { free_item(&writer->items[--writer->count]); }
