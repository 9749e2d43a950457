/* One list of intervals out of several lists of nodes.
 *
 * Every list (surface, scatter, absorb, ...) is piecewise linear with knots of its own.  Between two neighbouring
 * knots of all lists together every one is linear, so that is where integrators cut a ray: inside, all they see is
 * a + b (v - v_ref).  A jump, two nodes at one v, is one knot: the interval before ends with the first node's
 * value, the next begins with the second's. */
#include "tf/tf.h"

#include "base/fmath.h"

#include <math.h>
#include <stdlib.h>

enum { SURFACENESS = VOL_TF_TRANSPORT + 1, LISTS };

#define MOST_KNOTS ((size_t)1 << 22)

typedef struct Curve {
    VolTfExtinctionNode *nodes;
    size_t count;
    size_t passed; /* nodes with v <= the interval's beginning */
} Curve;

typedef struct Curves {
    Curve list[LISTS];
} Curves;

static void curves_free(Curves *curves)
{
    for (size_t i = 0; i < LISTS; i++)
        free(curves->list[i].nodes);
}

static VolStatus surfaceness_curve(const VolTf *tf, Curve *curve, VolError *err)
{
    curve->nodes = vol_alloc_zero(tf->surfaceness.count, sizeof *curve->nodes);
    if (!curve->nodes)
        return vol_fail_memory(err, tf->surfaceness.count * sizeof *curve->nodes);
    curve->count = tf->surfaceness.count;
    for (size_t i = 0; i < curve->count; i++) {
        curve->nodes[i].v = tf->surfaceness.nodes[i].v;
        curve->nodes[i].extinction[0] = tf->surfaceness.nodes[i].amount;
    }
    return VOL_OK;
}

static VolStatus convert_lists(const VolTf *tf, Curves *curves, VolError *err)
{
    VolStatus status = VOL_OK;
    for (int i = 0; i < SURFACENESS && status == VOL_OK; i++) {
        Curve *curve = &curves->list[i];
        bool ignored = i == VOL_TF_SURFACE && tf->model == VOL_MODEL_CLASSIC;
        if (!ignored)
            status = vol_tf_extinction_nodes(tf, (VolTfList)i, &curve->nodes, &curve->count, err);
    }
    if (status == VOL_OK && tf->model == VOL_MODEL_CLASSIC)
        status = surfaceness_curve(tf, &curves->list[SURFACENESS], err);
    return status;
}

/* ---- Knots ---- */

static VolStatus merge_knots(Curves *curves, VolTfCompiled *out, VolError *err)
{
    size_t total = 0;
    for (size_t i = 0; i < LISTS; i++)
        total += curves->list[i].count;
    out->knots = vol_alloc(total, sizeof *out->knots);
    if (!out->knots)
        return vol_fail_memory(err, total * sizeof *out->knots);
    for (;;) {
        double least = INFINITY;
        for (size_t i = 0; i < LISTS; i++) {
            const Curve *curve = &curves->list[i];
            if (curve->passed < curve->count)
                least = fmin(least, curve->nodes[curve->passed].v);
        }
        if (least == INFINITY)
            break;
        out->knots[out->knot_count++] = least;
        for (size_t i = 0; i < LISTS; i++) {
            Curve *curve = &curves->list[i];
            while (curve->passed < curve->count && curve->nodes[curve->passed].v == least)
                curve->passed++;
        }
    }
    for (size_t i = 0; i < LISTS; i++)
        curves->list[i].passed = 0;
    if (out->knot_count > MOST_KNOTS)
        return vol_fail(err, VOL_BAD_INPUT, "transfer function: more than %zu different values", MOST_KNOTS);
    return VOL_OK;
}

/* ---- Intervals ---- */

/* The nodes on both sides of the interval; the same one twice where the curve is constant. */
typedef struct Span {
    const VolTfExtinctionNode *p, *q;
    double v_ref;
} Span;

static Span span_of(const Curve *curve, double v_ref)
{
    size_t after = curve->passed;
    size_t p = after ? after - 1 : 0, q = after < curve->count ? after : curve->count - 1;
    return (Span){&curve->nodes[p], &curve->nodes[q], v_ref};
}

/* Through (v_p, y_p) and (v_q, y_q).  Nodes so close that the slope overflows are as good as a jump. */
static VolLinear line(Span s, double y_p, double y_q)
{
    double slope = s.p->v < s.q->v ? (y_q - y_p) / (s.q->v - s.p->v) : 0;
    if (!isfinite(slope))
        slope = 0;
    return (VolLinear){slope != 0 ? y_p + slope * (s.v_ref - s.p->v) : y_p, slope};
}

static VolLinear extinction_line(Span s, int c)
{
    return line(s, s.p->extinction[c], s.q->extinction[c]);
}

static VolLinear color_line(Span s, int c)
{
    return line(s, s.p->color[c], s.q->color[c]);
}

