/* Inviwo's .itf: <InviwoTreeData> with maskMin, maskMax and a list of points, each a position and a colour with opacity.
 * The list and its points have had three names, and a position two forms:
 *
 *     <dataPoints><point><pos x="0.5" y="1"/><rgba x="1" y="0" z="0" w="0.2"/></point> ...
 *     <Points><Point><pos content="0.5"/><rgba .../></Point> ...
 *     <type content="0"/><TFPrimitives><TFPrimitive> ...
 *
 * Colour and opacity are linear between points and constant beyond the ends; outside the mask opacity is 0.  Positions are
 * fractions of the data's range, or values where type is 1 (Absolute).  Opacities hold for 1/150 of the volume's edge: its
 * shaders (compositing.glsl, REF_SAMPLING_INTERVAL) measure rays in texture coordinates, from 0 to 1 across the volume. */
#include "tf/foreign_private.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define STEPS_ACROSS 150.0

static size_t find_points(const VolXml *xml)
{
    static const char *const names[] = {"dataPoints", "Points", "TFPrimitives"};
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        size_t found = vol_xml_find(xml, names[i], 0);
        if (found)
            return found;
    }
    return 0;
}

static VolStatus read_point(const VolForeign *f, const VolXml *xml, size_t element, VolForeignPoints *colors,
                            VolForeignPoints *opacity)
{
    static const char *const keys[4] = {"x", "y", "z", "w"};
    size_t line = xml->elements[element].line;
    size_t pos = vol_xml_child(xml, element, "pos", 0), rgba = vol_xml_child(xml, element, "rgba", 0);
    double v = 0, c[4] = {0};
    if (!pos || !rgba)
        return vol_foreign_fault(f, line, "point %zu has no <%s>", colors->count + 1, pos ? "rgba" : "pos");
    VolStatus status = vol_foreign_number(f, xml, pos, vol_xml_attribute(xml, pos, "content") ? "content" : "x", &v);
    for (int i = 0; i < 4 && status == VOL_OK; i++)
        status = vol_foreign_number(f, xml, rgba, keys[i], &c[i]);
    if (status == VOL_OK)
        status = vol_foreign_add_color(f, colors, line, v, c[0], c[1], c[2]);
    if (status == VOL_OK)
        status = vol_foreign_add_opacity(f, opacity, line, v, c[3], 0.5, 0);
    return status;
}

static VolStatus read_points(const VolForeign *f, const VolXml *xml, VolForeignPoints *colors,
                             VolForeignPoints *opacity)
{
    size_t list = find_points(xml);
    VolStatus status = VOL_OK;
    if (!list)
        return vol_foreign_fault(f, 0, "it has no list of points: <dataPoints>, <Points> or <TFPrimitives>");
    for (size_t at = vol_xml_child(xml, list, NULL, 0); at && status == VOL_OK; at = vol_xml_child(xml, list, NULL, at))
        status = read_point(f, xml, at, colors, opacity);
    if (status == VOL_OK && !colors->count)
        return vol_foreign_fault(f, xml->elements[list].line, "its list of points is empty");
    return status;
}

static VolStatus read_type(const VolForeign *f, const VolXml *xml, size_t holder, bool *relative)
{
    size_t at = vol_xml_child(xml, holder, "type", 0);
    const char *text = at ? vol_xml_attribute(xml, at, "content") : "0";
    bool absolute = text && (strcmp(text, "1") == 0 || strcmp(text, "Absolute") == 0);
    if (!absolute && (!text || (strcmp(text, "0") != 0 && strcmp(text, "Relative") != 0)))
        return vol_foreign_fault(f, xml->elements[at].line,
                                 "the type of its positions is neither 0 (relative) nor 1 (absolute)");
    *relative = !absolute;
    return VOL_OK;
}

/* The element that holds the list: the root, save in files with a <TransferFunction>. */
static size_t holder_of(const VolXml *xml, size_t list)
{
    size_t holder = 0;
    for (size_t i = 0; i < list; i++)
        if (xml->elements[i].end > list)
            holder = i;
    return holder;
}

/* No mask is written as the largest double, which rounded to 15 digits is larger still. */
static VolStatus read_limit(const VolForeign *f, const VolXml *xml, size_t holder, const char *child, double *out)
{
    size_t at = vol_xml_child(xml, holder, child, 0);
    const char *text = at ? vol_xml_attribute(xml, at, "content") : NULL;
    char *end = NULL;
    double limit = text ? strtod(text, &end) : 0;
    if (text && end != text && !*end && isinf(limit)) {
        *out = limit;
        return VOL_OK;
    }
    return vol_foreign_child_number(f, xml, holder, child, "content", out);
}

static VolStatus read_mask(const VolForeign *f, const VolXml *xml, size_t holder, bool relative,
                           VolForeignPoints *opacity)
{
    double lo = relative ? 0 : -1e300, hi = relative ? 1 : 1e300;
    VolStatus status = read_limit(f, xml, holder, "maskMin", &lo);
    if (status == VOL_OK)
        status = read_limit(f, xml, holder, "maskMax", &hi);
    if (status != VOL_OK)
        return status;
    if (lo > hi)
        return vol_foreign_fault(f, 0, "maskMin %.9g is greater than maskMax %.9g", lo, hi);
    if (relative) { /* there is nothing beyond 0 and 1 to be cut off */
        lo = lo <= 0 ? -1e300 : lo;
        hi = hi >= 1 ? 1e300 : hi;
    }
    vol_foreign_sort(f, opacity, "its points");
    return vol_foreign_cut(f, opacity, lo, hi);
}

VolStatus vol_foreign_inviwo(VolForeign *f, const VolXml *xml, VolTf *out, VolTfUnits *units)
{
    VolForeignPoints colors = {0}, opacity = {0};
    VolStatus status = vol_foreign_no_parts(f);
    if (status == VOL_OK)
        status = read_points(f, xml, &colors, &opacity);
    size_t holder = status == VOL_OK ? holder_of(xml, find_points(xml)) : 0;
    if (status == VOL_OK)
        status = read_type(f, xml, holder, &units->relative);
    if (status == VOL_OK)
        status = read_mask(f, xml, holder, units->relative, &opacity);
    *units = (VolTfUnits){units->relative, VOL_STEP_BOX};
    out->particle_step = 1 / STEPS_ACROSS;
    if (status == VOL_OK) {
        vol_foreign_sort(f, &colors, NULL); /* the same order, already warned of */
        status = vol_foreign_finish(f, &colors, VOL_COLOR_RGB, &opacity, out);
    }
    vol_foreign_points_free(&colors);
    vol_foreign_points_free(&opacity);
    return status;
}
