/* Grids of an open VDB: what they are, finding one, checking its tree. */
#include "io/vdb_private.h"

#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/plugin.h"

VolStatus vol_vdb_adapter(const VolVdbAdapter **adapter, VolError *err)
{
    const void *table = NULL;
    VolStatus status = vol_plugin("vdb", &table, err);
    *adapter = table;
    return status;
}

const char *vol_vdb_library_version(void)
{
    const VolVdbAdapter *adapter;
    return vol_vdb_adapter(&adapter, NULL) == VOL_OK ? adapter->version : NULL;
}

size_t vol_vdb_count(const VolVdb *vdb) { return vdb->count; }
const VolVdbEntry *vol_vdb_entry(const VolVdb *vdb, size_t i) { return &vdb->grids[i].entry; }
const VolVdbMetaList *vol_vdb_file_meta(const VolVdb *vdb) { return &vdb->meta; }

VolVdbValue vol_vdb_value(const VolVdbEntry *entry)
{
    const VdbTreeKind *kind = vol_vdb_tree_kind(entry->type);
    if (!kind)
        return strncmp(entry->type, "Tree_ptdataidx", 14) == 0 ? VOL_VALUE_POINTS : VOL_VALUE_OTHER;
    return kind->value == VOL_VALUE_FLOAT && entry->half ? VOL_VALUE_HALF : kind->value;
}

int vol_vdb_components(VolVdbValue value)
{
    switch (value) {
    case VOL_VALUE_VEC3S:
    case VOL_VALUE_VEC3D:
    case VOL_VALUE_VEC3I: return 3;
    case VOL_VALUE_POINTS:
    case VOL_VALUE_OTHER: return 0;
    default: return 1;
    }
}

/* How many of the grids before `end` have this name. */
static size_t count_named(const VolVdb *vdb, const char *name, size_t end)
{
    size_t count = 0;
    for (size_t i = 0; i < end; i++)
        count += strcmp(vdb->grids[i].entry.name, name) == 0;
    return count;
}

size_t vol_vdb_namesakes(const VolVdb *vdb, size_t index)
{
    return count_named(vdb, vdb->grids[index].entry.name, vdb->count);
}

void vol_vdb_label(const VolVdb *vdb, size_t index, char *out, size_t size)
{
    const char *name = vdb->grids[index].entry.name;
    size_t before = count_named(vdb, name, index);
    int used = snprintf(out, size, "%s", *name ? name : "''");
    if (before && used >= 0 && (size_t)used < size)
        snprintf(out + used, size - (size_t)used, "[%zu]", before);
}

/* "density (float), v (vec3s)": the type between "Tree_" and the tree's levels. */
static void list_grids(const VolVdb *vdb, char *out, size_t size)
{
    size_t used = 0;
    out[0] = '\0';
    for (size_t i = 0; i < vdb->count && used < size; i++) {
        const VolVdbEntry *entry = &vdb->grids[i].entry;
        const char *type = strncmp(entry->type, "Tree_", 5) == 0 ? entry->type + 5 : entry->type;
        int length = (int)strcspn(type, "_");
        char label[VOL_VDB_LABEL];
        if (vol_vdb_value(entry) == VOL_VALUE_OTHER)
            length = (int)strlen(type);
        vol_vdb_label(vdb, i, label, sizeof label);
        int n = snprintf(out + used, size - used, "%s%s (%.*s%s)", i ? ", " : "", label, length, type,
                         entry->half ? " as half" : "");
        used += n > 0 ? (size_t)n : 0;
    }
}

/* The n-th grid (from 0) whose name is the first `length` bytes of `name`. */
static bool find_nth(const VolVdb *vdb, const char *name, size_t length, size_t n, size_t *index)
{
    for (size_t i = 0; i < vdb->count; i++) {
        const char *own = vdb->grids[i].entry.name;
        if (strlen(own) == length && memcmp(own, name, length) == 0 && n-- == 0) {
            *index = i;
            return true;
        }
    }
    return false;
}