static bool any_extinction(Span s)
{
    for (int c = 0; c < 3; c++)
        if (s.p->extinction[c] != 0 || s.q->extinction[c] != 0)
            return true;
    return false;
}

static double largest(const double rgb[3])
{
    return fmax(rgb[0], fmax(rgb[1], rgb[2]));
}

static void fill_scatter(VolTfCompiled *out, VolTfInterval *to, Span s)
{
    to->scatter = extinction_line(s, 0);
    to->has_scatter = any_extinction(s);
    for (int c = 0; c < 3; c++)
        to->scatter_color[c] = color_line(s, c);
    if (to->has_scatter)
        out->max_color = fmax(out->max_color, fmax(largest(s.p->color), largest(s.q->color)));
}

static void fill_surface(VolTfCompiled *out, VolTfInterval *to, Span s)
{
    to->surface = extinction_line(s, 0);
    to->has_surface = any_extinction(s);
    for (int c = 0; c < 3; c++)
        to->surface_color[c] = color_line(s, c);
    if (to->has_surface)
        out->max_color = fmax(out->max_color, fmax(largest(s.p->color), largest(s.q->color)));
}

static bool grey(const double rgb[3])
{
    return rgb[0] == rgb[1] && rgb[1] == rgb[2];
}

static void fill_absorb(VolTfCompiled *out, VolTfInterval *to, Span s)
{
    to->has_absorb = any_extinction(s);
    for (int c = 0; c < 3; c++)
        to->absorb[c] = extinction_line(s, c);
    out->coloured |= !grey(s.p->extinction) || !grey(s.q->extinction);
}

static void fill_emit(VolTfCompiled *out, VolTfInterval *to, Span s)
{
    to->has_emit = any_extinction(s);
    for (int c = 0; c < 3; c++)
        to->emit[c] = extinction_line(s, c);
    out->max_emit = fmax(out->max_emit, fmax(largest(s.p->extinction), largest(s.q->extinction)));
}

/* Without `transport`, indirect light is attenuated by what attenuates the direct, colourless: the mean of its
 * channels. */
static void fill_transport(VolTfInterval *to, const Curve *curve)
{
    for (int c = 0; c < 3; c++) {
        if (curve->count) {
            to->transport[c] = extinction_line(span_of(curve, to->v_ref), c);
        } else {
            to->transport[c].a = to->scatter.a + (to->absorb[0].a + to->absorb[1].a + to->absorb[2].a) / 3;
            to->transport[c].b = to->scatter.b + (to->absorb[0].b + to->absorb[1].b + to->absorb[2].b) / 3;
        }
    }
}

static void fill_interval(VolTfCompiled *out, VolTfInterval *to, const Curves *curves)
{
    const Curve *list = curves->list;
    if (list[VOL_TF_SCATTER].count)
        fill_scatter(out, to, span_of(&list[VOL_TF_SCATTER], to->v_ref));
    if (list[VOL_TF_SURFACE].count)
        fill_surface(out, to, span_of(&list[VOL_TF_SURFACE], to->v_ref));
    if (list[VOL_TF_ABSORB].count)
        fill_absorb(out, to, span_of(&list[VOL_TF_ABSORB], to->v_ref));
    if (list[VOL_TF_EMIT].count)
        fill_emit(out, to, span_of(&list[VOL_TF_EMIT], to->v_ref));
    to->surfaceness = (VolLinear){1, 0};
    if (list[SURFACENESS].count)
        to->surfaceness = extinction_line(span_of(&list[SURFACENESS], to->v_ref), 0);
    fill_transport(to, &list[VOL_TF_TRANSPORT]);
    out->has_scatter |= to->has_scatter;
    out->has_surface |= to->has_surface;
    out->has_absorb |= to->has_absorb;
    out->has_emit |= to->has_emit;
}

static VolStatus fill_intervals(VolTfCompiled *out, Curves *curves, VolError *err)
{
    size_t n = out->knot_count;
    out->intervals = vol_alloc_zero(n + 1, sizeof *out->intervals);
    out->visible_before = vol_alloc_zero(n + 2, sizeof *out->visible_before);
    if (!out->intervals || !out->visible_before)
        return vol_fail_memory(err, (n + 1) * sizeof *out->intervals);
    for (size_t i = 0; i <= n; i++) {
        VolTfInterval *to = &out->intervals[i];
        to->v0 = i > 0 ? out->knots[i - 1] : -INFINITY;
        to->v1 = i < n ? out->knots[i] : INFINITY;
        to->v_ref = i > 0 ? to->v0 : i < n ? to->v1 : 0;
        for (size_t k = 0; k < LISTS; k++) {
            Curve *curve = &curves->list[k];
            while (curve->passed < curve->count && curve->nodes[curve->passed].v <= to->v0)
                curve->passed++;
        }
        fill_interval(out, to, curves);
        bool visible = to->has_scatter || to->has_absorb || to->has_emit || to->has_surface;
        out->visible_before[i + 1] = out->visible_before[i] + visible;
    }
    return VOL_OK;
}

