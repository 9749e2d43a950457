#include "procedural/field.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/fmath.h"
#include "base/mem.h"
#include "base/number.h"
#include "procedural/noise.h"

#define PI 3.14159265358979323846

static double clamp01(double t) { return t < 0 ? 0 : t > 1 ? 1 : t; }

/* 1 where `inside` (a distance, positive inside) is large, 0 where it is negative, smoothstep over a shell of
 * width `edge` centred on the boundary; a jump for edge 0 (the boundary itself belongs to the inside). */
static double soft_step(double inside, double edge)
{
    if (edge <= 0)
        return inside >= 0 ? 1 : 0;
    double t = clamp01(inside / edge + 0.5);
    return t * t * (3 - 2 * t);
}

static double distance_to(const double *centre, VolVec3 x)
{
    return vol_length(vol_sub(x, vol_vec3(centre[0], centre[1], centre[2])));
}

static double along_axis(double axis, VolVec3 x) { return axis < 0.5 ? x.x : axis < 1.5 ? x.y : x.z; }

static double field_constant(const double *p, uint64_t seed, VolVec3 x)
{
    (void)seed, (void)x;
    return p[0];
}

static double field_ramp(const double *p, uint64_t seed, VolVec3 x)
{
    (void)seed;
    return p[0] * x.x + p[1] * x.y + p[2] * x.z + p[3];
}

static double field_sphere(const double *p, uint64_t seed, VolVec3 x)
{
    (void)seed;
    return p[5] * soft_step(p[3] - distance_to(p, x), p[4]);
}

static double field_radius(const double *p, uint64_t seed, VolVec3 x)
{
    (void)seed;
    return distance_to(p, x) - p[3];
}

static double field_r2(const double *p, uint64_t seed, VolVec3 x)
{
    (void)seed;
    VolVec3 d = vol_sub(x, vol_vec3(p[0], p[1], p[2]));
    return p[3] * vol_dot(d, d);
}

static double field_torus(const double *p, uint64_t seed, VolVec3 x)
{
    (void)seed;
    double from_ring = sqrt(x.x * x.x + x.y * x.y) - p[0];
    return p[3] * soft_step(p[1] - sqrt(from_ring * from_ring + x.z * x.z), p[2]);
}

static double field_gaussian(const double *p, uint64_t seed, VolVec3 x)
{
    (void)seed;
    double r = distance_to(p, x) / p[3];
    return p[4] * vol_exp(-0.5 * r * r);
}

/* Marschner and Lobb 1994: (1 - sin(pi z/2) + alpha (1 + rho(sqrt(x^2 + y^2)))) / (2 (1 + alpha)),
 * rho(r) = cos(2 pi fM cos(pi r/2)) */
static double field_marschner_lobb(const double *p, uint64_t seed, VolVec3 x)
{
    (void)seed;
    double fm = p[0], alpha = p[1], r = sqrt(x.x * x.x + x.y * x.y);
    double rho = vol_cos(2 * PI * fm * vol_cos(PI * r / 2));
    return (1 - vol_sin(PI * x.z / 2) + alpha * (1 + rho)) / (2 * (1 + alpha));
}

static double field_slab(const double *p, uint64_t seed, VolVec3 x)
{
    (void)seed;
    double t = along_axis(p[0], x);
    return t >= p[1] && t <= p[2] ? p[3] : p[4];
}

/* Up to three slabs one behind the other, each half open, from `start` upwards. */
static double field_slabs(const double *p, uint64_t seed, VolVec3 x)
{
    (void)seed;
    double t = along_axis(p[0], x) - p[1];
    for (int i = 0; i < 3 && t >= 0; i++) {
        if (t < p[2 + 2 * i])
            return p[3 + 2 * i];
        t -= p[2 + 2 * i];
    }
    return 0;
}

static double field_atmosphere(const double *p, uint64_t seed, VolVec3 x)
{
    (void)seed;
    return p[3] * vol_exp(-(along_axis(p[0], x) - p[1]) / p[2]);
}

