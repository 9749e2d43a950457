/* Grids of an open VDB: finding one, and visiting its tree through the OpenVDB adapter. */
#include "io/vdb_private.h"

#include <stdio.h>
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

/* "density (float), v (vec3s)": the type between "Tree_" and the tree's levels. */
static void list_grids(const VolVdb *vdb, char *out, size_t size)
{
    size_t used = 0;
    out[0] = '\0';
    for (size_t i = 0; i < vdb->count && used < size; i++) {
        const VolVdbEntry *entry = &vdb->grids[i].entry;
        const char *type = strncmp(entry->type, "Tree_", 5) == 0 ? entry->type + 5 : entry->type;
        int length = (int)strcspn(type, "_");
        if (vol_vdb_value(entry) == VOL_VALUE_OTHER)
            length = (int)strlen(type);
        int n = snprintf(out + used, size - used, "%s%s (%.*s%s)", i ? ", " : "", entry->name, length, type,
                         entry->half ? " as half" : "");
        used += n > 0 ? (size_t)n : 0;
    }
}

VolStatus vol_vdb_find(const VolVdb *vdb, const char *name, size_t *index, VolError *err)
{
    const char *wanted = name ? name : "density";
    size_t scalars = 0;
    for (size_t i = 0; i < vdb->count; i++)
        if (strcmp(vdb->grids[i].entry.name, wanted) == 0) {
            *index = i;
            return VOL_OK;
        }
    for (size_t i = vdb->count; !name && i-- > 0;)
        if (vol_vdb_components(vol_vdb_value(&vdb->grids[i].entry)) == 1) {
            *index = i;
            scalars++;
        }
    if (scalars == 1)
        return VOL_OK;
    char list[700];
    list_grids(vdb, list, sizeof list);
    if (name)
        return vol_fail(err, VOL_BAD_INPUT, "no grid '%s' in '%s': it holds %s", name, vdb->name, list);
    return vol_fail(err, VOL_BAD_INPUT, "cannot choose a grid of '%s': it holds %s", vdb->name, list);
}

VolStatus vol_vdb_checked_tree(const VolVdb *vdb, size_t index, VolVdbTreeBytes *out, VolError *err)
{
    const VdbGrid *grid = &vdb->grids[vdb->grids[index].parent];
    const VolVdbEntry *entry = &grid->entry;
    size_t end = entry->offset + entry->size, buffers = 0, walked = end;
    VolStatus status = vol_vdb_walk_tree(vdb, grid, end, &buffers, &walked, err);
    if (!status && (walked != end || buffers != grid->buffers))
        status = vol_fail(err, VOL_BAD_INPUT, "byte %zu: the tree ends here, not at byte %zu as the file has it",
                          walked != end ? walked : buffers, walked != end ? end : grid->buffers);
    if (status)
        return vol_fail_within(err, status, "damaged VDB '%s': grid '%s'", vdb->name, entry->name);
    *out = (VolVdbTreeBytes){vdb->bytes.data + grid->tree, end - grid->tree, entry->type, entry->half, vdb->version,
                             grid->compression};
    return VOL_OK;
}

/* Tells apart a visitor's own failure, whose message stands as it is, from one of decoding. */
typedef struct Relay {
    const VolVdbVisitor *visitor;
    void *user;
    bool failed;
} Relay;

static VolStatus relay_status(Relay *relay, VolStatus status)
{
    relay->failed = relay->failed || status != VOL_OK;
    return status;
}

static VolStatus relay_begin(void *user, const VolVdbGridInfo *info, VolError *err)
{
    Relay *relay = user;
    return relay_status(relay, relay->visitor->begin(relay->user, info, err));
}

static VolStatus relay_float(void *user, const int32_t origin[3], const float *values, const uint64_t active[8],
                             VolError *err)
{
    Relay *relay = user;
    return relay_status(relay, relay->visitor->leaf_float(relay->user, origin, values, active, err));
}

static VolStatus relay_double(void *user, const int32_t origin[3], const double *values, const uint64_t active[8],
                              VolError *err)
{
    Relay *relay = user;
    return relay_status(relay, relay->visitor->leaf_double(relay->user, origin, values, active, err));
}

static VolStatus relay_tile(void *user, const int32_t origin[3], int32_t size, const double value[3], bool active,
                            VolError *err)
{
    Relay *relay = user;
    return relay_status(relay, relay->visitor->tile(relay->user, origin, size, value, active, err));
}

static bool is_level_set(const VolVdbEntry *entry)
{
    const VolVdbMeta *meta = vol_meta_find(&entry->meta, "class");
    return meta && strcmp(meta->type, "string") == 0 && meta->size == 9 && memcmp(meta->bytes, "level set", 9) == 0;
}

static VolStatus can_visit(const VolVdb *vdb, const VdbGrid *grid, VolError *err)
{
    const VolVdbEntry *entry = &grid->entry;
    if (!vol_vdb_is_numeric(entry->type))
        return vol_fail(err, VOL_BAD_INPUT, "cannot read grid '%s' of '%s': its type %s is not one of numbers",
                        entry->name, vdb->name, entry->type);
    if (!entry->transform_known || !vdb->grids[grid->parent].tree)
        return vol_fail(err, VOL_BAD_INPUT, "cannot read grid '%s' of '%s': its transform '%s' is not affine",
                        entry->name, vdb->name, grid->map);
    return VOL_OK;
}

VolStatus vol_vdb_visit(const VolVdb *vdb, size_t index, const VolVdbVisitor *visitor, void *user, VolError *err)
{
    const VdbGrid *grid = &vdb->grids[index];
    const VolVdbAdapter *adapter;
    VolVdbTreeBytes tree;
    VolError why = {""};
    VolStatus status = can_visit(vdb, grid, err);
    if (!status)
        status = vol_vdb_checked_tree(vdb, index, &tree, err);
    if (!status)
        status = vol_vdb_adapter(&adapter, err);
    if (status)
        return status;

    VolVdbGridInfo info = {.value = vol_vdb_value(&grid->entry), .index_to_world = grid->entry.index_to_world,
                           .level_set = is_level_set(&grid->entry)};
    Relay relay = {visitor, user, false};
    VolVdbVisitor relayed = {visitor->begin ? relay_begin : NULL, visitor->leaf_float ? relay_float : NULL,
                             visitor->leaf_double ? relay_double : NULL, visitor->tile ? relay_tile : NULL};
    status = adapter->visit(&tree, &info, &relayed, &relay, &why);
    if (!status)
        return VOL_OK;
    if (relay.failed || status == VOL_NOMEM)
        return vol_fail(err, status, "%s", why.text);
    return vol_fail(err, status, "damaged VDB '%s': grid '%s': %s", vdb->name, grid->entry.name, why.text);
}
