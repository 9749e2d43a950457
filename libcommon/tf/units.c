/* A transfer function in other units of the field, and within what kernels can count with. */
#include <math.h>

#include "tf/preint.h"
#include "tf/tf.h"

/* value(v) in v' = scale v */
static void rescale_line(VolLinear *line, double scale) { line->b /= scale; }

static void rescale_interval(VolTfInterval *in, double scale)
{
    in->v0 *= scale;
    in->v1 *= scale;
    in->v_ref *= scale;
    rescale_line(&in->scatter, scale);
    for (int c = 0; c < 3; c++) {
        rescale_line(&in->scatter_color[c], scale);
        rescale_line(&in->absorb[c], scale);
        rescale_line(&in->emit[c], scale);
        rescale_line(&in->surface_color[c], scale);
        rescale_line(&in->transport[c], scale);
    }
    rescale_line(&in->surfaceness, scale);
    in->surface.a /= scale; /* per unit of the field */
    in->surface.b /= scale;
    rescale_line(&in->surface, scale);
}

void vol_tf_compiled_rescale(VolTfCompiled *tf, double scale)
{
    for (size_t i = 0; i < tf->knot_count; i++)
        tf->knots[i] *= scale;
    for (size_t i = 0; i <= tf->knot_count; i++)
        rescale_interval(&tf->intervals[i], scale);
    for (size_t i = 0; i < tf->isosurface_count; i++)
        tf->isosurfaces[i].value *= scale;
    tf->node_min *= scale;
    tf->node_max *= scale;
    tf->surfaceness_gradient[0] *= scale;
    tf->surfaceness_gradient[1] *= scale;
}

void vol_tf_integrals_rescale(VolTfIntegrals *integrals, double scale)
{
    for (size_t i = 0; i < integrals->tf->knot_count; i++)
        integrals->at_knot[i].value *= scale;
}

void vol_preint_rescale(VolPreint *tables, double scale)
{
    tables->lo *= scale;
    tables->hi *= scale;
    if (tables->integrals.tf)
        vol_tf_integrals_rescale(&tables->integrals, scale);
}

/* ---- Limits ---- */

/* Optical depth of a voxel of particles, and of all surfaces together: 2^-53 of them is opaque, and what is seen lies no
 * deeper.  More would have kernels count with lengths whose squares are no numbers any more. */
#define MOST_DEPTH 1e18
/* Emission, and what floats bear, times the values that integrals run over. */
#define MOST_EMITTED 1e30
#define MOST_NUMBER 1e36

/* What extinction and emission of an interval must not exceed. */
typedef struct Limits {
    double extinction, emission;
} Limits;

/* What all that a point's particles do is multiplied by, so that none of it is above its limit: what they look like where
 * they are opaque is what they scatter and emit in proportion to what they take away. */
static double share(const VolTfInterval *in, double x, Limits most)
{
    double scatter = in->scatter.a + in->scatter.b * x, largest = scatter, emitted = 0;
    for (int c = 0; c < 3; c++) {
        largest = fmax(largest, scatter + in->absorb[c].a + in->absorb[c].b * x);
        largest = fmax(largest, in->transport[c].a + in->transport[c].b * x);
        emitted = fmax(emitted, in->emit[c].a + in->emit[c].b * x);
    }
    double part = largest > most.extinction ? most.extinction / largest : 1;
    return part * emitted > most.emission ? most.emission / emitted : part;
}

/* Times `first` at its beginning and `last` at its end. */
static void scale_line(VolLinear *line, double width, double first, double last)
{
    double end = line->a + line->b * width;
    line->a *= first;
    if (isfinite(width))
        line->b = (end * last - line->a) / width;
}

static void limit_particles(VolTfInterval *in, Limits most)
{
    double width = in->v1 - in->v0;
    if (!(width > 0))
        return;
    double first = share(in, 0, most), last = isfinite(width) ? share(in, width, most) : first;
    if (first == 1 && last == 1)
        return;
    scale_line(&in->scatter, width, first, last);
    for (int c = 0; c < 3; c++) {
        scale_line(&in->absorb[c], width, first, last);
        scale_line(&in->emit[c], width, first, last);
        scale_line(&in->transport[c], width, first, last);
    }
}

static void limit_surfaces(VolLinear *line, double width, double most)
{
    double first = line->a, last = isfinite(width) ? line->a + line->b * width : first;
    if (first > most || last > most)
        scale_line(line, width, fmin(1, most / first), fmin(1, most / last));
}

void vol_tf_limit(VolTfCompiled *tf, double voxel)
{
    double span = tf->knot_count ? tf->knots[tf->knot_count - 1] - tf->knots[0] : 0;
    double extent = fmax(span, 1), surfaces = MOST_DEPTH / (span > 0 ? span : 1);
    Limits particles = {fmin(MOST_DEPTH / voxel, MOST_NUMBER) / extent, fmin(MOST_EMITTED / voxel, MOST_NUMBER) / extent};
    for (size_t i = 0; i <= tf->knot_count; i++) {
        VolTfInterval *in = &tf->intervals[i];
        double width = in->v1 - in->v0, steepest = MOST_NUMBER * width; /* slopes are numbers too */
        double per_length = steepest / fmax(voxel, 1);
        limit_particles(in, (Limits){fmin(particles.extinction, per_length), fmin(particles.emission, per_length)});
        limit_surfaces(&in->surface, width, fmin(surfaces, steepest));
    }
    tf->max_emit = fmin(tf->max_emit, particles.emission);
}
