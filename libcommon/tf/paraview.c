/* ParaView's colour maps: a JSON list of objects, or one such object:
 *
 *     {"Name": "X", "ColorSpace": "Lab", "RGBPoints": [v, r, g, b, ...], "Points": [v, opacity, midpoint, sharpness, ...]}
 *
 * Most have no opacity of their own; they get what ParaView begins with, a ramp from 0 at the first point to 1 at the
 * last.  Presets are meant to be stretched to the data's range, save those made for certain values: maps whose points lie
 * within [0, 1] or [-1, 1] are stretched, from the first point to the last, all others keep their values.  Maps that
 * are mere lists of colours (IndexedColors) belong to categories, not to values, and are refused.
 *
 * Opacities hold for ScalarOpacityUnitDistance, which ParaView keeps elsewhere; it begins with the diagonal of the data
 * divided by the cube root of the number of cells (vtkSMBoundsDomain, approximate_cell_length). */
#include "tf/foreign_private.h"
#include "tf/json.h"

#include <stdlib.h>
#include <string.h>

static bool is_map(const json_t *object)
{
    return json_object_get(object, "RGBPoints") || json_object_get(object, "IndexedColors");
}

bool vol_foreign_is_paraview(const json_t *root)
{
    return json_is_array(root) || (is_map(root) && !json_object_get(root, "pellucid"));
}

/* ---- Which map ---- */

static const char *name_of(const json_t *map)
{
    const char *name = json_string_value(json_object_get(map, "Name"));
    return name ? name : "";
}

/* Names of all maps that have points. */
static VolStatus collect(const VolForeign *f, const json_t *list, const json_t **maps, const char **names, size_t *count)
{
    for (size_t i = 0; i < json_array_size(list); i++) {
        const json_t *map = json_array_get(list, i);
        if (!json_is_object(map))
            return vol_foreign_fault(f, 0, "element %zu of its list is no object, so no colour map", i + 1);
        if (!json_object_get(map, "RGBPoints"))
            continue;
        maps[*count] = map;
        names[(*count)++] = name_of(map);
    }
    return VOL_OK;
}

/* Whether a map of the wanted name is there, but only for categories. */
static bool only_categories(const VolForeign *f, const json_t *list, const char *const *names, size_t count)
{
    bool found = false;
    for (size_t i = 0; f->part && i < json_array_size(list); i++)
        found |= strcmp(name_of(json_array_get(list, i)), f->part) == 0;
    for (size_t i = 0; found && i < count; i++)
        found = strcmp(names[i], f->part) != 0;
    return found;
}

static VolStatus choose_map(VolForeign *f, const json_t *list, const json_t **out)
{
    size_t size = json_array_size(list), count = 0, chosen = 0;
    const json_t **maps = vol_alloc(size, sizeof *maps);
    const char **names = vol_alloc(size, sizeof *names);
    VolStatus status = maps && names ? VOL_OK : vol_fail_memory(f->err, size * sizeof *maps);
    if (status == VOL_OK)
        status = collect(f, list, maps, names, &count);
    if (status == VOL_OK && only_categories(f, list, names, count))
        status = vol_foreign_fault(f, 0, "colour map '%.80s' has colours for categories only (IndexedColors), no RGBPoints",
                                   f->part);
    if (status == VOL_OK)
        status = vol_foreign_choose(f, "colour map", names, count, &chosen);
    if (status == VOL_OK)
        *out = maps[chosen];
    free(maps);
    free(names);
    return status;
}

/* ---- One map ---- */

static VolStatus read_four(const VolForeign *f, const json_t *list, const char *key, size_t group, double out[4])
{
    for (size_t i = 0; i < 4; i++) {
        const json_t *number = json_array_get(list, 4 * group + i);
        if (!json_is_number(number))
            return vol_foreign_fault(f, 0, "number %zu of '%s' is not a number", 4 * group + i + 1, key);
        out[i] = json_number_value(number);
    }
    return VOL_OK;
}

static VolStatus check_list(const VolForeign *f, const json_t *list, const char *key)
{
    size_t size = json_array_size(list);
    if (!json_is_array(list))
        return vol_foreign_fault(f, 0, "'%s' is not a list of numbers", key);
    if (!size || size % 4)
        return vol_foreign_fault(f, 0, "'%s' has %zu numbers, which are not groups of 4", key, size);
    return VOL_OK;
}

static VolStatus read_colors(const VolForeign *f, const json_t *map, VolForeignPoints *out)
{
    const json_t *list = json_object_get(map, "RGBPoints");
    VolStatus status = check_list(f, list, "RGBPoints");
    for (size_t i = 0; status == VOL_OK && i < json_array_size(list) / 4; i++) {
        double p[4] = {0};
        status = read_four(f, list, "RGBPoints", i, p);
        if (status == VOL_OK)
            status = vol_foreign_add_color(f, out, 0, p[0], p[1], p[2], p[3]);
    }
    if (status == VOL_OK)
        vol_foreign_sort(f, out, "the points of the colours");
    return status;
}

