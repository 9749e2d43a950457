/* Values and integrals of the optical properties, in closed form.
 *
 * On an interval mu_s, c_s, ... are linear in v, so mu_s c_s and mu_s v are quadratic: Simpson's rule is exact.  Prefix
 * integrals at the knots make any stretch O(log knots).  A stretch over few intervals is summed piece by piece all the
 * same, since the difference of two large prefixes would lose a small one's digits. */
#include "tf/preint_private.h"

#include <stdlib.h>

#include "base/fmath.h"

static double at(VolLinear line, double x) { return line.a + line.b * x; }

static double at_least_0(double y) { return y > 0 ? y : 0; }

void vol_tf_sample_within(const VolTfInterval *in, double v, VolTfSample *out)
{
    double x = v - in->v_ref;
    double scatter = at_least_0(at(in->scatter, x));
    out->surface = at_least_0(at(in->surface, x));
    for (int c = 0; c < 3; c++) {
        out->surface_color[c] = at_least_0(at(in->surface_color[c], x));
        out->particle[c] = scatter + at_least_0(at(in->absorb[c], x));
        out->source[c] = scatter * at_least_0(at(in->scatter_color[c], x)) + at_least_0(at(in->emit[c], x));
    }
}

void vol_tf_sample(const VolTfCompiled *tf, double v, VolTfSample *out)
{
    vol_tf_sample_within(&tf->intervals[vol_tf_interval(tf, v)], v, out);
}

/* Adds the integrals from a to b, both within the interval. */
static void add_piece(const VolTfInterval *in, double a, double b, VolTfIntegral *sum)
{
    double width = b - a;
    if (!(width > 0))
        return;
    static const double weight[3] = {1.0 / 6, 4.0 / 6, 1.0 / 6};
    double v[3] = {a, a + width / 2, b};
    for (int i = 0; i < 3; i++) {
        VolTfSample s;
        vol_tf_sample_within(in, v[i], &s);
        double w = weight[i] * width, surface = w * s.surface;
        sum->surface += surface;
        sum->value += surface * v[i];
        for (int c = 0; c < 3; c++) {
            sum->surface_color[c] += surface * s.surface_color[c];
            sum->particle[c] += w * s.particle[c];
            sum->source[c] += w * s.source[c];
        }
    }
}

static void add_difference(const VolTfIntegral *from, const VolTfIntegral *to, VolTfIntegral *sum)
{
    sum->surface += to->surface - from->surface;
    sum->value += to->value - from->value;
    for (int c = 0; c < 3; c++) {
        sum->surface_color[c] += to->surface_color[c] - from->surface_color[c];
        sum->particle[c] += to->particle[c] - from->particle[c];
        sum->source[c] += to->source[c] - from->source[c];
    }
}

VolStatus vol_tf_integrals_new(const VolTfCompiled *tf, VolTfIntegrals *out, VolError *err)
{
    *out = (VolTfIntegrals){.tf = tf, .at_knot = vol_alloc_zero(tf->knot_count, sizeof *out->at_knot)};
    if (!out->at_knot)
        return vol_fail_memory(err, tf->knot_count * sizeof *out->at_knot);
    for (size_t i = 1; i < tf->knot_count; i++) {
        out->at_knot[i] = out->at_knot[i - 1];
        add_piece(&tf->intervals[i], tf->knots[i - 1], tf->knots[i], &out->at_knot[i]);
    }
    return VOL_OK;
}

void vol_tf_integrals_free(VolTfIntegrals *integrals)
{
    free(integrals->at_knot);
    *integrals = (VolTfIntegrals){0};
}

void vol_tf_integrals_between(const VolTfIntegrals *integrals, double v0, double v1, VolTfIntegral *out)
{
    enum { FEW = 16 };
    const VolTfCompiled *tf = integrals->tf;
    size_t first = vol_tf_interval(tf, v0), last = vol_tf_interval(tf, v1);
    *out = (VolTfIntegral){0};
    if (first == last) {
        add_piece(&tf->intervals[first], v0, v1, out);
        return;
    }
    add_piece(&tf->intervals[first], v0, tf->knots[first], out);
    if (last - first <= FEW)
        for (size_t i = first + 1; i < last; i++)
            add_piece(&tf->intervals[i], tf->knots[i - 1], tf->knots[i], out);
    else
        add_difference(&integrals->at_knot[first], &integrals->at_knot[last - 1], out);
    add_piece(&tf->intervals[last], tf->knots[last - 1], v1, out);
}

double vol_preint_phi(double t)
{
    if (t > 0.25)
        return -vol_expm1(-t) / t;
    /* sum (-t)^k / (k+1)!; the first term left out is below 1e-17 */
    static const double c[] = {-1.0 / 479001600, 1.0 / 39916800, -1.0 / 3628800, 1.0 / 362880, -1.0 / 40320, 1.0 / 5040,
                               -1.0 / 720,       1.0 / 120,      -1.0 / 24,      1.0 / 6,      -0.5,         1};
    double sum = c[0];
    for (size_t i = 1; i < sizeof c / sizeof *c; i++)
        sum = sum * t + c[i];
    return t > 0 ? sum : 1;
}

void vol_preint_integrals_at(const VolTfIntegrals *integrals, double v0, double v1, double dl,
                             VolPreintApproximation *out)
{
    double lo = v0 < v1 ? v0 : v1, hi = v0 < v1 ? v1 : v0, width = hi - lo;
    VolTfIntegral sum = {0};
    VolTfSample mean;
    if (width > 0)
        vol_tf_integrals_between(integrals, lo, hi, &sum);
    else
        vol_tf_sample(integrals->tf, v0, &mean);
    *out = (VolPreintApproximation){.v_c = sum.surface > 0 ? sum.value / sum.surface : lo + width / 2};
    out->v_c = out->v_c < lo ? lo : out->v_c > hi ? hi : out->v_c;
    for (int c = 0; c < 3; c++) {
        double particle = (width > 0 ? sum.particle[c] / width : mean.particle[c]) * dl;
        double source = (width > 0 ? sum.source[c] / width : mean.source[c]) * dl;
        double depth = sum.surface + particle, phi = vol_preint_phi(depth);
        out->depth[c] = depth;
        out->alpha[c] = depth * phi;
        out->surface_a[c] = sum.surface * phi;
        out->surface_c[c] = sum.surface_color[c] * phi;
        out->particle_a[c] = particle * phi;
        out->particle_c[c] = source * phi;
    }
}
