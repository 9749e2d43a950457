#include "load/light_grids.h"

#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/mem.h"
#include "load/grids.h"
#include "trace/lights.h"

typedef enum LightPart { DIRECT, INDIRECT, TOTAL } LightPart;

/* A grid's place among the light grids. */
typedef struct LightName {
    LightPart part;
    int k, j; /* j -1: no number of its own */
    size_t index;
} LightName;

/* A number of up to six digits; NULL: none. */
static const char *read_number(const char *at, int *out)
{
    size_t digits = strspn(at, "0123456789");
    if (!digits || digits > 6)
        return NULL;
    *out = atoi(at);
    return at + digits;
}

/* light.K.direct, light.K.J.direct, light.K.indirect, light.total */
static bool read_name(const char *name, LightName *out)
{
    static const char light[] = "light.";
    *out = (LightName){.part = TOTAL, .j = -1};
    if (strncmp(name, light, sizeof light - 1) != 0)
        return false;
    const char *at = name + sizeof light - 1;
    if (strcmp(at, "total") == 0)
        return true;
    at = read_number(at, &out->k);
    if (!at || *at++ != '.')
        return false;
    if (isdigit((unsigned char)*at)) {
        at = read_number(at, &out->j);
        if (!at || *at++ != '.')
            return false;
    }
    out->part = strcmp(at, "direct") == 0 ? DIRECT : INDIRECT;
    return out->part == DIRECT || (strcmp(at, "indirect") == 0 && out->j < 0);
}

bool vol_has_light_grids(const VolVdb *vdb)
{
    LightName name;
    for (size_t i = 0; i < vol_vdb_count(vdb); i++)
        if (read_name(vol_vdb_entry(vdb, i)->name, &name))
            return true;
    return false;
}

static int compare_names(const void *a, const void *b)
{
    const LightName *x = a, *y = b;
    if (x->part != y->part)
        return x->part < y->part ? -1 : 1;
    if (x->k != y->k)
        return x->k < y->k ? -1 : 1;
    if (x->j != y->j)
        return x->j < y->j ? -1 : 1;
    return x->index < y->index ? -1 : x->index > y->index;
}

static VolStatus list_names(const VolVdb *vdb, LightName **out, size_t *count, VolError *err)
{
    size_t all = vol_vdb_count(vdb);
    LightName *names = *out = vol_alloc(all, sizeof *names);
    *count = 0;
    if (!names)
        return vol_fail_memory(err, all * sizeof *names);
    for (size_t i = 0; i < all; i++)
        if (read_name(vol_vdb_entry(vdb, i)->name, &names[*count]))
            names[(*count)++].index = i;
    qsort(names, *count, sizeof *names, compare_names);
    for (size_t i = 0; i < *count; i++) {
        const char *name = vol_vdb_entry(vdb, names[i].index)->name;
        if (i > 0 && strcmp(name, vol_vdb_entry(vdb, names[i - 1].index)->name) == 0)
            return vol_fail(err, VOL_BAD_INPUT, "there are two grids '%s'", name);
    }
    if (*count > 1 && names[*count - 1].part == TOTAL)
        return vol_fail(err, VOL_BAD_INPUT, "light.total stands for all lights, but there is '%s' too",
                        vol_vdb_entry(vdb, names[0].index)->name);
    return VOL_OK;
}

/* ---- Lights ---- */

/* Metadata as text, NULL where there is none. */
static VolStatus text_of(const VolVdb *vdb, size_t index, const char *name, char **out, VolError *err)
{
    const VolVdbMeta *meta = vol_meta_find(&vol_vdb_entry(vdb, index)->meta, name);
    *out = meta ? vol_meta_text(meta) : NULL;
    return meta && !*out ? vol_fail_memory(err, meta->size) : VOL_OK;
}

static bool numbers_of(const VolVdb *vdb, size_t index, const char *name, double out[3])
{
    const VolVdbMeta *meta = vol_meta_find(&vol_vdb_entry(vdb, index)->meta, name);
    bool there = meta && strcmp(meta->type, "vec3d") == 0 && meta->size == 3 * sizeof *out;
    if (there)
        memcpy(out, meta->bytes, 3 * sizeof *out);
    return there;
}

static VolStatus add_light(VolLightGrids *grids, const VolLight *light, int number, VolError *err)
{
    VolLight *lights = vol_resize(grids->lights, grids->light_count + 1, sizeof *lights);
    if (lights)
        grids->lights = lights;
    int *numbers = vol_resize(grids->number, grids->light_count + 1, sizeof *numbers);
    if (numbers)
        grids->number = numbers;
    if (!lights || !numbers)
        return vol_fail_memory(err, sizeof *lights);
    lights[grids->light_count] = *light;
    numbers[grids->light_count++] = number;
    return VOL_OK;
}

