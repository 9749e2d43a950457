/* From opacity per step to extinction: Y (24), (25), (26), (27).
 *
 * A node's opacity a is what a step of standard length h lets not pass, so its optical depth per step is
 * x = -ln(1 - a) and its extinction x / h.  Between nodes extinction is linear in the scalar.  Users who draw
 * opacity expect opacity to be linear: where the two differ by more than 1e-3 anywhere between two nodes, the
 * interval is halved, the middle taking the mean opacity and the mean colour.
 *
 * How much they differ.  Let T0 > T1 be the transmittances 1 - a at the ends (either way round: the difference is
 * the same mirrored), x0 < x1 the optical depths, D = x1 - x0 = ln(T0 / T1), and u run from 0 to 1.  The
 * difference
 *
 *     f(u) = (1 - exp(-x0 - D u)) - (1 - T0 + (T0 - T1) u) = T0 - (T0 - T1) u - T0 exp(-D u)
 *
 * is concave and 0 at both ends, hence at least 0, with its one maximum where f' = 0:
 *
 *     exp(-D u) = (T0 - T1) / (T0 D) = (1 - exp(-D)) / D =: phi,      u = -ln(phi) / D,
 *
 * and with T0 - T1 = T0 D phi the maximum is
 *
 *     f = T0 (1 - phi + phi ln(phi)).
 *
 * As step lengths divide x0 and x1 alike, nothing depends on them.
 *
 * How often.  Opacity and line both run from one end's value to the other's without turning, so f < T0 - T1: no
 * interval whose opacities differ by 1e-3 or less is halved.  Halving halves that difference: ten times at most
 * (absorption, where density and colour are halved and their product counts, once or twice more). */
#include "tf/convert.h"

#include "base/fmath.h"
#include "tf/tf.h"

#include <math.h>
#include <stdlib.h>

#define MOST_HALVINGS 24
#define MOST_NODES ((size_t)1 << 22) /* of one list after insertion */

double vol_tf_opacity_difference(double t0, double x0, double t1, double x1)
{
    if (t0 < t1)
        return vol_tf_opacity_difference(t1, x1, t0, x0);
    if (!(t0 > t1 && x1 > x0))
        return 0;
    double phi = (t0 - t1) / (t0 * (x1 - x0));
    return t0 * (1 - phi + phi * vol_log(phi));
}

/* A node with what one standard step lets pass, by channel. */
typedef struct Step {
    VolTfNode node;
    double transmittance[3], depth[3]; /* depth = -ln(transmittance) */
} Step;

typedef struct Conversion {
    VolTfList list;
    double length; /* of the standard step */
    bool insert;
    VolTfExtinctionNode *nodes;
    size_t count, capacity;
    VolError *err;
} Conversion;

static int channels(VolTfList list)
{
    return list == VOL_TF_ABSORB || list == VOL_TF_TRANSPORT ? 3 : 1;
}

static void set_opacity(Step *step, int channel, double opacity)
{
    opacity = fmin(opacity, 1 - VOL_TF_LEAST_TRANSMITTANCE);
    step->transmittance[channel] = 1 - opacity;
    step->depth[channel] = -vol_log1p(-opacity);
}

/* Absorption: a step that lets pass the colour takes away density x (1 - colour) in each channel (Y 26). */
static Step step_of(VolTfList list, VolTfNode node)
{
    if (list == VOL_TF_SURFACE || list == VOL_TF_SCATTER)
        node.amount = fmin(node.amount, 1 - VOL_TF_LEAST_TRANSMITTANCE);
    Step step = {.node = node};
    for (int c = 0; c < channels(list); c++) {
        if (list == VOL_TF_ABSORB) {
            set_opacity(&step, c, node.amount * (1 - node.color[c]));
        } else if (list == VOL_TF_TRANSPORT) {
            step.transmittance[c] = fmax(node.color[c], VOL_TF_LEAST_TRANSMITTANCE);
            step.depth[c] = -vol_log(step.transmittance[c]);
        } else {
            set_opacity(&step, c, node.amount);
        }
    }
    return step;
}

static VolTfNode middle(const VolTfNode *a, const VolTfNode *b)
{
    VolTfNode m = {.v = 0.5 * (a->v + b->v), .amount = 0.5 * (a->amount + b->amount)};
    for (int c = 0; c < 3; c++)
        m.color[c] = 0.5 * (a->color[c] + b->color[c]);
    return m;
}

static bool differs(VolTfList list, const Step *a, const Step *b)
{
    for (int c = 0; c < channels(list); c++) {
        double t0 = a->transmittance[c], t1 = b->transmittance[c];
        if (fabs(t0 - t1) > VOL_TF_LARGEST_DIFFERENCE &&
            vol_tf_opacity_difference(t0, a->depth[c], t1, b->depth[c]) > VOL_TF_LARGEST_DIFFERENCE)
            return true;
    }
    return false;
}

