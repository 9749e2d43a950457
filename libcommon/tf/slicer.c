/* 3D Slicer's volume rendering presets: <VolumeProperty> elements anywhere in an MRML scene, with everything in
 * attributes.  scalarOpacity is "COUNT v a v a ...", colorTransfer "COUNT v r g b ...": COUNT numbers follow.
 *
 * Slicer renders by VTK: opacities hold for scalarOpacityUnitDistance, which its presets do not have and VTK takes as 1.
 * Its images are, for VTK, of voxels of edge 1 - a matrix of the actor takes them to millimetres - and VTK's shaders step
 * along rays before that matrix, so that 1 is a voxel.  Values are those of the data, and with shade="1" every sample is
 * shaded by the gradient: the model `classic`. */
#include "tf/foreign_private.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/number.h"

#define WHITE_SPACE " \t\r\n"

typedef struct Numbers {
    double *values;
    size_t count;
} Numbers;

/* One number of a list: from *at, which moves behind it. */
static bool next_number(const char **at, double *out)
{
    char word[64];
    const char *begin = *at + strspn(*at, WHITE_SPACE);
    size_t length = strcspn(begin, WHITE_SPACE);
    *at = begin + length;
    if (!length || length >= sizeof word)
        return false;
    memcpy(word, begin, length);
    word[length] = 0;
    return vol_parse_real(word, out);
}

/* "COUNT x x x ...", as many as COUNT says and in groups of `group`. */
static VolStatus read_numbers(const VolForeign *f, const VolXml *xml, size_t element, const char *key, size_t group,
                              Numbers *out)
{
    size_t line = xml->elements[element].line;
    const char *text = vol_xml_attribute(xml, element, key);
    double count = 0;
    if (!text)
        return vol_foreign_fault(f, line, "'%s' is missing", key);
    if (!next_number(&text, &count) || !(count >= 0) || count != floor(count))
        return vol_foreign_fault(f, line, "'%s' does not begin with the count of its numbers", key);
    if (count > (double)strlen(text) / 2) /* each needs a space and a digit */
        return vol_foreign_fault(f, line, "'%s' has fewer than the %.0f numbers it promises", key, count);
    size_t n = (size_t)count;
    if (!n || n % group)
        return vol_foreign_fault(f, line, "'%s' has %zu numbers, which are not groups of %zu", key, n, group);
    out->values = vol_alloc(n, sizeof *out->values);
    if (!out->values)
        return vol_fail_memory(f->err, n * sizeof *out->values);
    for (; out->count < n; out->count++)
        if (!next_number(&text, &out->values[out->count]))
            return vol_foreign_fault(f, line, "number %zu of '%s' is missing or not a finite number", out->count + 1, key);
    if (text[strspn(text, WHITE_SPACE)])
        return vol_foreign_fault(f, line, "'%s' has more than the %zu numbers it promises", key, n);
    return VOL_OK;
}

static VolStatus read_opacity(const VolForeign *f, const VolXml *xml, size_t element, VolForeignPoints *out)
{
    Numbers n = {0};
    VolStatus status = read_numbers(f, xml, element, "scalarOpacity", 2, &n);
    for (size_t i = 0; i + 1 < n.count && status == VOL_OK; i += 2)
        status = vol_foreign_add_opacity(f, out, xml->elements[element].line, n.values[i], n.values[i + 1], 0.5, 0);
    free(n.values);
    return status;
}

static VolStatus read_colors(const VolForeign *f, const VolXml *xml, size_t element, VolForeignPoints *out)
{
    Numbers n = {0};
    VolStatus status = read_numbers(f, xml, element, "colorTransfer", 4, &n);
    for (size_t i = 0; i + 3 < n.count && status == VOL_OK; i += 4)
        status = vol_foreign_add_color(f, out, xml->elements[element].line, n.values[i], n.values[i + 1],
                                       n.values[i + 2], n.values[i + 3]);
    free(n.values);
    return status;
}