/* A grid by what users call it: its name to the letter, else as vol_vdb_label() has it. */
static bool find_named(const VolVdb *vdb, const char *name, size_t *index)
{
    size_t length = strlen(name), n = 0;
    if (find_nth(vdb, name, length, 0, index))
        return true;
    const char *bracket = strrchr(name, '[');
    size_t digits = bracket ? strspn(bracket + 1, "0123456789") : 0;
    if (digits && digits < 10 && strcmp(bracket + 1 + digits, "]") == 0) {
        n = strtoul(bracket + 1, NULL, 10);
        length = (size_t)(bracket - name);
    }
    if (length == 2 && memcmp(name, "''", 2) == 0)
        length = 0;
    return find_nth(vdb, name, length, n, index);
}

/* The first of scalars, or where none is the first. */
static bool find_density(const VolVdb *vdb, size_t *index)
{
    static const char name[] = "density";
    for (size_t n = 0; find_nth(vdb, name, strlen(name), n, index); n++)
        if (vol_vdb_components(vol_vdb_value(&vdb->grids[*index].entry)) == 1)
            return true;
    return find_nth(vdb, name, strlen(name), 0, index);
}

bool vol_vdb_is_beside(const char *name)
{
    static const char light[] = "light.", total[] = "light.total", coarse[] = "level0.light.total";
    bool numbered = strncmp(name, light, sizeof light - 1) == 0 && isdigit((unsigned char)name[sizeof light - 1]);
    return numbered || strcmp(name, total) == 0 || strcmp(name, coarse) == 0 || strcmp(name, "mask") == 0;
}

/* How many grids of scalars there are that may be a volume; *index: the last of them. */
static size_t count_scalars(const VolVdb *vdb, size_t *index)
{
    size_t scalars = 0;
    for (size_t i = 0; i < vdb->count; i++)
        if (vol_vdb_components(vol_vdb_value(&vdb->grids[i].entry)) == 1 && !vol_vdb_is_beside(vdb->grids[i].entry.name)) {
            *index = i;
            scalars++;
        }
    return scalars;
}

VolStatus vol_vdb_find(const VolVdb *vdb, const char *name, size_t *index, VolError *err)
{
    if (name ? find_named(vdb, name, index) : find_density(vdb, index) || count_scalars(vdb, index) == 1)
        return VOL_OK;
    char list[700];
    if (!vdb->count)
        return vol_fail(err, VOL_BAD_INPUT, "'%s' holds no grids", vdb->name);
    list_grids(vdb, list, sizeof list);
    if (name)
        return vol_fail(err, VOL_BAD_INPUT, "no grid '%s' in '%s': it holds %s", name, vdb->name, list);
    if (!count_scalars(vdb, index))
        return vol_fail(err, VOL_BAD_INPUT, "no grid of scalars in '%s': it holds %s", vdb->name, list);
    return vol_fail(err, VOL_BAD_INPUT, "cannot choose a grid of '%s': it holds %s; name one by --grid", vdb->name, list);
}

VolStatus vol_vdb_tree_failed(const VolVdb *vdb, const char *grid, VolStatus status, VolError *err)
{
    bool damaged = status == VOL_BAD_INPUT && !(err && strstr(err->text, " adapter '"));
    return vol_fail_within(err, status, "%s VDB '%s': grid '%s'", damaged ? "damaged" : "cannot read", vdb->name, grid);
}

VolStatus vol_vdb_checked_tree(const VolVdb *vdb, size_t index, VdbTree *out, VolError *err)
{
    const VdbGrid *grid = &vdb->grids[vdb->grids[index].parent];
    const VolVdbEntry *entry = &grid->entry;
    size_t end = entry->offset + entry->size;
    if (grid->gone)
        return vol_fail(err, VOL_BAD_INPUT, "cannot read grid '%s' of '%s' again after its last visit", entry->name,
                        vdb->name);
    VolStatus status = vol_vdb_walk_tree(vdb, grid, end, out, err);
    if (!status && (out->end != end || out->buffers != grid->buffers))
        status = vol_fail(err, VOL_BAD_INPUT, "byte %zu: the tree ends here, not at byte %zu as the file has it",
                          out->end != end ? out->end : out->buffers, out->end != end ? end : grid->buffers);
    if (!status)
        return VOL_OK;
    vol_vdb_tree_free(out);
    return vol_vdb_tree_failed(vdb, entry->name, status, err);
}
