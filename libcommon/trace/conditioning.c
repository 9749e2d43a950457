/* Float knows a value v of the field to about u |v|, u = 2^-24.  How far that shifts a pixel, the transfer function decides:
 * on a stretch of length l inside one of its intervals, of width w, transmittance changes with v by at most
 *
 *     |exp(-sigma_0 l) - exp(-sigma_1 l)| / w,
 *
 * sigma_0 and sigma_1 being the extinction at its ends; the largest over l up to an edge of a voxel counts.  Colours and
 * emission count likewise by their change across the interval.  A soft surface of depth M across the interval changes it by
 * (1 - exp(-M)) / w or by its extinction, whichever is less; nobody sees it but through the surfaces of an interval beside
 * it, or where a ray begins in it.  The product of the greatest such sensitivity in a part's range and u times the
 * part's largest magnitude estimates what float makes of the part.  Where it is above LIMIT, rays that come there are
 * traced in double: all of each such ray, so that its result depends on the ray alone.
 *
 * Intervals that are only a few units in the last place of v wide count together instead: rounding shifts each of their
 * ends for itself, and what it takes from one it does not give to the next, so that the errors of a narrow spike of many
 * intervals add up.
 *
 * Jumps do not count, neither do isosurfaces: which of them are met is judged by comparisons that do not round, and how far
 * off their places are depends on how the ray runs (blur_tmpl.h).
 *
 * A field of doubles is rounded twice, as it is taken to float and then on the way.  With the first, voxels may change sides
 * (sides.c), and the slope of the field changes by up to 2 u |v| a voxel edge, against that of the part's range: the slope
 * says how surfaces are shaded, and whether a ray touches them. */
#include "trace/conditioning.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/fmath.h"
#include "base/mem.h"
#include "simd/real.h"
#include "trace/sides.h"

#define LIMIT 1e-5
#define MOST_SAFE 0x1p40 /* as LEAST_SAFE */

#define NARROW 0x1p-16 /* of an end's magnitude */

enum { MOST_LEVELS = 24 };

/* The greatest sensitivity of any run of 2^level intervals, from each on; and the sum of the narrow ones before each. */
typedef struct Sensitivities {
    double *level[MOST_LEVELS], *narrow;
    size_t count;
    int levels;
} Sensitivities;

static double at_end(const VolLinear *line, double width) { return fmax(line->a + line->b * width, 0); }

/* By how much exp(-sigma l) can differ, l up to h. */
static double change_of_transmittance(double a, double b, double h)
{
    double most = fmax(a, b), l = most * h > 1 ? 1 / most : h;
    return fabs(vol_exp(-a * l) - vol_exp(-b * l));
}

static double surface_depth(const VolTfInterval *in)
{
    double width = in->v1 - in->v0;
    return in->has_surface ? 0.5 * width * (at_end(&in->surface, 0) + at_end(&in->surface, width)) : 0;
}

/* Of a surface seen through an optical depth whose transmittance is `through`. */
static double surface_sensitivity(const VolTfInterval *in, double transmittance)
{
    double width = in->v1 - in->v0;
    if (!in->has_surface)
        return 0;
    double dense = at_end(&in->surface, 0);
    if (!isfinite(width))
        return transmittance * 2 * dense;
    dense = fmax(dense, at_end(&in->surface, width));
    return transmittance * fmin(dense, -vol_expm1(-surface_depth(in)) / width);
}

/* Rays begin in unbounded intervals. */
static double seen_through(const VolTfInterval *in) { return isfinite(in->v1 - in->v0) ? vol_exp(-surface_depth(in)) : 1; }

static double hidden_surface_sensitivity(const VolTfCompiled *tf, size_t j)
{
    const VolTfInterval *in = &tf->intervals[j];
    double transmittance = 0;
    if (j > 0)
        transmittance = seen_through(in - 1);
    if (j < tf->knot_count)
        transmittance = fmax(transmittance, seen_through(in + 1));
    return surface_sensitivity(in, transmittance);
}

static double particle_sensitivity(const VolTfInterval *in, double h)
{
    double width = in->v1 - in->v0, change = 0;
    if (!isfinite(width) || !(in->has_scatter || in->has_absorb || in->has_emit))
        return 0;
    for (int c = 0; c < 3; c++) {
        VolLinear sigma = {in->scatter.a + in->absorb[c].a, in->scatter.b + in->absorb[c].b};
        double a = at_end(&sigma, 0), b = at_end(&sigma, width), opaque = -vol_expm1(-fmax(a, b) * h);
        double parts = change_of_transmittance(a, b, h) + fabs(in->scatter_color[c].b) * width * opaque +
                       fabs(in->emit[c].b) * width * h;
        change = fmax(change, parts);
    }
    return change / width;
}

static double narrow_sensitivity(const VolTfCompiled *tf, size_t j)
{
    const VolTfInterval *in = &tf->intervals[j];
    double width = in->v1 - in->v0;
    if (!in->has_surface || !(width < NARROW * fmax(fabs(in->v0), fabs(in->v1))))
        return 0;
    return fmax(at_end(&in->surface, 0), at_end(&in->surface, width));
}

