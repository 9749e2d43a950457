#include "trace/lights.h"

#include <string.h>

#include "base/fmath.h"
#include "base/number.h"

/* A float that can be multiplied a little. */
#define LARGEST 1e36

static const double PI = 3.14159265358979323846;

typedef struct Kind {
    const char *name, *form;
    VolLightKind kind;
    int values;
} Kind;

static const Kind kinds[] = {{"sun", "sun:DX,DY,DZ[:R,G,B]", VOL_LIGHT_SUN, 3},
                             {"point", "point:X,Y,Z[:R,G,B]", VOL_LIGHT_POINT, 3},
                             {"spot", "spot:X,Y,Z,DX,DY,DZ,DEG[:R,G,B]", VOL_LIGHT_SPOT, 7}};

VolLight vol_light_head(void)
{
    return (VolLight){.kind = VOL_LIGHT_HEAD, .rgb = {1, 1, 1}};
}

static VolStatus set_direction(const double d[3], const char *spec, VolLight *out, VolError *err)
{
    VolVec3 v = {d[0], d[1], d[2]};
    double length = vol_length(v);
    if (!(length > 0) || !isfinite(length))
        return vol_fail(err, VOL_USAGE, "light '%s': its direction has no length", spec);
    out->direction = vol_scale(v, 1 / length);
    return VOL_OK;
}

/* Full angle DEG; the last tenth of the half angle fades out. */
static VolStatus set_cone(double degrees, const char *spec, VolLight *out, VolError *err)
{
    if (!(degrees > 0 && degrees <= 180))
        return vol_fail(err, VOL_USAGE, "light '%s': its angle lies outside (0, 180]", spec);
    double half = degrees * (PI / 360);
    out->cos_edge = vol_cos(half);
    out->cos_full = vol_cos(0.9 * half);
    return VOL_OK;
}

static VolStatus set_color(const char *text, const char *spec, VolLight *out, VolError *err)
{
    out->rgb[0] = out->rgb[1] = out->rgb[2] = 1;
    if (!text)
        return VOL_OK;
    if (vol_parse_reals(text, out->rgb, 3, 3) != 3)
        return vol_fail(err, VOL_USAGE, "light '%s': '%s' is not a colour R,G,B", spec, text);
    for (int c = 0; c < 3; c++)
        if (!(out->rgb[c] >= 0 && out->rgb[c] <= LARGEST))
            return vol_fail(err, VOL_USAGE, "light '%s': a colour is %s", spec,
                            out->rgb[c] < 0 ? "negative" : "brighter than 1e36");
    return VOL_OK;
}

static VolStatus set_place(const Kind *kind, const double v[7], const char *spec, VolLight *out, VolError *err)
{
    if (kind->kind == VOL_LIGHT_SUN)
        return set_direction(v, spec, out, err);
    for (int a = 0; a < 3; a++)
        if (!(fabs(v[a]) <= LARGEST))
            return vol_fail(err, VOL_USAGE, "light '%s': it lies farther out than 1e36", spec);
    out->position = vol_vec3(v[0], v[1], v[2]);
    if (kind->kind == VOL_LIGHT_POINT)
        return VOL_OK;
    VolStatus status = set_direction(v + 3, spec, out, err);
    return status ? status : set_cone(v[6], spec, out, err);
}

VolStatus vol_light_parse(const char *spec, VolLight *out, VolError *err)
{
    char copy[512];
    if (strlen(spec) >= sizeof copy)
        return vol_fail(err, VOL_USAGE, "light '%.40s...' is too long", spec);
    memcpy(copy, spec, strlen(spec) + 1);
    char *values = strchr(copy, ':');
    if (values)
        *values++ = 0;
    char *color = values ? strchr(values, ':') : NULL;
    if (color)
        *color++ = 0;
    for (size_t i = 0; i < sizeof kinds / sizeof *kinds; i++) {
        const Kind *kind = &kinds[i];
        if (strcmp(copy, kind->name) != 0)
            continue;
        double v[7];
        *out = (VolLight){.kind = kind->kind};
        if (!values || vol_parse_reals(values, v, kind->values, kind->values) != kind->values)
            return vol_fail(err, VOL_USAGE, "light '%s': want %s", spec, kind->form);
        VolStatus status = set_place(kind, v, spec, out, err);
        return status ? status : set_color(color, spec, out, err);
    }
    return vol_fail(err, VOL_USAGE, "light '%s': unknown kind '%s' (sun, point, spot)", spec, copy);
}
