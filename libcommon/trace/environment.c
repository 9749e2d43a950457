#include "trace/environment.h"

#include <stdlib.h>
#include <string.h>

#include "base/fmath.h"
#include "base/mem.h"
#include "base/number.h"

static const double PI = 3.14159265358979323846, LARGEST = 1e36;

/* ---- Specification ---- */

VolStatus vol_environment_parse(const char *spec, bool *is_one, char **file, double factor[3], VolError *err)
{
    *file = NULL;
    factor[0] = factor[1] = factor[2] = 1;
    *is_one = strncmp(spec, "env:", 4) == 0;
    if (!*is_one)
        return VOL_OK;
    const char *name = spec + 4, *color = strrchr(name, ':');
    double given[3];
    size_t length = strlen(name);
    if (color && vol_parse_reals(color + 1, given, 3, 3) == 3) { /* else the colon is part of the name */
        memcpy(factor, given, sizeof given);
        length = (size_t)(color - name);
    }
    if (!length)
        return vol_fail(err, VOL_USAGE, "light '%s': want env:FILE[:R,G,B]", spec);
    for (int c = 0; c < 3; c++)
        if (!(factor[c] >= 0 && factor[c] <= LARGEST))
            return vol_fail(err, VOL_USAGE, "light '%s': a colour is %s", spec,
                            factor[c] < 0 ? "negative" : "brighter than 1e36");
    *file = vol_copy_text(name);
    if (!*file)
        return vol_fail_memory(err, length + 1);
    (*file)[length] = 0;
    return VOL_OK;
}

/* ---- The picture ---- */

static VolStatus take_pixels(const float *pixels, int channels, const char *name, VolEnvironment *out, bool *dark,
                             VolError *err)
{
    for (int y = 0; y < out->height; y++)
        for (int x = 0; x < out->width; x++) {
            size_t pixel = (size_t)y * (size_t)out->width + (size_t)x;
            for (int c = 0; c < 3; c++) {
                float value = pixels[pixel * (size_t)channels + (size_t)(channels < 3 ? 0 : c)];
                if (!(value >= 0) || isinf(value))
                    return vol_fail(err, VOL_BAD_INPUT, "bad environment '%s': the pixel in column %d of row %d is %s", name,
                                    x, y, value < 0 && !isinf(value) ? "negative" : "not a finite number");
                if ((double)value * out->factor[c] > LARGEST)
                    return vol_fail(err, VOL_BAD_INPUT, "bad environment '%s': the pixel in column %d of row %d is %s", name,
                                    x, y, "brighter than 1e36");
                out->rgb[3 * pixel + (size_t)c] = value;
                *dark = *dark && !((double)value * out->factor[c] > 0);
            }
        }
    return VOL_OK;
}

/* (cos a - cos b) 2 pi / width between the row's edges a and b. */
static double solid_angle(int width, int height, int row)
{
    double half = PI / (2 * (double)height);
    return 2 * vol_sin((2 * row + 1) * half) * vol_sin(half) * (2 * PI / width);
}

VolStatus vol_environment_new(const float *pixels, int channels, int width, int height, const double factor[3],
                              const char *name, const VolLog *log, VolEnvironment *out, VolError *err)
{
    size_t count = (size_t)width * (size_t)height;
    bool dark = true;
    *out = (VolEnvironment){.width = width, .height = height, .factor = {factor[0], factor[1], factor[2]}};
    out->rgb = vol_alloc(count, 3 * sizeof *out->rgb);
    out->solid_angle = vol_alloc((size_t)height, sizeof *out->solid_angle);
    VolStatus status = out->rgb && out->solid_angle ? take_pixels(pixels, channels, name, out, &dark, err)
                                                    : vol_fail_memory(err, count * 3 * sizeof *out->rgb);
    for (int y = 0; y < height && !status; y++)
        out->solid_angle[y] = solid_angle(width, height, y);
    if (status)
        vol_environment_free(out);
    else if (dark)
        vol_warn(log, "environment '%s' is black", name);
    return status;
}

void vol_environment_free(VolEnvironment *environment)
{
    free(environment->rgb);
    free(environment->solid_angle);
    *environment = (VolEnvironment){0};
}

VolVec3 vol_environment_direction(const VolEnvironment *environment, double column, double row)
{
    double from_top = PI * row / environment->height, longitude = PI * (1 - 2 * column / environment->width);
    double across = vol_sin(from_top);
    return vol_vec3(across * vol_sin(longitude), vol_cos(from_top), across * vol_cos(longitude));
}

/* ---- Regions ---- */

