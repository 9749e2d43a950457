/* Lists of typed metadata, as OpenVDB keeps them in files and grids. */
#include "io/vdb_private.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

const VolVdbMeta *vol_meta_find(const VolVdbMetaList *list, const char *name)
{
    for (size_t i = 0; i < list->count; i++)
        if (strcmp(list->items[i].name, name) == 0)
            return &list->items[i];
    return NULL;
}

static void free_item(VolVdbMeta *item)
{
    free(item->name);
    free(item->type);
    free(item->bytes);
}

/* Room for one more; the list grows by doubling, its capacity being the next power of two. */
static VolStatus grow(VolVdbMetaList *list, VolError *err)
{
    if (list->count & (list->count - 1) || list->count == 1)
        return VOL_OK;
    size_t capacity = list->count ? 2 * list->count : 2;
    VolVdbMeta *grown = vol_resize(list->items, capacity, sizeof *grown);
    if (!grown)
        return vol_fail_memory(err, capacity * sizeof *grown);
    list->items = grown;
    return VOL_OK;
}

static VolStatus make_item(VolVdbMeta *item, const char *name, const char *type, const void *bytes, uint32_t size,
                           VolError *err)
{
    *item = (VolVdbMeta){vol_copy_text(name), vol_copy_text(type), vol_alloc(size, 1), size};
    if (!item->name || !item->type || !item->bytes) {
        free_item(item);
        return vol_fail_memory(err, size);
    }
    if (size)
        memcpy(item->bytes, bytes, size);
    return VOL_OK;
}

VolStatus vol_meta_append(VolVdbMetaList *list, const char *name, const char *type, const void *bytes, uint32_t size,
                          VolError *err)
{
    VolVdbMeta item;
    VolStatus status = make_item(&item, name, type, bytes, size, err);
    if (status)
        return status;
    if ((status = grow(list, err)) != VOL_OK) {
        free_item(&item);
        return status;
    }
    list->items[list->count++] = item;
    return VOL_OK;
}

VolStatus vol_meta_set(VolVdbMetaList *list, const char *name, const char *type, const void *bytes, uint32_t size,
                       VolError *err)
{
    VolVdbMeta *old = (VolVdbMeta *)(uintptr_t)vol_meta_find(list, name);
    if (!old)
        return vol_meta_append(list, name, type, bytes, size, err);
    VolVdbMeta item;
    VolStatus status = make_item(&item, name, type, bytes, size, err);
    if (status)
        return status;
    free_item(old);
    *old = item;
    return VOL_OK;
}

VolStatus vol_meta_set_text(VolVdbMetaList *list, const char *name, const char *text, VolError *err)
{
    size_t size = strlen(text);
    if (size > INT32_MAX)
        return vol_fail(err, VOL_USAGE, "metadata '%s': %zu bytes of text are too long", name, size);
    return vol_meta_set(list, name, "string", text, (uint32_t)size, err);
}

VolStatus vol_meta_set_vec3i(VolVdbMetaList *list, const char *name, const int32_t v[3], VolError *err)
{
    return vol_meta_set(list, name, "vec3i", v, 3 * sizeof *v, err);
}

bool vol_meta_vec3i(const VolVdbMeta *meta, int32_t v[3])
{
    if (strcmp(meta->type, "vec3i") != 0 || meta->size != 3 * sizeof *v)
        return false;
    memcpy(v, meta->bytes, 3 * sizeof *v);
    return true;
}

void vol_meta_remove(VolVdbMetaList *list, const char *name)
{
    VolVdbMeta *item = (VolVdbMeta *)(uintptr_t)vol_meta_find(list, name);
    if (!item)
        return;
    free_item(item);
    size_t index = (size_t)(item - list->items);
    memmove(item, item + 1, (list->count - index - 1) * sizeof *item);
    list->count--;
}

VolStatus vol_meta_copy(VolVdbMetaList *to, const VolVdbMetaList *from, VolError *err)
{
    for (size_t i = 0; i < from->count; i++) {
        const VolVdbMeta *item = &from->items[i];
        VolStatus status = vol_meta_set(to, item->name, item->type, item->bytes, item->size, err);
        if (status)
            return status;
    }
    return VOL_OK;
}

void vol_meta_free(VolVdbMetaList *list)
{
    for (size_t i = 0; i < list->count; i++)
        free_item(&list->items[i]);
    free(list->items);
    *list = (VolVdbMetaList){0};
}

