#include "load/grids.h"

#include <inttypes.h>
#include <math.h>
#include <stdatomic.h>
#include <string.h>

typedef struct Loading {
    const VolVdbEntry *entry;
    bool as_double;
    atomic_bool lost; /* float does not hold one of the values: all was in vain */
    int threads;
    VolGridSource source;
    VolGridBuilder *builder;
} Loading;

/* vol:domain = "box" with vol:domainMin and vol:domainMax, else the active bounding box. */
static VolStatus settle_domain(Loading *loading, const VolVdbGridInfo *info, VolError *err)
{
    const VolVdbMetaList *meta = &loading->entry->meta;
    VolGridSource *source = &loading->source;
    const VolVdbMeta *domain = vol_meta_find(meta, "vol:domain");
    source->box = domain && strcmp(domain->type, "string") == 0 && domain->size == 3 && memcmp(domain->bytes, "box", 3) == 0;
    memcpy(source->box_min, info->box_min, sizeof source->box_min);
    memcpy(source->box_max, info->box_max, sizeof source->box_max);
    source->empty = info->empty;
    for (int a = 0; a < 3 && info->empty; a++)
        source->box_min[a] = source->box_max[a] = 0; /* nowhere: a camera must look somewhere */
    if (!source->box)
        return VOL_OK;
    const VolVdbMeta *lo = vol_meta_find(meta, "vol:domainMin"), *hi = vol_meta_find(meta, "vol:domainMax");
    if (!lo && !hi)
        return VOL_OK;
    if (!lo || !hi || !vol_meta_vec3i(lo, source->box_min) || !vol_meta_vec3i(hi, source->box_max))
        return vol_fail(err, VOL_BAD_INPUT, "vol:domainMin and vol:domainMax must both be vec3i");
    for (int a = 0; a < 3; a++)
        if (source->box_min[a] > source->box_max[a])
            return vol_fail(err, VOL_BAD_INPUT, "vol:domainMin lies beyond vol:domainMax");
    source->empty = false; /* inactive voxels in a box are voxels like others */
    return VOL_OK;
}

static bool float_holds(double value) { return isnan(value) || (double)(float)value == value; }

/* There is no use in going on. */
static VolStatus give_up(Loading *loading, VolError *err)
{
    atomic_store_explicit(&loading->lost, true, memory_order_relaxed);
    return vol_fail(err, VOL_BAD_INPUT, "its values do not fit into float");
}

static VolStatus begin(void *user, const VolVdbGridInfo *info, VolError *err)
{
    Loading *loading = user;
    loading->source.index_to_world = info->index_to_world;
    loading->source.background = info->background[0];
    loading->source.is_rgb = info->value == VOL_VALUE_VEC3S;
    memcpy(loading->source.background_rgb, info->background, sizeof info->background);
    loading->source.level_set = info->level_set;
    loading->source.as_double = loading->as_double;
    loading->source.active_voxels = info->active_voxels;
    loading->source.threads = loading->threads;
    if (!loading->source.is_rgb && !loading->as_double && !float_holds(info->background[0]))
        return give_up(loading, err);
    VolStatus status = settle_domain(loading, info, err);
    return status ? status : vol_grid_begin(&loading->source, &loading->builder, err);
}

static VolStatus place(void *user, const int32_t origin[3], VolError *err)
{
    return vol_grid_place(((Loading *)user)->builder, origin, err);
}

static VolStatus leaf_float(void *user, const int32_t origin[3], const float *values, const uint64_t active[8],
                            VolError *err)
{
    return vol_grid_leaf(((Loading *)user)->builder, origin, values, NULL, active, err);
}

static VolStatus leaf_double(void *user, const int32_t origin[3], const double *values, const uint64_t active[8],
                             VolError *err)
{
    enum { COUNT = 512 };
    Loading *loading = user;
    float narrow[COUNT];
    bool held = true;
    if (loading->as_double)
        return vol_grid_leaf(loading->builder, origin, NULL, values, active, err);
    for (int n = 0; n < COUNT; n++) {
        narrow[n] = (float)values[n];
        held = held && float_holds(values[n]);
    }
    if (!held || atomic_load_explicit(&loading->lost, memory_order_relaxed))
        return give_up(loading, err);
    return vol_grid_leaf(loading->builder, origin, narrow, NULL, active, err);
}

static VolStatus tile(void *user, const int32_t origin[3], int32_t size, const double value[3], bool active, VolError *err)
{
    Loading *loading = user;
    if (loading->source.is_rgb)
        return vol_grid_tile_rgb(loading->builder, origin, size, value, active, err);
    if (!loading->as_double && !float_holds(value[0]))
        return give_up(loading, err);
    return vol_grid_tile(loading->builder, origin, size, value[0], active, err);
}