typedef struct Region {
    int x0, y0, x1, y1; /* columns x0 to x1 - 1 */
    double power;       /* luminance */
} Region;

static double radiance(const VolEnvironment *e, int x, int y, int channel)
{
    return (double)e->rgb[3 * ((size_t)y * (size_t)e->width + (size_t)x) + (size_t)channel] * e->factor[channel];
}

static double luminance(const VolEnvironment *e, int x, int y)
{
    return 0.2126 * radiance(e, x, y, 0) + 0.7152 * radiance(e, x, y, 1) + 0.0722 * radiance(e, x, y, 2);
}

static double power_of(const VolEnvironment *e, int x0, int y0, int x1, int y1)
{
    double sum = 0;
    for (int y = y0; y < y1; y++) {
        double of_row = 0;
        for (int x = x0; x < x1; x++)
            of_row += luminance(e, x, y);
        sum += of_row * e->solid_angle[y];
    }
    return sum;
}

static Region region_of(const VolEnvironment *e, int x0, int y0, int x1, int y1)
{
    return (Region){x0, y0, x1, y1, power_of(e, x0, y0, x1, y1)};
}

/* Across its longer side, as long as it is in its middle; where the halves are most alike, the first such place. */
static void cut(const VolEnvironment *e, Region *region, Region *other)
{
    Region r = *region;
    int columns = r.x1 - r.x0, rows = r.y1 - r.y0, at = 1;
    double wide = columns * (2 * PI / e->width) * vol_sin(PI * (r.y0 + r.y1) / (2 * (double)e->height));
    double tall = rows * PI / e->height, before = 0, least = INFINITY;
    bool by_columns = rows == 1 || (columns > 1 && wide >= tall);
    for (int n = 1; n < (by_columns ? columns : rows); n++) {
        before += by_columns ? power_of(e, r.x0 + n - 1, r.y0, r.x0 + n, r.y1)
                             : power_of(e, r.x0, r.y0 + n - 1, r.x1, r.y0 + n);
        if (fabs(r.power - 2 * before) < least) {
            least = fabs(r.power - 2 * before);
            at = n;
        }
    }
    *region = by_columns ? region_of(e, r.x0, r.y0, r.x0 + at, r.y1) : region_of(e, r.x0, r.y0, r.x1, r.y0 + at);
    *other = by_columns ? region_of(e, r.x0 + at, r.y0, r.x1, r.y1) : region_of(e, r.x0, r.y0 + at, r.x1, r.y1);
}

/* Brightest first; then by row, then by column. */
static int compare(const void *left, const void *right)
{
    const Region *a = left, *b = right;
    if (a->power != b->power)
        return a->power > b->power ? -1 : 1;
    return a->y0 != b->y0 ? (a->y0 < b->y0 ? -1 : 1) : a->x0 != b->x0 ? (a->x0 < b->x0 ? -1 : 1) : 0;
}

static size_t cut_all(const VolEnvironment *e, size_t most, Region *regions)
{
    size_t count = 1;
    regions[0] = region_of(e, 0, 0, e->width, e->height);
    while (count < most) {
        Region *next = NULL;
        for (size_t n = 0; n < count; n++) {
            Region *r = &regions[n];
            bool single = r->x1 - r->x0 == 1 && r->y1 - r->y0 == 1;
            if (!single && r->power > 0 && (!next || compare(r, next) < 0))
                next = r;
        }
        if (!next)
            break;
        cut(e, next, &regions[count++]);
    }
    qsort(regions, count, sizeof *regions, compare);
    while (count && !(regions[count - 1].power > 0))
        count--;
    return count;
}

/* Of the pixels' middles; where they cancel, that of the region's own middle. */
static VolLight sun_of(const VolEnvironment *e, const Region *r)
{
    VolLight sun = {.kind = VOL_LIGHT_SUN};
    VolVec3 from = {0, 0, 0};
    for (int y = r->y0; y < r->y1; y++) {
        double angle = e->solid_angle[y];
        for (int x = r->x0; x < r->x1; x++) {
            from = vol_along(from, luminance(e, x, y) / r->power * angle, vol_environment_direction(e, x + 0.5, y + 0.5));
            for (int c = 0; c < 3; c++)
                sun.rgb[c] += radiance(e, x, y, c) * angle / (4 * PI);
        }
    }
    double length = vol_length(from);
    if (length > 1e-6)
        from = vol_scale(from, 1 / length);
    else
        from = vol_environment_direction(e, 0.5 * (r->x0 + r->x1), 0.5 * (r->y0 + r->y1));
    sun.direction = vol_scale(from, -1);
    return sun;
}