static double field_wave(const double *p, uint64_t seed, VolVec3 x)
{
    (void)seed;
    /* In turns, less their whole number: cos is exact at quarter turns of whole waves and good far away. */
    double turns = p[0] * x.x + p[1] * x.y + p[2] * x.z + p[3];
    return p[5] + p[4] * vol_cos(2 * PI * (turns - nearbyint(turns)));
}

static double field_noise(const double *p, uint64_t seed, VolVec3 x)
{
    int octaves = (int)fmin(32, fmax(1, p[1]));
    return p[5] + p[4] * vol_fbm(seed, vol_scale(x, p[0]), octaves, p[2], p[3]);
}

#define CENTRE {"cx", 0, "centre"}, {"cy", 0, "centre"}, {"cz", 0, "centre"}
#define AXIS {"axis", 2, "0: x, 1: y, 2: z"}

static const VolField fields[] = {
    {"constant", "the same value everywhere", field_constant, {{"value", 1, "the value"}}},
    {"ramp",
     "gx x + gy y + gz z + offset",
     field_ramp,
     {{"gx", 0, "gradient"},
      {"gy", 0, "gradient"},
      {"gz", 0.5, "gradient"},
      {"offset", 0.5, "value at the origin"}}},
    {"sphere",
     "value inside a sphere, 0 outside",
     field_sphere,
     {CENTRE,
      {"radius", 0.75, "radius"},
      {"edge", 0, "width of the smooth edge; 0: a jump"},
      {"value", 1, "value inside"}}},
    {"radius",
     "distance from the centre, less radius: a signed distance",
     field_radius,
     {CENTRE, {"radius", 0, "subtracted"}}},
    {"r2", "square of the distance from the centre", field_r2, {CENTRE, {"value", 1, "factor"}}},
    {"torus",
     "value inside a torus around z, 0 outside",
     field_torus,
     {{"major", 0.6, "radius of the ring"},
      {"minor", 0.25, "radius of the tube"},
      {"edge", 0.1, "width of the smooth edge; 0: a jump"},
      {"value", 1, "value inside"}}},
    {"gaussian",
     "value exp(-r^2 / (2 s^2))",
     field_gaussian,
     {CENTRE, {"s", 0.3, "standard deviation"}, {"value", 1, "value at the centre"}}},
    {"marschner-lobb",
     "the test signal of Marschner and Lobb 1994",
     field_marschner_lobb,
     {{"fm", 6, "frequency"}, {"alpha", 0.25, "amplitude"}}},
    {"slab",
     "value where lo <= t <= hi along an axis",
     field_slab,
     {AXIS,
      {"lo", -0.5, "begin"},
      {"hi", 0.5, "end"},
      {"value", 1, "value inside"},
      {"outside", 0, "value outside"}}},
    {"slabs",
     "up to three slabs one behind the other along an axis, 0 elsewhere",
     field_slabs,
     {AXIS,
      {"start", -1, "begin of the first"},
      {"length1", 1, "thickness"},
      {"value1", 1, "value"},
      {"length2", 0.5, "thickness"},
      {"value2", 2, "value"},
      {"length3", 0, "thickness"},
      {"value3", 0, "value"}}},
    {"atmosphere",
     "value exp(-(t - t0) / height) along an axis",
     field_atmosphere,
     {AXIS,
      {"t0", -1, "where the value is reached"},
      {"height", 0.5, "scale height"},
      {"value", 1, "value at t0"}}},
    {"wave",
     "offset + value cos(2 pi (k.x + phase))",
     field_wave,
     {{"kx", 1, "waves per unit length"},
      {"ky", 0, "waves per unit length"},
      {"kz", 0, "waves per unit length"},
      {"phase", 0, "in turns"},
      {"value", 1, "amplitude"},
      {"offset", 0, "mean"}}},
    {"noise",
     "fractal sum of seeded gradient noise (--seed)",
     field_noise,
     {{"frequency", 2, "of the first octave, per unit length"},
      {"octaves", 4, "1 to 32"},
      {"lacunarity", 2, "ratio of frequencies"},
      {"gain", 0.5, "ratio of weights"},
      {"value", 0.5, "amplitude"},
      {"offset", 0.5, "mean"}}},
};