/* What is seen is not all, or nothing: say so. */
static void warn_of_grid(const VolVdb *vdb, size_t index, VolGrid *grid, const VolLog *log)
{
    char label[VOL_VDB_LABEL];
    const VolVolume volume = vol_volume_of_grid(grid);
    uint64_t bad = vol_volume_counts(&volume).bad_voxels;
    vol_vdb_label(vdb, index, label, sizeof label);
    if (vol_volume_is_empty(&volume))
        vol_warn(log, "grid '%s' is empty: it has no active voxels", label);
    if (bad)
        vol_warn(log, "grid '%s': %" PRIu64 " voxels are NaN or infinite; the cells around them are left empty", label, bad);
    if (grid->domain == VOL_DOMAIN_SPARSE && !grid->empty && !grid->is_rgb && !isfinite(grid->background))
        vol_warn(log, "grid '%s': its background is %g; the cells around its outermost voxels are left empty", label,
                 grid->background);
}

/* Names that several grids have, where the user has not said which. */
static void warn_of_namesakes(const VolVdb *vdb, size_t index, const char *asked, const VolLog *log)
{
    char label[VOL_VDB_LABEL];
    const char *name = vol_vdb_entry(vdb, index)->name;
    size_t namesakes = vol_vdb_namesakes(vdb, index);
    vol_vdb_label(vdb, index, label, sizeof label);
    if (namesakes > 1 && (!asked || strcmp(asked, name) == 0))
        vol_warn(log, "there are %zu grids named '%s'; '%s' is taken (the second is --grid '%s[1]')", namesakes, name, label,
                 name);
}

static VolStatus check_entry(const VolVdbEntry *entry, bool rgb_too, VolError *err)
{
    VolVdbValue value = vol_vdb_value(entry);
    if (vol_vdb_components(value) != 1 && !(rgb_too && value == VOL_VALUE_VEC3S))
        return vol_fail(err, VOL_BAD_INPUT, "it is of type %s, not a grid of scalars%s", entry->type,
                        rgb_too ? " or of vec3s" : "");
    if (!entry->transform_known)
        return vol_fail(err, VOL_BAD_INPUT, "its transform is not affine");
    return VOL_OK;
}

/* `wide`: of a type that float may not hold.  `*lost`: it does not. */
static VolStatus load_entry(const VolVdb *vdb, size_t index, bool wide, bool as_double, VolVdbVisitor visitor, VolGrid **out,
                            bool *lost, VolError *err)
{
    Loading loading = {.entry = vol_vdb_entry(vdb, index), .as_double = as_double, .threads = visitor.threads};
    visitor.leaf_double = wide ? leaf_double : NULL;
    visitor.last = visitor.last && (as_double || !wide);
    VolStatus status = vol_vdb_visit(vdb, index, &visitor, &loading, err);
    *lost = loading.lost;
    if (!status)
        return vol_grid_finish(loading.builder, out, err);
    vol_grid_builder_free(loading.builder);
    return status;
}

/* `beside`: a field, which may be RGB and leaves the VDB as it is. */
static VolStatus load_grid(const VolVdb *vdb, size_t index, bool keep_double, bool beside, int threads, VolGrid **out,
                           VolError *err)
{
    const VolVdbEntry *entry = vol_vdb_entry(vdb, index);
    const VolVdbVisitor visitor = {.begin = begin, .leaf_float = leaf_float, .tile = tile, .place = place,
                                   .threads = threads, .last = !beside};
    VolVdbValue value = vol_vdb_value(entry);
    bool wide = value == VOL_VALUE_DOUBLE || value == VOL_VALUE_INT32 || value == VOL_VALUE_INT64;
    bool lost = false;
    VolStatus status = check_entry(entry, beside, err);
    if (!status)
        status = load_entry(vdb, index, wide, wide && keep_double, visitor, out, &lost, err);
    if (lost)
        status = load_entry(vdb, index, true, true, visitor, out, &lost, err);
    if (!status)
        return VOL_OK;
    char label[VOL_VDB_LABEL];
    vol_vdb_label(vdb, index, label, sizeof label);
    return vol_fail_within(err, status, "grid '%s'", label);
}

VolStatus vol_load_volume(const VolVdb *vdb, const char *grid_name, bool keep_double, int threads, const VolLog *log,
                          VolVolume *out, VolError *err)
{
    size_t index;
    VolGrid *grid;
    *out = (VolVolume){VOL_VOLUME_NONE};
    VolStatus status = vol_vdb_find(vdb, grid_name, &index, err);
    if (!status)
        status = load_grid(vdb, index, keep_double, false, threads, &grid, err);
    if (status)
        return status;
    *out = vol_volume_of_grid(grid);
    warn_of_namesakes(vdb, index, grid_name, log);
    warn_of_grid(vdb, index, grid, log);
    return VOL_OK;
}

VolStatus vol_load_field(const VolVdb *vdb, const char *grid_name, int threads, const VolLog *log, VolGrid **out,
                         VolError *err)
{
    size_t index;
    *out = NULL;
    VolStatus status = vol_vdb_find(vdb, grid_name, &index, err);
    if (!status)
        status = load_grid(vdb, index, false, true, threads, out, err);
    if (!status)
        warn_of_grid(vdb, index, *out, log);
    return status;
}