static VolStatus measure(const VolTfCompiled *tf, double h, Sensitivities *out, VolError *err)
{
    *out = (Sensitivities){.count = tf->knot_count + 1};
    out->narrow = vol_alloc_zero(out->count + 1, sizeof *out->narrow);
    if (!out->narrow)
        return vol_fail_memory(err, out->count * sizeof *out->narrow);
    for (size_t j = 0; j < out->count; j++)
        out->narrow[j + 1] = out->narrow[j] + narrow_sensitivity(tf, j);
    for (size_t span = 1; span <= out->count && out->levels < MOST_LEVELS; span *= 2) {
        double *here = out->level[out->levels] = vol_alloc(out->count, sizeof *here);
        if (!here)
            return vol_fail_memory(err, out->count * sizeof *here);
        const double *below = out->levels ? out->level[out->levels - 1] : NULL;
        for (size_t j = 0; j < out->count; j++) {
            size_t other = j + span / 2 < out->count ? j + span / 2 : j;
            here[j] = below ? fmax(below[j], below[other])
                            : particle_sensitivity(&tf->intervals[j], h) + hidden_surface_sensitivity(tf, j);
        }
        out->levels++;
    }
    return VOL_OK;
}

static void sensitivities_free(Sensitivities *s)
{
    for (int n = 0; n < s->levels; n++)
        free(s->level[n]);
    free(s->narrow);
}

static double greatest_between(const Sensitivities *s, size_t first, size_t last)
{
    int level = 63 - __builtin_clzll((unsigned long long)(last - first + 1));
    level = level < s->levels ? level : s->levels - 1;
    return fmax(s->level[level][first], s->level[level][last + 1 - ((size_t)1 << level)]);
}

/* Whether there are surfaces of either kind among values from lo to hi. */
static bool has_surfaces(const VolTfCompiled *tf, double lo, double hi, size_t first, size_t last)
{
    bool some = false;
    for (size_t n = 0; n < tf->isosurface_count && !some; n++)
        some = tf->isosurfaces[n].value >= lo && tf->isosurfaces[n].value <= hi;
    for (size_t j = first; j <= last && tf->has_surface && !some; j++)
        some = tf->intervals[j].has_surface;
    return some;
}

/* Of values from lo to hi; `rounded`: the field is of doubles. */
static bool is_ill_conditioned(const VolScene *scene, const Sensitivities *s, double lo, double hi, bool rounded)
{
    double largest = fmax(fabs(lo), fabs(hi)), change = hi - lo;
    if (!(lo < hi))
        return false;
    if (largest > MOST_SAFE)
        return true;
    size_t first = vol_tf_interval(scene->tf, lo), last = vol_tf_interval(scene->tf, hi);
    double greatest = fmax(greatest_between(s, first, last), s->narrow[last + 1] - s->narrow[first]);
    if (first == last) /* rays begin in it */
        greatest = fmax(greatest, surface_sensitivity(&scene->tf->intervals[first], 1));
    if (rounded && 4 * UNIT_ROUNDOFF * largest > LIMIT * change && has_surfaces(scene->tf, lo, hi, first, last))
        return true;
    double effect = (rounded ? 2 : 1) * greatest * largest;
    return effect * UNIT_ROUNDOFF > LIMIT || (largest < LEAST_SAFE && effect > LIMIT);
}

VolStatus vol_conditioning_judge(const VolScene *scene, const VolEmptySpace *space, bool shaded, uint8_t **out,
                                 VolError *err)
{
    const VolVolume *volume = &scene->volume;
    const size_t parts = vol_volume_counts(volume).parts;
    Sensitivities s;
    VolSides *sides = NULL;
    size_t found = 0;
    VolStatus status = measure(scene->tf, vol_volume_voxel(volume), &s, err);
    if (!status && vol_volume_is_double(volume))
        status = vol_sides_new(scene->tf, &sides, err);
    uint8_t *ill = status ? NULL : vol_alloc_zero(parts, 1);
    if (!status && !ill)
        status = vol_fail_memory(err, parts);
    double lo, hi;
    /* Gradients reach into the parts beside. */
    bool all = vol_volume_range(volume, &lo, &hi) && shaded && fmax(fabs(lo), fabs(hi)) > MOST_SAFE;
    for (size_t n = 0; n < parts && !status; n++) {
        vol_volume_part_range(volume, n, &lo, &hi);
        ill[n] = space->brick_visible[n] != VOL_BRICK_LEFT_OUT &&
                 (all || is_ill_conditioned(scene, &s, lo, hi, sides != NULL) ||
                  (sides && vol_sides_change(sides, volume, n)));
        found += ill[n];
    }
    sensitivities_free(&s);
    vol_sides_free(sides);
    if (!found) {
        free(ill);
        ill = NULL;
    }
    *out = ill;
    return status;
}
