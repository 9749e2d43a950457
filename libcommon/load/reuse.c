#include "load/reuse.h"

#include <string.h>

typedef struct Copying {
    VolVdbWriter *writer;
    VolVdbNewGrid grid;
} Copying;

static const char *const compared[] = {"light:method", "light:spec",   "light:clip",
                                       "light:options", "light:volume", "light:tf"};

static bool has_same(const VolVdbMetaList *a, const VolVdbMetaList *b, const char *name)
{
    const VolVdbMeta *x = vol_meta_find(a, name), *y = vol_meta_find(b, name);
    return x && y && strcmp(x->type, y->type) == 0 && x->size == y->size && memcmp(x->bytes, y->bytes, x->size) == 0;
}

/* light.K.PART */
static bool is_part(const char *name, const char *part)
{
    static const char light[] = "light.";
    if (strncmp(name, light, sizeof light - 1) != 0)
        return false;
    const char *number = name + sizeof light - 1, *end = number + strspn(number, "0123456789");
    return end > number && *end == '.' && strcmp(end + 1, part) == 0;
}

static bool is_wanted(const VolVdbEntry *entry, const char *part, const VolVdbMetaList *wanted)
{
    bool same = is_part(entry->name, part) && entry->transform_known;
    for (size_t i = 0; i < sizeof compared / sizeof *compared && same; i++)
        same = has_same(&entry->meta, wanted, compared[i]);
    return same && vol_meta_find(&entry->meta, "vol:domainMin") && vol_meta_find(&entry->meta, "vol:domainMax");
}

/* ---- Copying ---- */

static VolStatus begin(void *user, const VolVdbGridInfo *info, VolError *err)
{
    Copying *copying = user;
    copying->grid.store = info->value == VOL_VALUE_VEC3S ? VOL_STORE_VEC3S : VOL_STORE_FLOAT;
    copying->grid.index_to_world = info->index_to_world;
    memcpy(copying->grid.background, info->background, sizeof info->background);
    if (info->value != VOL_VALUE_VEC3S && info->value != VOL_VALUE_FLOAT)
        return vol_fail(err, VOL_BAD_INPUT, "it is no grid of floats or of vec3s");
    return vol_vdb_begin_grid(copying->writer, &copying->grid, err);
}

static VolStatus leaf(void *user, const int32_t origin[3], const float *values, const uint64_t active[8], VolError *err)
{
    return vol_vdb_put_leaf(((Copying *)user)->writer, origin, values, active, err);
}

static VolStatus tile(void *user, const int32_t origin[3], int32_t size, const double value[3], bool active, VolError *err)
{
    return vol_vdb_put_tile(((Copying *)user)->writer, origin, size, value, active, err);
}

static VolStatus take_domain(const VolVdbMetaList *from, VolVdbMetaList *to, VolError *err)
{
    static const char *const names[] = {"vol:domainMin", "vol:domainMax"};
    VolStatus status = vol_meta_set_text(to, "vol:domain", "box", err);
    for (size_t i = 0; i < 2 && !status; i++) {
        const VolVdbMeta *meta = vol_meta_find(from, names[i]);
        status = vol_meta_set(to, names[i], meta->type, meta->bytes, meta->size, err);
    }
    return status;
}

static VolStatus copy_grid(const VolVdb *lit, size_t index, Copying *copying, VolError *err)
{
    const VolVdbVisitor visitor = {.begin = begin, .leaf_float = leaf, .tile = tile, .threads = 1};
    VolStatus status = take_domain(&vol_vdb_entry(lit, index)->meta, &copying->grid.meta, err);
    if (!status)
        status = vol_vdb_visit(lit, index, &visitor, copying, err);
    if (!status)
        status = vol_vdb_end_grid(copying->writer, err);
    return status ? vol_fail_within(err, status, "grid '%s'", vol_vdb_entry(lit, index)->name) : VOL_OK;
}

VolStatus vol_reuse_light(const VolVdb *lit, const char *part, const VolVdbMetaList *wanted, const char *name,
                          VolVdbWriter *writer, bool *found, VolError *err)
{
    size_t index = 0;
    while (index < vol_vdb_count(lit) && !is_wanted(vol_vdb_entry(lit, index), part, wanted))
        index++;
    *found = index < vol_vdb_count(lit);
    if (!*found)
        return VOL_OK;
    Copying copying = {writer, {.name = name, .grid_class = "unknown"}};
    VolStatus status = vol_meta_copy(&copying.grid.meta, wanted, err);
    if (!status)
        status = copy_grid(lit, index, &copying, err);
    vol_meta_free(&copying.grid.meta);
    return status;
}
