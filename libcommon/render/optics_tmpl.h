/* The compiled transfer function in the kernel's precision.  Include real.h first. */
#ifndef VOL_RENDER_OPTICS_TMPL_H
#define VOL_RENDER_OPTICS_TMPL_H

#include <stdlib.h>

#include "base/mem.h"
#include "render/scene.h"

/* value(v) = a + b x, x = v - ref */
typedef struct Line {
    real a, b;
} Line;

typedef struct Interval {
    real v0, v1, ref;
    Line extinction[3];    /* scatter + absorb, per channel */
    Line scatter, scatter_color[3];
    Line emit[3];
    Line surface, surface_color[3];
    Line surfaceness;
    bool has_extinction, has_scatter, has_emit, has_surface, visible;
} Interval;

typedef struct Delta {
    real value;
    real color[3];
    double mu, opacity;
} Delta;

typedef struct Optics {
    real *knots;
    size_t knot_count;
    Interval *intervals; /* knot_count + 1 */
    Delta *deltas;   /* ascending by value, equal values in list order */
    size_t *falling; /* their numbers descending by value, equal values in list order */
    size_t delta_count;
    int channels; /* 1: extinction is grey, 3: coloured */
    bool emission, classic;
    real ambient, diffuse, specular;
    double shininess;
    bool gradient_surfaceness;
    real g0, g1;
} Optics;

#ifdef VOL_DOUBLE
struct VolOpticsF64 {
    Optics o;
};
#define SCENE_OPTICS(scene) (&(scene)->optics64->o)
#else
struct VolOpticsF32 {
    Optics o;
};
#define SCENE_OPTICS(scene) (&(scene)->optics32->o)
#endif

static inline real line_at(Line line, real x) { return real_fma(line.b, x, line.a); }

/* Number of knots <= v: the interval that holds v.  `guess` is tried first. */
static inline size_t interval_of(const Optics *optics, real v, size_t guess)
{
    const Interval *in = &optics->intervals[guess];
    if (v >= in->v0 && v < in->v1)
        return guess;
    size_t lo = 0, hi = optics->knot_count;
    while (lo < hi) {
        size_t mid = (lo + hi) / 2;
        if (optics->knots[mid] <= v)
            lo = mid + 1;
        else
            hi = mid;
    }
    return lo;
}

/* Number of knots < v: the interval below v, for a value that falls. */
static inline size_t interval_below(const Optics *optics, real v, size_t guess)
{
    size_t j = interval_of(optics, v, guess);
    return j > 0 && optics->knots[j - 1] == v ? j - 1 : j;
}

#endif