/* ---- Isosurfaces ---- */

/* By value; equal ones stay in the order of the list. */
static int compare_isosurfaces(const void *a, const void *b)
{
    const VolTfIsosurface *x = *(const VolTfIsosurface *const *)a, *y = *(const VolTfIsosurface *const *)b;
    if (x->value != y->value)
        return x->value < y->value ? -1 : 1;
    return x < y ? -1 : x > y;
}

/* The user's own nodes will do: insertion does not change the colour, which is linear between them. */
static void surface_color_at(const VolTfNodes *surface, double v, double out[3])
{
    size_t after = 0;
    while (after < surface->count && surface->nodes[after].v <= v)
        after++;
    if (!surface->count) {
        out[0] = out[1] = out[2] = 1;
        return;
    }
    const VolTfNode *p = &surface->nodes[after ? after - 1 : 0];
    const VolTfNode *q = &surface->nodes[after < surface->count ? after : surface->count - 1];
    double u = p->v < q->v && v > p->v ? (v - p->v) / (q->v - p->v) : 0;
    for (int c = 0; c < 3; c++)
        out[c] = p->color[c] + u * (q->color[c] - p->color[c]);
}

static VolIsosurface delta_of(const VolTf *tf, const VolTfIsosurface *from)
{
    VolIsosurface to = {.value = from->value, .opacity = from->opacity};
    to.optical_depth = from->opacity < 1 ? -vol_log1p(-from->opacity) : INFINITY;
    static const VolTfNodes none;
    if (from->color_given)
        for (int c = 0; c < 3; c++)
            to.color[c] = from->color[c];
    else
        surface_color_at(tf->model == VOL_MODEL_CLASSIC ? &none : &tf->surface, from->value, to.color);
    return to;
}

static VolStatus compile_isosurfaces(const VolTf *tf, VolTfCompiled *out, VolError *err)
{
    size_t n = tf->isosurface_count;
    const VolTfIsosurface **sorted = vol_alloc(n, sizeof *sorted);
    out->isosurfaces = vol_alloc(n, sizeof *out->isosurfaces);
    if (!sorted || !out->isosurfaces) {
        free(sorted);
        return vol_fail_memory(err, n * sizeof *out->isosurfaces);
    }
    for (size_t i = 0; i < n; i++)
        sorted[i] = &tf->isosurfaces[i];
    qsort(sorted, n, sizeof *sorted, compare_isosurfaces);
    for (size_t i = 0; i < n; i++) {
        out->node_min = fmin(out->node_min, sorted[i]->value);
        out->node_max = fmax(out->node_max, sorted[i]->value);
        if (sorted[i]->opacity == 0)
            continue;
        VolIsosurface *to = &out->isosurfaces[out->isosurface_count++];
        *to = delta_of(tf, sorted[i]);
        out->max_color = fmax(out->max_color, largest(to->color));
    }
    free(sorted);
    return VOL_OK;
}

/* ---- All of it ---- */

static void copy_settings(const VolTf *tf, VolTfCompiled *out)
{
    out->model = tf->model;
    out->ambient = tf->ambient;
    out->diffuse = tf->diffuse;
    out->specular = tf->specular;
    out->shininess = tf->shininess;
    out->surfaceness_by_gradient = tf->surfaceness_by_gradient;
    out->surfaceness_gradient[0] = tf->surfaceness_gradient[0];
    out->surfaceness_gradient[1] = tf->surfaceness_gradient[1];
}

VolStatus vol_tf_compile(const VolTf *tf, const VolLog *log, VolTfCompiled *out, VolError *err)
{
    *out = (VolTfCompiled){.node_min = INFINITY, .node_max = -INFINITY};
    copy_settings(tf, out);
    if (tf->model == VOL_MODEL_CLASSIC && tf->surface.count)
        vol_warn(log, "transfer function: key 'surface' is ignored, the model is classic");
    Curves curves = {0};
    VolStatus status = convert_lists(tf, &curves, err);
    if (status == VOL_OK)
        status = merge_knots(&curves, out, err);
    if (status == VOL_OK)
        status = fill_intervals(out, &curves, err);
    if (status == VOL_OK && out->knot_count) {
        out->node_min = out->knots[0];
        out->node_max = out->knots[out->knot_count - 1];
    }
    if (status == VOL_OK)
        status = compile_isosurfaces(tf, out, err);
    curves_free(&curves);
    if (status != VOL_OK)
        vol_tf_compiled_free(out);
    return status;
}

void vol_tf_compiled_free(VolTfCompiled *compiled)
{
    free(compiled->knots);
    free(compiled->intervals);
    free(compiled->isosurfaces);
    free(compiled->visible_before);
    *compiled = (VolTfCompiled){0};
}
