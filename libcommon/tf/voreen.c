/* Voreen's .tfi: <VoreenData> with a <TransFuncIntensity>:
 *
 *     <Keys>
 *         <key><intensity value="0.5"/><split value="false"/><colorL r="255" g="0" b="0" a="51"/></key>
 *         <key><intensity value="0.7"/><split value="true"/><colorL .../><colorR .../></key> ...
 *     </Keys>
 *     <domain x="0" y="255"/> <threshold x="0" y="1"/>        older: <lower value="0"/> <upper value="1"/>
 *
 * Colours and opacities are bytes, linear between keys; a split key is a jump from colorL to colorR.  Intensities are
 * fractions of the domain, and so are the thresholds, outside of which opacity is 0.  A domain of 0 to 1, or none, is
 * that of data which have no values of their own: it stands for their range.  Opacities hold for 1/200 of the volume's
 * edge: its shaders (mod_compositing.frag, SAMPLING_BASE_INTERVAL_RCP) measure rays in texture coordinates, from 0 to 1
 * across the volume. */
#include "tf/foreign_private.h"

#include <stdlib.h>
#include <string.h>

#define STEPS_ACROSS 200.0

typedef struct Keys {
    VolForeignPoints colors, opacity; /* two points for every key: left and right */
} Keys;

typedef enum AlphaMode { ALPHA_NONE, ALPHA_USED, ALPHA_OPAQUE } AlphaMode;

static VolStatus read_side(const VolForeign *f, const VolXml *xml, size_t key, const char *side, double v, Keys *keys)
{
    static const char *const names[4] = {"r", "g", "b", "a"};
    size_t line = xml->elements[key].line, color = vol_xml_child(xml, key, side, 0);
    double c[4] = {0};
    if (!color)
        return vol_foreign_fault(f, line, "key %zu has no <%s>", keys->colors.count / 2 + 1, side);
    VolStatus status = VOL_OK;
    for (int i = 0; i < 4 && status == VOL_OK; i++)
        status = vol_foreign_number(f, xml, color, names[i], &c[i]);
    if (status == VOL_OK)
        status = vol_foreign_add_color(f, &keys->colors, line, v, c[0] / 255, c[1] / 255, c[2] / 255);
    if (status == VOL_OK)
        status = vol_foreign_add_opacity(f, &keys->opacity, line, v, c[3] / 255, 0.5, 0);
    return status;
}

static VolStatus read_bool(const VolForeign *f, const VolXml *xml, size_t parent, const char *child, bool *out)
{
    size_t at = vol_xml_child(xml, parent, child, 0);
    const char *text = at ? vol_xml_attribute(xml, at, "value") : "false";
    bool yes = text && (strcmp(text, "true") == 0 || strcmp(text, "1") == 0);
    if (!yes && (!text || (strcmp(text, "false") != 0 && strcmp(text, "0") != 0)))
        return vol_foreign_fault(f, xml->elements[at].line, "<%s> is neither true nor false", child);
    *out = yes;
    return VOL_OK;
}

static VolStatus read_key(const VolForeign *f, const VolXml *xml, size_t key, Keys *keys)
{
    size_t intensity = vol_xml_child(xml, key, "intensity", 0);
    double v = 0;
    bool split = false;
    if (!intensity)
        return vol_foreign_fault(f, xml->elements[key].line, "key %zu has no <intensity>", keys->colors.count / 2 + 1);
    VolStatus status = vol_foreign_number(f, xml, intensity, "value", &v);
    if (status == VOL_OK)
        status = read_bool(f, xml, key, "split", &split);
    if (status == VOL_OK)
        status = read_side(f, xml, key, "colorL", v, keys);
    if (status == VOL_OK)
        status = read_side(f, xml, key, split ? "colorR" : "colorL", v, keys);
    return status;
}

static VolStatus read_keys(const VolForeign *f, const VolXml *xml, size_t function, Keys *keys)
{
    size_t list = vol_xml_child(xml, function, "Keys", 0);
    VolStatus status = VOL_OK;
    if (!list)
        return vol_foreign_fault(f, xml->elements[function].line, "it has no <Keys>");
    for (size_t at = vol_xml_child(xml, list, "key", 0); at && status == VOL_OK;
         at = vol_xml_child(xml, list, "key", at))
        status = read_key(f, xml, at, keys);
    if (status == VOL_OK && !keys->colors.count)
        return vol_foreign_fault(f, xml->elements[list].line, "its <Keys> are empty");
    return status;
}

/* Opaque is every value whose opacity is not 0: all between two points unless both are transparent.  Sorted. */
static VolStatus make_opaque(const VolForeign *f, VolForeignPoints *opacity)
{
    VolForeignPoints made = {0};
    VolForeignPoint first = opacity->items[0];
    first.value[0] = first.value[0] > 0;
    VolStatus status = vol_foreign_add_point(f, &made, first);
    for (size_t i = 0; i + 1 < opacity->count && status == VOL_OK; i++) {
        VolForeignPoint a = opacity->items[i], b = opacity->items[i + 1];
        if (a.v < b.v)
            a.value[0] = b.value[0] = a.value[0] > 0 || b.value[0] > 0;
        else
            a.value[0] = b.value[0] = b.value[0] > 0;
        status = vol_foreign_add_point(f, &made, a);
        if (status == VOL_OK)
            status = vol_foreign_add_point(f, &made, b);
    }
    if (status != VOL_OK) {
        vol_foreign_points_free(&made);
        return status;
    }
    vol_foreign_points_free(opacity);
    *opacity = made;
    return VOL_OK;
}

