/* From the compiled transfer function to the kernel's tables; once for float, once for double. */
#include "render/optics_tmpl.h"

static Line line_of(VolLinear from) { return (Line){(real)from.a, (real)from.b}; }

static Interval interval_from(const VolTfInterval *from)
{
    Interval in = {.v0 = (real)from->v0, .v1 = (real)from->v1, .ref = (real)from->v_ref,
                   .scatter = line_of(from->scatter), .surface = line_of(from->surface),
                   .surfaceness = line_of(from->surfaceness)};
    for (int c = 0; c < 3; c++) {
        VolLinear sum = {from->scatter.a + from->absorb[c].a, from->scatter.b + from->absorb[c].b};
        in.extinction[c] = line_of(sum);
        in.scatter_color[c] = line_of(from->scatter_color[c]);
        in.emit[c] = line_of(from->emit[c]);
        in.surface_color[c] = line_of(from->surface_color[c]);
    }
    in.has_scatter = from->has_scatter;
    in.has_extinction = from->has_scatter || from->has_absorb;
    in.has_emit = from->has_emit;
    in.has_surface = from->has_surface;
    in.visible = in.has_extinction || in.has_emit || in.has_surface;
    return in;
}

static void free_optics(Optics *o)
{
    free(o->knots);
    free(o->intervals);
    free(o->deltas);
    free(o->falling);
}

static void order_falling(Optics *o)
{
    size_t filled = 0;
    for (size_t end = o->delta_count; end > 0;) {
        size_t begin = end - 1;
        while (begin > 0 && o->deltas[begin - 1].value == o->deltas[end - 1].value)
            begin--;
        for (size_t k = begin; k < end; k++)
            o->falling[filled++] = k;
        end = begin;
    }
}

static VolStatus build_optics(const VolTfCompiled *tf, Optics *o, VolError *err)
{
    *o = (Optics){.knot_count = tf->knot_count,
                  .delta_count = tf->delta_count,
                  .channels = tf->coloured ? 3 : 1,
                  .emission = tf->has_emit,
                  .classic = tf->model == VOL_MODEL_CLASSIC,
                  .ambient = (real)tf->ambient,
                  .diffuse = (real)tf->diffuse,
                  .specular = (real)tf->specular,
                  .shininess = tf->shininess,
                  .gradient_surfaceness = tf->surfaceness_by_gradient,
                  .g0 = (real)tf->surfaceness_gradient[0],
                  .g1 = (real)tf->surfaceness_gradient[1]};
    o->knots = vol_alloc(tf->knot_count, sizeof *o->knots);
    o->intervals = vol_alloc(tf->knot_count + 1, sizeof *o->intervals);
    o->deltas = vol_alloc(tf->delta_count, sizeof *o->deltas);
    o->falling = vol_alloc(tf->delta_count, sizeof *o->falling);
    if (!o->knots || !o->intervals || !o->deltas || !o->falling) {
        free_optics(o);
        return vol_fail_memory(err, (tf->knot_count + 1) * sizeof *o->intervals);
    }
    for (size_t i = 0; i < tf->knot_count; i++)
        o->knots[i] = (real)tf->knots[i];
    for (size_t i = 0; i <= tf->knot_count; i++)
        o->intervals[i] = interval_from(&tf->intervals[i]);
    for (size_t i = 0; i < tf->delta_count; i++) {
        const VolTfDelta *d = &tf->deltas[i];
        o->deltas[i] = (Delta){(real)d->value, {(real)d->color[0], (real)d->color[1], (real)d->color[2]}, d->mu, d->opacity};
    }
    order_falling(o);
    return VOL_OK;
}