/* Opacity that depends on the gradient has no counterpart; where it is 1 throughout nothing is lost. */
static VolStatus check_gradient_opacity(const VolForeign *f, const VolXml *xml, size_t element)
{
    Numbers n = {0};
    if (!vol_xml_attribute(xml, element, "gradientOpacity"))
        return VOL_OK;
    VolStatus status = read_numbers(f, xml, element, "gradientOpacity", 2, &n);
    bool lost = false;
    for (size_t i = 0; i + 1 < n.count && status == VOL_OK; i += 2)
        lost |= n.values[i + 1] != 1;
    free(n.values);
    if (status == VOL_OK && lost)
        vol_foreign_warn(f, "gradientOpacity is ignored: opacity depends on the value alone");
    return status;
}

/* An attribute that may be missing, with a least value. */
static VolStatus read_setting(const VolForeign *f, const VolXml *xml, size_t element, const char *key, double *out)
{
    if (!vol_xml_attribute(xml, element, key))
        return VOL_OK;
    VolStatus status = vol_foreign_number(f, xml, element, key, out);
    if (status == VOL_OK && !(*out >= 0))
        return vol_foreign_fault(f, xml->elements[element].line, "'%s' %.9g is less than 0", key, *out);
    return status;
}

static VolStatus read_shading(const VolForeign *f, const VolXml *xml, size_t element, VolTf *out)
{
    double shade = 0, interpolation = 1;
    out->shininess = 10; /* VTK's default; the others are ours too */
    const struct {
        const char *key;
        double *to;
    } rows[] = {{"ambient", &out->ambient},
                {"diffuse", &out->diffuse},
                {"specular", &out->specular},
                {"specularPower", &out->shininess},
                {"scalarOpacityUnitDistance", &out->particle_step},
                {"shade", &shade},
                {"interpolation", &interpolation}};
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        VolStatus status = read_setting(f, xml, element, rows[i].key, rows[i].to);
        if (status != VOL_OK)
            return status;
    }
    if (!(out->particle_step > 0))
        return vol_foreign_fault(f, xml->elements[element].line, "'scalarOpacityUnitDistance' is not greater than 0");
    out->model = shade != 0 ? VOL_MODEL_CLASSIC : VOL_MODEL_UNSHADED;
    if (interpolation == 0)
        vol_foreign_note(f, "values are interpolated between voxels, which it switches off");
    return VOL_OK;
}

static VolStatus read_preset(const VolForeign *f, const VolXml *xml, size_t element, VolTf *out)
{
    VolForeignPoints colors = {0}, opacity = {0};
    VolStatus status = read_opacity(f, xml, element, &opacity);
    if (status == VOL_OK)
        status = read_colors(f, xml, element, &colors);
    if (status == VOL_OK)
        status = read_shading(f, xml, element, out);
    if (status == VOL_OK)
        status = check_gradient_opacity(f, xml, element);
    if (status == VOL_OK)
        status = vol_foreign_finish(f, &colors, VOL_COLOR_RGB, &opacity, out);
    vol_foreign_points_free(&colors);
    vol_foreign_points_free(&opacity);
    return status;
}

static bool is_preset(const VolXml *xml, size_t element)
{
    return strcmp(vol_xml_name(xml, element), "VolumeProperty") == 0;
}

VolStatus vol_foreign_slicer(VolForeign *f, const VolXml *xml, VolTf *out, VolTfUnits *units)
{
    const char **names = vol_alloc(xml->count, sizeof *names);
    size_t *elements = vol_alloc(xml->count, sizeof *elements), count = 0, chosen = 0;
    VolStatus status = names && elements ? VOL_OK : vol_fail_memory(f->err, xml->count * sizeof *names);
    for (size_t i = 0; status == VOL_OK && i < xml->count; i++) {
        if (!is_preset(xml, i))
            continue;
        const char *name = vol_xml_attribute(xml, i, "name");
        names[count] = name ? name : "";
        elements[count++] = i;
    }
    if (status == VOL_OK)
        status = vol_foreign_choose(f, "preset", names, count, &chosen);
    if (status == VOL_OK)
        status = read_preset(f, xml, elements[chosen], out);
    if (status == VOL_OK && !vol_xml_attribute(xml, elements[chosen], "scalarOpacityUnitDistance"))
        units->step = VOL_STEP_VOXEL;
    free(names);
    free(elements);
    return status;
}
