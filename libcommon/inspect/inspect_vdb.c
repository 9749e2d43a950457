#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/refusals.h"
#include "inspect/inspect.h"

/* One grid while its values are gathered: twice, as the bins depend on the range. */
typedef struct Gather {
    VolVdbGridInfo info;
    VolSeries *series; /* one per component */
    int components;
    void (*take)(VolSeries *series, double value, uint64_t weight);
} Gather;

static VolStatus begin(void *user, const VolVdbGridInfo *info, VolError *err)
{
    (void)err;
    ((Gather *)user)->info = *info;
    return VOL_OK;
}

static VolStatus take_leaf(void *user, const int32_t origin[3], const double *values, const uint64_t active[8],
                           VolError *err)
{
    (void)origin;
    (void)err;
    Gather *gather = user;
    for (int n = 0; n < 512; n++)
        for (int c = 0; c < gather->components && (active[n >> 6] >> (n & 63) & 1); c++)
            gather->take(&gather->series[c], values[n * gather->components + c], 1);
    return VOL_OK;
}

static VolStatus take_tile(void *user, const int32_t origin[3], int32_t size, const double value[3], bool active,
                           VolError *err)
{
    (void)origin;
    (void)err;
    Gather *gather = user;
    for (int c = 0; c < gather->components && active; c++)
        gather->take(&gather->series[c], value[c], (uint64_t)size * (uint64_t)size * (uint64_t)size);
    return VOL_OK;
}

static json_t *metadata_json(const VolVdbMetaList *list, VolError *err)
{
    json_t *object = json_object();
    for (size_t i = 0; i < list->count; i++) {
        char *text = vol_meta_text(&list->items[i]);
        json_t *value = text ? vol_json_text(text) : NULL;
        free(text);
        if (!value || json_object_set_new_nocheck(object, list->items[i].name, value)) {
            json_decref(object);
            vol_fail_memory(err, list->items[i].size);
            return NULL;
        }
    }
    return object;
}

static char *meta_value(const VolVdbMetaList *list, const char *name)
{
    const VolVdbMeta *meta = vol_meta_find(list, name);
    return meta ? vol_meta_text(meta) : NULL;
}

static bool is_scaled_identity(const VolAffine *a)
{
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            if (i != j && a->m[i][j] != 0)
                return false;
    return true;
}

static json_t *transform_json(const VolVdbEntry *entry)
{
    const VolAffine *a = &entry->index_to_world;
    json_t *object = json_object();
    if (!entry->transform_known) {
        json_object_set_new(object, "kind", json_string("not affine"));
        json_object_set_new(object, "map", vol_json_text(entry->map));
        return object;
    }
    if (is_scaled_identity(a)) {
        json_object_set_new(object, "voxel_size", vol_json_reals((double[]){a->m[0][0], a->m[1][1], a->m[2][2]}, 3));
    } else {
        json_object_set_new(object, "voxel_x", vol_json_reals(a->m[0], 3));
        json_object_set_new(object, "voxel_y", vol_json_reals(a->m[1], 3));
        json_object_set_new(object, "voxel_z", vol_json_reals(a->m[2], 3));
    }
    json_object_set_new(object, "origin", vol_json_reals(a->m[3], 3));
    return object;
}

/* Where the field ends: at its outermost voxel centres, or faded to the background over a voxel. */
static void describe_domain(const VolVdbEntry *entry, json_t *grid)
{
    char *domain = meta_value(&entry->meta, "vol:domain");
    bool box = domain && strcmp(domain, "box") == 0;
    json_object_set_new(grid, "domain", json_string(box ? "box" : "sparse"));
    free(domain);
    const char *const names[] = {"vol:domainMin", "vol:domainMax"}, *const keys[] = {"domain_min", "domain_max"};
    for (int i = 0; i < 2 && box; i++) {
        int32_t v[3];
        const VolVdbMeta *meta = vol_meta_find(&entry->meta, names[i]);
        if (meta && vol_meta_vec3i(meta, v))
            json_object_set_new(grid, keys[i], vol_json_ints(v, 3));
    }
}

static void describe_tree(const Gather *gather, json_t *grid)
{
    const VolVdbGridInfo *info = &gather->info;
    if (!info->empty) {
        int32_t dims[3];
        for (int i = 0; i < 3; i++)
            dims[i] = (int32_t)((uint32_t)info->box_max[i] - (uint32_t)info->box_min[i] + 1);
        json_object_set_new(grid, "active_min", vol_json_ints(info->box_min, 3));
        json_object_set_new(grid, "active_max", vol_json_ints(info->box_max, 3));
        json_object_set_new(grid, "dims", vol_json_ints(dims, 3));
    }
    json_object_set_new(grid, "active_voxels", json_integer((json_int_t)info->active_voxels));
    json_object_set_new(grid, "leaves", json_integer((json_int_t)info->leaves));
    json_object_set_new(grid, "active_tiles", json_integer((json_int_t)info->active_tiles));
    json_object_set_new(grid, "background",
                        gather->components == 1 ? vol_json_real(info->background[0])
                                                : vol_json_reals(info->background, (size_t)gather->components));
}