static VolStatus ramp(const VolForeign *f, const VolForeignPoints *colors, VolForeignPoints *out)
{
    vol_foreign_note(f, "it has no opacities; they run from 0 at its first point to 1 at its last");
    VolStatus status = vol_foreign_add_opacity(f, out, 0, colors->items[0].v, 0, 0.5, 0);
    if (status == VOL_OK)
        status = vol_foreign_add_opacity(f, out, 0, colors->items[colors->count - 1].v, 1, 0.5, 0);
    return status;
}

static VolStatus read_opacity(const VolForeign *f, const json_t *map, const VolForeignPoints *colors,
                              VolForeignPoints *out)
{
    const json_t *list = json_object_get(map, "Points");
    if (!list)
        return ramp(f, colors, out);
    VolStatus status = check_list(f, list, "Points");
    for (size_t i = 0; status == VOL_OK && i < json_array_size(list) / 4; i++) {
        double p[4] = {0};
        status = read_four(f, list, "Points", i, p);
        if (status == VOL_OK)
            status = vol_foreign_add_opacity(f, out, 0, p[0], p[1], p[2], p[3]);
    }
    if (status == VOL_OK)
        vol_foreign_sort(f, out, "the points of the opacity");
    return status;
}

static bool is_set(const json_t *map, const char *key)
{
    const json_t *value = json_object_get(map, key);
    return json_is_true(value) || (json_is_number(value) && json_number_value(value) != 0);
}

static VolStatus read_space(const VolForeign *f, const json_t *map, VolColorSpace *out)
{
    static const struct {
        const char *name;
        VolColorSpace space;
    } rows[] = {{"RGB", VOL_COLOR_RGB},           {"HSV", VOL_COLOR_HSV},   {"Lab", VOL_COLOR_LAB},
                {"CIELAB", VOL_COLOR_LAB},        {"Step", VOL_COLOR_STEP}, {"Diverging", VOL_COLOR_DIVERGING},
                {"Lab/CIEDE2000", VOL_COLOR_LAB}, {"CIEDE2000", VOL_COLOR_LAB}};
    const json_t *value = json_object_get(map, "ColorSpace");
    const char *name = value ? json_string_value(value) : "RGB";
    for (size_t i = 0; name && i < sizeof rows / sizeof *rows; i++) {
        if (strcmp(rows[i].name, name) != 0)
            continue;
        *out = rows[i].space == VOL_COLOR_HSV && is_set(map, "HSVWrap") ? VOL_COLOR_HSV_WRAP : rows[i].space;
        if (strstr(name, "CIEDE2000"))
            vol_foreign_warn(f, "colours are blended in Lab instead of %s", name);
        return VOL_OK;
    }
    return vol_foreign_fault(f, 0, "ColorSpace '%.40s' is none of RGB, HSV, Lab, CIELAB, Diverging, Step",
                             name ? name : "");
}

static VolStatus read_settings(const VolForeign *f, const json_t *map, VolColorSpace *space, VolTf *out, VolTfUnits *units)
{
    const json_t *unit = json_object_get(map, "ScalarOpacityUnitDistance");
    if (unit && !(json_is_number(unit) && json_number_value(unit) > 0))
        return vol_foreign_fault(f, 0, "ScalarOpacityUnitDistance is not a number greater than 0");
    if (unit)
        out->particle_step = json_number_value(unit);
    else
        units->step = VOL_STEP_CELL;
    if (is_set(map, "UseLogScale"))
        vol_foreign_warn(f, "UseLogScale is ignored: colours are placed by the value, not its logarithm");
    return read_space(f, map, space);
}

static void stretch(const VolForeign *f, VolForeignPoints *colors, VolForeignPoints *opacity, bool *relative)
{
    double lo = colors->items[0].v, hi = colors->items[colors->count - 1].v;
    *relative = lo >= -1 && hi <= 1;
    if (!*relative)
        return;
    vol_foreign_note(f, "its points, from %g to %g, are stretched to the data's range", lo, hi);
    vol_foreign_normalise(colors);
    vol_foreign_normalise(opacity);
}

VolStatus vol_foreign_paraview(VolForeign *f, json_t *root, VolTf *out, VolTfUnits *units)
{
    VolForeignPoints colors = {0}, opacity = {0};
    VolColorSpace space = VOL_COLOR_RGB;
    const json_t *map = root;
    json_t *single = NULL;
    if (json_is_object(root)) { /* a list of one */
        single = json_pack("[O]", root);
        if (!single)
            return vol_fail_memory(f->err, sizeof root);
    }
    VolStatus status = choose_map(f, single ? single : root, &map);
    if (status == VOL_OK)
        status = read_settings(f, map, &space, out, units);
    if (status == VOL_OK)
        status = read_colors(f, map, &colors);
    if (status == VOL_OK)
        status = read_opacity(f, map, &colors, &opacity);
    if (status == VOL_OK) {
        stretch(f, &colors, &opacity, &units->relative);
        status = vol_foreign_finish(f, &colors, space, &opacity, out);
    }
    vol_foreign_points_free(&colors);
    vol_foreign_points_free(&opacity);
    json_decref(single);
    return status;
}