static VolStatus apply_alpha_mode(const VolForeign *f, const VolXml *xml, size_t function, VolForeignPoints *opacity)
{
    double mode = ALPHA_USED;
    bool ignored = false;
    VolStatus status = vol_foreign_child_number(f, xml, function, "alphaMode", "value", &mode);
    if (status == VOL_OK)
        status = read_bool(f, xml, function, "ignoreAlpha", &ignored);
    if (status != VOL_OK)
        return status;
    if (mode == ALPHA_OPAQUE || ignored) {
        status = make_opaque(f, opacity);
    } else if (mode == ALPHA_NONE) {
        vol_foreign_warn(f, "its alphaMode is 0: everything is transparent");
        for (size_t i = 0; i < opacity->count; i++)
            opacity->items[i].value[0] = 0;
    } else if (mode != ALPHA_USED) {
        return vol_foreign_fault(f, 0, "alphaMode %g is none of 0, 1, 2", mode);
    }
    return status;
}

static VolStatus apply_thresholds(const VolForeign *f, const VolXml *xml, size_t function, VolForeignPoints *opacity)
{
    double lo = 0, hi = 1;
    VolStatus status = vol_foreign_child_number(f, xml, function, "lower", "value", &lo);
    if (status == VOL_OK)
        status = vol_foreign_child_number(f, xml, function, "upper", "value", &hi);
    if (status == VOL_OK)
        status = vol_foreign_child_number(f, xml, function, "threshold", "x", &lo);
    if (status == VOL_OK)
        status = vol_foreign_child_number(f, xml, function, "threshold", "y", &hi);
    if (status != VOL_OK)
        return status;
    if (lo > hi)
        return vol_foreign_fault(f, 0, "its lower threshold %.9g is greater than the upper one, %.9g", lo, hi);
    return vol_foreign_cut(f, opacity, lo <= 0 ? -1e300 : lo, hi >= 1 ? 1e300 : hi);
}

static VolStatus apply_domain(const VolForeign *f, const VolXml *xml, size_t function, Keys *keys, bool *relative)
{
    double lo = 0, hi = 1;
    VolForeignPoints *lists[2] = {&keys->colors, &keys->opacity};
    VolStatus status = vol_foreign_child_number(f, xml, function, "domain", "x", &lo);
    if (status == VOL_OK)
        status = vol_foreign_child_number(f, xml, function, "domain", "y", &hi);
    if (status != VOL_OK)
        return status;
    if (!(lo < hi && lo >= -1e300 && hi <= 1e300))
        return vol_foreign_fault(f, 0, "its domain, %.9g to %.9g, is empty", lo, hi);
    *relative = lo == 0 && hi == 1;
    for (size_t k = 0; k < 2 && !*relative; k++)
        for (size_t i = 0; i < lists[k]->count; i++)
            lists[k]->items[i].v = lo * (1 - lists[k]->items[i].v) + hi * lists[k]->items[i].v;
    return VOL_OK;
}

static VolStatus read_function(const VolForeign *f, const VolXml *xml, size_t function, Keys *keys, VolTf *out,
                               bool *relative)
{
    double gamma = 1;
    VolStatus status = read_keys(f, xml, function, keys);
    if (status == VOL_OK)
        status = vol_foreign_child_number(f, xml, function, "gammaValue", "value", &gamma);
    if (status == VOL_OK && gamma != 1)
        vol_foreign_warn(f, "its gammaValue of %g is ignored", gamma);
    if (status != VOL_OK)
        return status;
    vol_foreign_sort(f, &keys->opacity, "its keys");
    vol_foreign_sort(f, &keys->colors, NULL); /* the same order */
    status = apply_alpha_mode(f, xml, function, &keys->opacity);
    if (status == VOL_OK)
        status = apply_thresholds(f, xml, function, &keys->opacity);
    if (status == VOL_OK)
        status = apply_domain(f, xml, function, keys, relative);
    if (status == VOL_OK)
        status = vol_foreign_finish(f, &keys->colors, VOL_COLOR_RGB, &keys->opacity, out);
    return status;
}

VolStatus vol_foreign_voreen(VolForeign *f, const VolXml *xml, VolTf *out, VolTfUnits *units)
{
    Keys keys = {0};
    size_t function = vol_xml_find(xml, "TransFuncIntensity", 0);
    VolStatus status = vol_foreign_no_parts(f);
    if (status == VOL_OK && !function && vol_xml_find(xml, "Volumes", 0))
        status = vol_foreign_fault(f, 0, "it describes a volume (.vvd): %s",
                                   "import the raw file that it names by vol-import --dims X,Y,Z --type TYPE");
    if (status == VOL_OK && !function)
        status = vol_foreign_fault(f, 0, "it has no <TransFuncIntensity>");
    if (status == VOL_OK)
        status = read_function(f, xml, function, &keys, out, &units->relative);
    units->step = VOL_STEP_BOX;
    out->particle_step = 1 / STEPS_ACROSS;
    vol_foreign_points_free(&keys.colors);
    vol_foreign_points_free(&keys.opacity);
    return status;
}