void vol_environment_power(const VolEnvironment *environment, double rgb[3])
{
    rgb[0] = rgb[1] = rgb[2] = 0;
    for (int y = 0; y < environment->height; y++)
        for (int x = 0; x < environment->width; x++)
            for (int c = 0; c < 3; c++)
                rgb[c] += radiance(environment, x, y, c) * environment->solid_angle[y];
}

VolStatus vol_environment_suns(const VolEnvironment *environment, size_t most, VolLight *suns, size_t *count, VolError *err)
{
    *count = 0;
    if (!most)
        return VOL_OK;
    Region *regions = vol_alloc(most, sizeof *regions);
    if (!regions)
        return vol_fail_memory(err, most * sizeof *regions);
    *count = cut_all(environment, most, regions);
    for (size_t n = 0; n < *count; n++)
        suns[n] = sun_of(environment, &regions[n]);
    free(regions);
    return VOL_OK;
}

/* ---- Drawing directions ---- */

VolStatus vol_environment_sampler_new(const VolEnvironment *environment, VolEnvironmentSampler *out, VolError *err)
{
    const VolEnvironment *e = environment;
    size_t width = (size_t)e->width, height = (size_t)e->height;
    *out = (VolEnvironmentSampler){.environment = e};
    out->rows = vol_alloc_zero(height + 1, sizeof *out->rows);
    out->columns = vol_alloc_zero(height, (width + 1) * sizeof *out->columns);
    if (!out->rows || !out->columns) {
        vol_environment_sampler_free(out);
        return vol_fail_memory(err, height * (width + 1) * sizeof *out->columns);
    }
    for (size_t y = 0; y < height; y++) {
        double *row = out->columns + y * (width + 1);
        for (size_t x = 0; x < width; x++)
            row[x + 1] = row[x] + luminance(e, (int)x, (int)y);
        out->rows[y + 1] = out->rows[y] + row[width] * e->solid_angle[y];
    }
    return VOL_OK;
}

void vol_environment_sampler_free(VolEnvironmentSampler *sampler)
{
    free(sampler->rows);
    free(sampler->columns);
    *sampler = (VolEnvironmentSampler){0};
}

/* The step of an ascending sum that holds u of all of it, and where in the step, 0 to 1. */
static int find_step(const double *sum, int steps, double u, double *within)
{
    double at = u * sum[steps];
    int below = 0, above = steps; /* sum[below] <= at, and < sum[above] but for rounding */
    while (above - below > 1) {
        int middle = below + (above - below) / 2;
        if (sum[middle] <= at)
            below = middle;
        else
            above = middle;
    }
    double step = sum[below + 1] - sum[below];
    *within = step > 0 ? fmin(fmax((at - sum[below]) / step, 0), 1) : 0.5;
    return below;
}

static VolFromAround from_pixel(const VolEnvironmentSampler *sampler, int x, int y, VolVec3 from)
{
    const VolEnvironment *e = sampler->environment;
    VolFromAround out = {.from = from};
    double total = sampler->rows[e->height];
    for (int c = 0; c < 3; c++)
        out.rgb[c] = radiance(e, x, y, c);
    out.density = total > 0 ? luminance(e, x, y) / total : 0;
    return out;
}

VolFromAround vol_environment_sample(const VolEnvironmentSampler *sampler, double u, double v)
{
    const VolEnvironment *e = sampler->environment;
    double down, along;
    if (!(sampler->rows[e->height] > 0))
        return (VolFromAround){.from = {0, 1, 0}};
    int y = find_step(sampler->rows, e->height, u, &down);
    int x = find_step(sampler->columns + (size_t)y * ((size_t)e->width + 1), e->width, v, &along);
    /* Even in solid angle is even in the cosine from the top. */
    double top = vol_cos(PI * y / e->height), bottom = vol_cos(PI * (y + 1) / e->height);
    double cosine = top + down * (bottom - top), across = sqrt(fmax((1 - cosine) * (1 + cosine), 0));
    double longitude = PI * (1 - 2 * (x + along) / e->width);
    return from_pixel(sampler, x, y, vol_vec3(across * vol_sin(longitude), cosine, across * vol_cos(longitude)));
}

VolFromAround vol_environment_from(const VolEnvironmentSampler *sampler, VolVec3 direction)
{
    const VolEnvironment *e = sampler->environment;
    double row = vol_acos(fmin(fmax(direction.y, -1), 1)) / PI * e->height;
    double column = (1 - vol_atan2(direction.x, direction.z) / PI) * 0.5 * e->width;
    int x = (int)column, y = (int)row;
    return from_pixel(sampler, x < e->width ? x : e->width - 1, y < e->height ? y : e->height - 1, direction);
}