/* The fewest digits that read back as the same number. */
static void shortest(double value, bool single, char out[40])
{
    for (int digits = 1; digits <= 17; digits++) {
        snprintf(out, 40, "%.*g", digits, value);
        if (single ? strtof(out, NULL) == (float)value : strtod(out, NULL) == value)
            return;
    }
}

typedef enum NumberKind { NUMBER_INT32, NUMBER_INT64, NUMBER_FLOAT, NUMBER_DOUBLE } NumberKind;

static void print_number(NumberKind kind, const unsigned char *bytes, char out[40])
{
    int32_t i32;
    int64_t i64;
    float f;
    double d;
    switch (kind) {
    case NUMBER_INT32: memcpy(&i32, bytes, sizeof i32); snprintf(out, 40, "%" PRId32, i32); break;
    case NUMBER_INT64: memcpy(&i64, bytes, sizeof i64); snprintf(out, 40, "%" PRId64, i64); break;
    case NUMBER_FLOAT: memcpy(&f, bytes, sizeof f); shortest((double)f, true, out); break;
    case NUMBER_DOUBLE: memcpy(&d, bytes, sizeof d); shortest(d, false, out); break;
    }
}

/* A tuple of numbers: how many, of what.  False: another type. */
static bool numbers(const char *type, NumberKind *kind, uint32_t *count, uint32_t *size)
{
    static const struct {
        const char *type;
        NumberKind kind;
        uint32_t count;
    } types[] = {{"int32", NUMBER_INT32, 1},  {"int64", NUMBER_INT64, 1},  {"float", NUMBER_FLOAT, 1},
                 {"double", NUMBER_DOUBLE, 1}, {"vec2i", NUMBER_INT32, 2},  {"vec2s", NUMBER_FLOAT, 2},
                 {"vec2d", NUMBER_DOUBLE, 2},  {"vec3i", NUMBER_INT32, 3},  {"vec3s", NUMBER_FLOAT, 3},
                 {"vec3d", NUMBER_DOUBLE, 3},  {"vec4i", NUMBER_INT32, 4},  {"vec4s", NUMBER_FLOAT, 4},
                 {"vec4d", NUMBER_DOUBLE, 4},  {"mat4s", NUMBER_FLOAT, 16}, {"mat4d", NUMBER_DOUBLE, 16}};
    for (size_t i = 0; i < sizeof types / sizeof types[0]; i++)
        if (strcmp(types[i].type, type) == 0) {
            *kind = types[i].kind;
            *count = types[i].count;
            *size = *kind == NUMBER_INT64 || *kind == NUMBER_DOUBLE ? 8 : 4;
            return true;
        }
    return false;
}

bool vol_meta_size_fits(const char *type, uint32_t bytes)
{
    NumberKind kind;
    uint32_t count, size;
    if (strcmp(type, "bool") == 0)
        return bytes == 1;
    return !numbers(type, &kind, &count, &size) || bytes == count * size;
}

static char *text_of_numbers(const VolVdbMeta *meta, NumberKind kind, uint32_t count, uint32_t size)
{
    char all[16 * 42] = "", one[40];
    size_t used = 0;
    for (uint32_t i = 0; i < count; i++) {
        print_number(kind, meta->bytes + i * size, one);
        used += (size_t)snprintf(all + used, sizeof all - used, "%s%s", i ? " " : "", one);
    }
    return vol_copy_text(all);
}

/* The bytes of a string, with control characters other than line ends and tabs replaced. */
static char *text_of_string(const VolVdbMeta *meta)
{
    char *text = vol_alloc((size_t)meta->size + 1, 1);
    if (!text)
        return NULL;
    for (uint32_t i = 0; i < meta->size; i++) {
        unsigned char c = meta->bytes[i];
        text[i] = (char)(c == '\n' || c == '\t' || (c >= 0x20 && c != 0x7f) ? c : '?');
    }
    text[meta->size] = '\0';
    return text;
}

char *vol_meta_text(const VolVdbMeta *meta)
{
    NumberKind kind;
    uint32_t count, size;
    if (strcmp(meta->type, "string") == 0)
        return text_of_string(meta);
    if (strcmp(meta->type, "bool") == 0 && meta->size == 1)
        return vol_copy_text(meta->bytes[0] ? "true" : "false");
    if (numbers(meta->type, &kind, &count, &size) && meta->size == count * size)
        return text_of_numbers(meta, kind, count, size);
    return vol_format_text("(%s, %u bytes)", meta->type, meta->size);
}