static VolStatus append(Conversion *to, const VolTfExtinctionNode *node)
{
    if (to->count == to->capacity) {
        if (to->count >= MOST_NODES)
            return vol_fail(to->err, VOL_BAD_INPUT, "transfer function: more than %zu nodes after insertion",
                            MOST_NODES);
        size_t grown = to->capacity ? 2 * to->capacity : 64;
        VolTfExtinctionNode *moved = vol_resize(to->nodes, grown, sizeof *moved);
        if (!moved)
            return vol_fail_memory(to->err, grown * sizeof *moved);
        to->nodes = moved;
        to->capacity = grown;
    }
    for (int c = 0; c < 3; c++)
        if (!isfinite(node->extinction[c]))
            return vol_fail(to->err, VOL_BAD_INPUT,
                            "transfer function: what lies at value %.9g is not finite for a %s of %g", node->v,
                            to->list == VOL_TF_SURFACE ? "scalar_step" : "particle_step", to->length);
    to->nodes[to->count++] = *node;
    return VOL_OK;
}

static VolStatus append_step(Conversion *to, const Step *step)
{
    VolTfExtinctionNode node = {.v = step->node.v};
    for (int c = 0; c < 3; c++) {
        node.extinction[c] = step->depth[channels(to->list) == 3 ? c : 0] / to->length;
        node.color[c] = step->node.color[c];
    }
    return append(to, &node);
}

/* Appends what comes after `a` up to and with `b`. */
static VolStatus append_interval(Conversion *to, const Step *a, const Step *b, int halvings)
{
    if (to->insert && b->node.v > a->node.v && halvings < MOST_HALVINGS && differs(to->list, a, b)) {
        Step m = step_of(to->list, middle(&a->node, &b->node));
        if (m.node.v > a->node.v && m.node.v < b->node.v) {
            VolStatus status = append_interval(to, a, &m, halvings + 1);
            return status == VOL_OK ? append_interval(to, &m, b, halvings + 1) : status;
        }
    }
    return append_step(to, b);
}

static VolStatus convert_opacity(Conversion *to, const VolTfNodes *nodes)
{
    if (!nodes->count)
        return VOL_OK;
    Step last = step_of(to->list, nodes->nodes[0]);
    VolStatus status = append_step(to, &last);
    for (size_t i = 1; i < nodes->count && status == VOL_OK; i++) {
        Step next = step_of(to->list, nodes->nodes[i]);
        status = append_interval(to, &last, &next, 0);
        last = next;
    }
    return status;
}

/* Emission (Y 27): radiance per step; linear as it is. */
static VolStatus convert_emission(Conversion *to, const VolTfNodes *nodes)
{
    VolStatus status = VOL_OK;
    for (size_t i = 0; i < nodes->count && status == VOL_OK; i++) {
        const VolTfNode *from = &nodes->nodes[i];
        VolTfExtinctionNode node = {.v = from->v};
        for (int c = 0; c < 3; c++) {
            node.extinction[c] = from->amount * from->color[c] / to->length;
            node.color[c] = from->color[c];
        }
        status = append(to, &node);
    }
    return status;
}

VolStatus vol_tf_extinction_nodes(const VolTf *tf, VolTfList list, VolTfExtinctionNode **out, size_t *count,
                                  VolError *err)
{
    const VolTfNodes *const lists[] = {[VOL_TF_SURFACE] = &tf->surface, [VOL_TF_SCATTER] = &tf->scatter,
                                       [VOL_TF_ABSORB] = &tf->absorb,   [VOL_TF_EMIT] = &tf->emit,
                                       [VOL_TF_TRANSPORT] = &tf->transport};
    Conversion to = {.list = list, .err = err, .insert = tf->interpolate == VOL_INTERPOLATE_OPACITY,
                     .length = list == VOL_TF_SURFACE ? tf->scalar_step : tf->particle_step};
    *out = NULL;
    *count = 0;
    if (lists[list]->count && !(to.length > 0))
        return vol_fail(err, VOL_BAD_INPUT, "transfer function: key 'surface' has nodes at one value alone, %s",
                        "and so there is no default for scalar_step: give one, or the data");
    VolStatus status = list == VOL_TF_EMIT ? convert_emission(&to, lists[list])
                                           : convert_opacity(&to, lists[list]);
    if (status != VOL_OK) {
        free(to.nodes);
        to = (Conversion){0};
    }
    *out = to.nodes;
    *count = to.count;
    return status;
}