size_t vol_field_count(void) { return sizeof fields / sizeof *fields; }
const VolField *vol_field_at(size_t i) { return &fields[i]; }

VolStatus vol_field_find(const char *name, VolFieldCase *out, VolError *err)
{
    char names[512];
    size_t used = 0;
    for (size_t i = 0; i < vol_field_count(); i++) {
        if (strcmp(fields[i].name, name) == 0) {
            *out = (VolFieldCase){.field = &fields[i]};
            for (int k = 0; k < VOL_FIELD_PARAMS; k++)
                out->p[k] = fields[i].params[k].fallback;
            return VOL_OK;
        }
        int n = snprintf(names + used, sizeof names - used, "%s%s", i ? ", " : "", fields[i].name);
        used = n > 0 && used + (size_t)n < sizeof names ? used + (size_t)n : sizeof names - 1;
    }
    return vol_fail(err, VOL_USAGE, "unknown field '%s': there are %s", name, names);
}

/* A positive quantity that a field divides by, or a whole number that it counts with. */
static VolStatus check_param(const VolField *field, const char *name, double value, VolError *err)
{
    bool divisor = strcmp(name, "s") == 0 || strcmp(name, "height") == 0;
    if (divisor && !(value > 0))
        return vol_fail(err, VOL_USAGE, "field '%s': parameter %s is to be greater than 0", field->name, name);
    double most = strcmp(name, "axis") == 0 ? 2 : strcmp(name, "octaves") == 0 ? 32 : 0;
    double least = strcmp(name, "octaves") == 0 ? 1 : 0;
    if (most > 0 && !(value >= least && value <= most && value == floor(value)))
        return vol_fail(err, VOL_USAGE, "field '%s': parameter %s is a whole number from %g to %g", field->name,
                        name, least, most);
    if (strcmp(name, "alpha") == 0 && value == -1)
        return vol_fail(err, VOL_USAGE, "field '%s': parameter alpha may not be -1", field->name);
    return VOL_OK;
}

VolStatus vol_field_set(VolFieldCase *field, const char *assignment, VolError *err)
{
    const VolFieldParam *params = field->field->params;
    const char *equals = strchr(assignment, '=');
    if (!equals || equals == assignment)
        return vol_fail(err, VOL_USAGE, "parameter '%s': not NAME=VALUE", assignment);
    double value;
    if (!vol_parse_real(equals + 1, &value))
        return vol_fail(err, VOL_USAGE, "parameter '%s': the value is not a finite number", assignment);

    char names[512] = "none";
    size_t used = 0;
    for (int i = 0; i < VOL_FIELD_PARAMS && params[i].name; i++) {
        if (strncmp(params[i].name, assignment, (size_t)(equals - assignment)) == 0 &&
            params[i].name[equals - assignment] == 0) {
            field->p[i] = value;
            return check_param(field->field, params[i].name, value, err);
        }
        int n = snprintf(names + used, sizeof names - used, "%s%s", i ? ", " : "", params[i].name);
        used = n > 0 && used + (size_t)n < sizeof names ? used + (size_t)n : sizeof names - 1;
    }
    return vol_fail(err, VOL_USAGE, "field '%s' has no parameter '%.*s': there are %s", field->field->name,
                    (int)(equals - assignment), assignment, names);
}

char *vol_field_list(void)
{
    char *text = vol_copy_text("");
    for (size_t i = 0; text && i < vol_field_count(); i++) {
        const VolField *f = &fields[i];
        char *longer = vol_format_text("%s%-15s %s\n", text, f->name, f->summary);
        free(text);
        text = longer;
        for (int k = 0; text && k < VOL_FIELD_PARAMS && f->params[k].name; k++) {
            longer = vol_format_text("%s    %s=%.17g  %s\n", text, f->params[k].name, f->params[k].fallback,
                                     f->params[k].help);
            free(text);
            text = longer;
        }
    }
    return text;
}