static VolStatus gather_values(const VolVdb *vdb, size_t i, VolInspection *out, json_t *grid, VolError *err)
{
    const VolVdbEntry *entry = vol_vdb_entry(vdb, i);
    Gather gather = {.components = vol_vdb_components(vol_vdb_value(entry)), .take = vol_series_range};
    const VolVdbVisitor visitor = {.begin = begin, .leaf_double = take_leaf, .tile = take_tile};
    VolStatus status = VOL_OK;
    for (int c = 0; c < gather.components && !status; c++) {
        char label[VOL_VDB_LABEL], name[VOL_VDB_LABEL + 2];
        vol_vdb_label(vdb, i, label, sizeof label);
        snprintf(name, sizeof name, gather.components > 1 ? "%s.%c" : "%s", label, "xyz"[c]);
        status = vol_inspection_add_series(out, name, &gather.series, err);
    }
    if (status)
        return status;
    gather.series = out->series + out->series_count - (size_t)gather.components;
    status = vol_vdb_visit(vdb, i, &visitor, &gather, err);
    gather.take = vol_series_bin;
    if (!status)
        status = vol_vdb_visit(vdb, i, &visitor, &gather, err);
    if (status)
        return status;
    describe_tree(&gather, grid);
    json_t *components = json_array();
    for (int c = 0; c < gather.components; c++) {
        json_t *series = vol_series_json(&gather.series[c]);
        if (gather.components > 1)
            json_object_set_new(series, "name", json_stringn(&"xyz"[c], 1));
        json_array_append_new(components, series);
    }
    json_object_set_new(grid, "components", components);
    return VOL_OK;
}

static VolStatus inspect_grid(const VolVdb *vdb, size_t i, bool headers_only, VolInspection *out, json_t *grid,
                              VolError *err)
{
    const VolVdbEntry *entry = vol_vdb_entry(vdb, i);
    char *class = meta_value(&entry->meta, "class"), label[VOL_VDB_LABEL];
    vol_vdb_label(vdb, i, label, sizeof label);
    json_object_set_new(grid, "name", vol_json_text(entry->name));
    json_object_set_new(grid, "label", vol_json_text(label));
    if (strcmp(entry->name, entry->unique_name) != 0)
        json_object_set_new(grid, "unique_name", vol_json_text(entry->unique_name));
    json_object_set_new(grid, "type", vol_json_text(entry->type));
    json_object_set_new(grid, "half", json_boolean(entry->half));
    if (class)
        json_object_set_new(grid, "class", vol_json_text(class));
    free(class);
    if (entry->instance_of[0])
        json_object_set_new(grid, "instance_of", vol_json_text(entry->instance_of));
    json_object_set_new(grid, "bytes", json_integer((json_int_t)entry->size));
    json_object_set_new(grid, "transform", transform_json(entry));
    describe_domain(entry, grid);
    json_t *metadata = metadata_json(&entry->meta, err);
    if (!metadata)
        return VOL_NOMEM;
    json_object_set_new(grid, "metadata", metadata);
    bool decoded = vol_vdb_components(vol_vdb_value(entry)) > 0 && entry->map_size && !headers_only;
    json_object_set_new(grid, "decoded", json_boolean(decoded));
    return decoded ? gather_values(vdb, i, out, grid, err) : VOL_OK;
}

VolStatus vol_inspect_vdb(const VolVdb *vdb, size_t size, bool headers_only, VolInspection *out, VolError *err)
{
    vol_watch_jansson();
    size_t refusals = vol_refusals();
    *out = (VolInspection){.description = json_object(), .history = meta_value(vol_vdb_file_meta(vdb), "vol:history")};
    json_t *top = out->description, *grids = json_array(), *metadata = metadata_json(vol_vdb_file_meta(vdb), err);
    json_object_set_new(top, "format", json_string("VDB"));
    json_object_set_new(top, "bytes", json_integer((json_int_t)size));
    VolStatus status = json_object_set_new(top, "metadata", metadata) ? vol_fail_memory(err, 0) : VOL_OK;
    if (json_object_set_new(top, "grids", grids))
        status = vol_fail_memory(err, 0);
    for (size_t i = 0; i < vol_vdb_count(vdb) && !status; i++) {
        json_t *grid = json_object();
        if (json_array_append_new(grids, grid))
            status = vol_fail_memory(err, 0);
        else
            status = inspect_grid(vdb, i, headers_only, out, grid, err);
    }
    if (!status && vol_refusals() != refusals) /* jansson leaves out what it has no memory for */
        status = vol_fail_memory(err, 0);
    if (status)
        vol_inspection_free(out);
    return status;
}
