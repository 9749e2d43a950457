/* A value changes sides where a knot or an isosurface lies between it and its float, less than a unit in the last place
 * away.  Buckets over the range of all of these tell quickly that none is near; the rest is found by search.  Knots are
 * taken to float upwards and isosurfaces to the nearest, as the kernels' tables are. */
#include "trace/sides.h"

#include <math.h>
#include <stdlib.h>

#include "base/mem.h"
#include "simd/real.h"

enum { BUCKETS = 8192 };

typedef struct Steps {
    double *at;
    float *in_float;
    size_t count;
} Steps;

struct VolSides {
    Steps knots, isosurfaces;
    double first, last, scale; /* buckets: (v - first) scale */
    unsigned char near[BUCKETS];
};

static VolStatus steps_new(size_t count, Steps *out, VolError *err)
{
    out->count = count;
    out->at = vol_alloc(count, sizeof *out->at);
    out->in_float = vol_alloc(count, sizeof *out->in_float);
    return out->at && out->in_float ? VOL_OK : vol_fail_memory(err, count * sizeof *out->at);
}

static size_t bucket_of(const VolSides *s, double v)
{
    double b = (v - s->first) * s->scale;
    return b > 0 ? b < BUCKETS - 1 ? (size_t)b : BUCKETS - 1 : 0;
}

static void mark_near(VolSides *s, const Steps *steps)
{
    for (size_t n = 0; n < steps->count; n++) {
        double margin = fabs(steps->at[n]) * 0x1p-22 + 0x1p-148;
        for (size_t b = bucket_of(s, steps->at[n] - margin); b <= bucket_of(s, steps->at[n] + margin); b++)
            s->near[b] = 1;
    }
}

static void widen(VolSides *s, const Steps *steps)
{
    for (size_t n = 0; n < steps->count; n++) {
        s->first = fmin(s->first, steps->at[n]);
        s->last = fmax(s->last, steps->at[n]);
    }
}

VolStatus vol_sides_new(const VolTfCompiled *tf, VolSides **out, VolError *err)
{
    VolSides *s = *out = vol_alloc_zero(1, sizeof *s);
    if (!s)
        return vol_fail_memory(err, sizeof *s);
    VolStatus status = steps_new(tf->knot_count, &s->knots, err);
    if (!status)
        status = steps_new(tf->isosurface_count, &s->isosurfaces, err);
    if (status)
        return status;
    for (size_t n = 0; n < tf->knot_count; n++) {
        s->knots.at[n] = tf->knots[n];
        s->knots.in_float[n] = real_at_or_above(tf->knots[n]);
    }
    for (size_t n = 0; n < tf->isosurface_count; n++) {
        double value = s->isosurfaces.at[n] = tf->isosurfaces[n].value;
        s->isosurfaces.in_float[n] =
            n > 0 ? real_in_order(s->isosurfaces.at[n - 1], s->isosurfaces.in_float[n - 1], value) : (float)value;
    }
    s->first = INFINITY;
    s->last = -INFINITY;
    widen(s, &s->knots);
    widen(s, &s->isosurfaces);
    double scale = BUCKETS / (s->last - s->first);
    s->scale = isfinite(scale) ? scale : 0;
    mark_near(s, &s->knots);
    mark_near(s, &s->isosurfaces);
    return VOL_OK;
}

void vol_sides_free(VolSides *s)
{
    if (!s)
        return;
    free(s->knots.at);
    free(s->knots.in_float);
    free(s->isosurfaces.at);
    free(s->isosurfaces.in_float);
    free(s);
}

/* Whether as many steps are at or below v as are at or below its float. */
static bool steps_agree(const Steps *steps, double v)
{
    size_t lo = 0, hi = steps->count;
    while (lo < hi) {
        size_t mid = (lo + hi) / 2;
        if (steps->at[mid] <= v)
            lo = mid + 1;
        else
            hi = mid;
    }
    float narrow = (float)v;
    return (lo == 0 || steps->in_float[lo - 1] <= narrow) && (lo == steps->count || steps->in_float[lo] > narrow);
}

static bool value_changes(const VolSides *s, double v)
{
    if (!isfinite(v) || (double)(float)v == v || !s->near[bucket_of(s, v)])
        return false;
    return !steps_agree(&s->knots, v) || !steps_agree(&s->isosurfaces, v);
}

bool vol_sides_change(const VolSides *s, const VolVolume *volume, size_t part)
{
    size_t count;
    const double *values = vol_volume_part_values(volume, part, &count);
    bool changes = false;
    for (size_t n = 0; n < count && !changes; n++)
        changes = value_changes(s, values[n]);
    return changes;
}