/* A sun of an environment: its direction and colour are its own. */
static bool sun_of_environment(const VolVdb *vdb, size_t index, VolLight *out)
{
    double d[3];
    *out = (VolLight){.kind = VOL_LIGHT_SUN};
    if (!numbers_of(vdb, index, "light:direction", d) || !numbers_of(vdb, index, "light:rgb", out->rgb))
        return false;
    double length = vol_length(vol_vec3(d[0], d[1], d[2]));
    if (!(length > 0) || !(length < INFINITY))
        return false;
    out->direction = vol_scale(vol_vec3(d[0], d[1], d[2]), 1 / length);
    return true;
}

/* The lights in light:spec of a grid, one behind the other. */
static VolStatus add_specs(VolLightGrids *grids, char *specs, int number, VolError *err)
{
    char *rest = NULL;
    for (char *spec = strtok_r(specs, " \n", &rest); spec; spec = strtok_r(NULL, " \n", &rest)) {
        VolLight light;
        VolStatus status = vol_light_parse(spec, &light, err);
        if (status)
            return status == VOL_USAGE ? VOL_BAD_INPUT : status;
        status = add_light(grids, &light, number, err);
        if (status)
            return status;
    }
    return VOL_OK;
}

static VolStatus add_lights_of(const VolVdb *vdb, const LightName *name, VolLightGrids *grids, VolError *err)
{
    const char *grid = vol_vdb_entry(vdb, name->index)->name;
    size_t before = grids->light_count;
    VolLight sun;
    char *specs;
    if (sun_of_environment(vdb, name->index, &sun))
        return add_light(grids, &sun, name->k, err);
    VolStatus status = text_of(vdb, name->index, "light:spec", &specs, err);
    if (!status)
        status = specs ? add_specs(grids, specs, name->k, err) : VOL_OK;
    free(specs);
    size_t added = grids->light_count - before;
    if (!status && (!added || (name->part == DIRECT && added != 1)))
        status = vol_fail(err, VOL_BAD_INPUT, "its metadata light:spec does not say which light");
    return status ? vol_fail_within(err, status, "grid '%s'", grid) : VOL_OK;
}

/* ---- Grids ---- */

static VolStatus load_one(const VolVdb *vdb, const LightName *name, int threads, const VolLog *log, VolGrid **out,
                          VolError *err)
{
    const char *grid = vol_vdb_entry(vdb, name->index)->name;
    VolStatus status = vol_load_field(vdb, grid, threads, log, out, err);
    if (!status && (*out)->bad_voxels)
        status = vol_fail(err, VOL_BAD_INPUT, "grid '%s': light that is NaN or infinite", grid);
    return status;
}

VolStatus vol_load_light_grids(const VolVdb *vdb, int threads, const VolLog *log, VolLightGrids *out, VolError *err)
{
    LightName *names;
    size_t count;
    *out = (VolLightGrids){0};
    VolStatus status = list_names(vdb, &names, &count, err);
    if (!status && count) {
        out->grids = vol_alloc_zero(count, sizeof *out->grids);
        status = out->grids ? vol_lit_begin(count, &out->lit, err) : vol_fail_memory(err, count * sizeof *out->grids);
    }
    for (size_t n = 0; n < count && !status; n++) {
        status = names[n].part == INDIRECT ? VOL_OK : add_lights_of(vdb, &names[n], out, err);
        if (!status)
            status = load_one(vdb, &names[n], threads, log, &out->grids[n], err);
        out->lit.grids[n] = out->grids[n];
    }
    if (!status && count) {
        out->lit.total = names[0].part == TOTAL;
        status = text_of(vdb, names[0].index, "light:tf", &out->tf, err);
    }
    if (!status && count)
        status = text_of(vdb, names[0].index, "light:volume", &out->volume, err);
    if (!status && count)
        status = text_of(vdb, names[0].index, "light:clip", &out->clip, err);
    free(names);
    return status;
}

/* A place of the volume's domain in a light grid's. */
static bool covers(const VolGrid *light, VolVec3 place)
{
    VolVec3 index = vol_apply(&light->world_to_index, place);
    const double at[3] = {index.x, index.y, index.z}, rounding = 1e-4;
    for (int a = 0; a < 3; a++)
        if (!(at[a] >= light->domain_min[a] - rounding && at[a] <= light->domain_max[a] + rounding))
            return false;
    return true;
}

VolStatus vol_light_grids_check(const VolLightGrids *grids, const VolVolume *volume, VolError *err)
{
    if (vol_volume_is_empty(volume))
        return VOL_OK;
    for (size_t n = 0; n < grids->lit.grid_count; n++)
        for (int corner = 0; corner < 8; corner++)
            if (!covers(grids->grids[n], vol_volume_corner(volume, corner)))
                return vol_fail(err, VOL_BAD_INPUT, "its light grids do not cover the volume: solve for light anew");
    return VOL_OK;
}

void vol_light_grids_free(VolLightGrids *grids)
{
    for (size_t n = 0; n < grids->lit.grid_count && grids->grids; n++)
        vol_grid_free(grids->grids[n]);
    vol_lit_free(&grids->lit);
    free(grids->grids);
    free(grids->lights);
    free(grids->number);
    free(grids->tf);
    free(grids->volume);
    free(grids->clip);
    *grids = (VolLightGrids){0};
}
