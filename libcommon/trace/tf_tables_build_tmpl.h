/* From the compiled transfer function to the kernel's tables; once for float, once for double. */
#include "trace/lookup_build_tmpl.h"
#include "trace/tf_tables_tmpl.h"

/* The same line about another reference, `shift` beyond its own: the interval's, rounded to the kernel's precision.  A slope
 * too steep for that precision becomes 0: its interval is so narrow that it is as good as a jump. */
static Line line_of(VolLinear from, double shift)
{
    Line line = {(real)(from.a + from.b * shift), (real)from.b};
    return isfinite(line.b) && isfinite(line.a) ? line : (Line){(real)from.a, 0};
}

static Interval interval_from(const VolTfInterval *from)
{
    real ref = real_at_or_above(from->v_ref);
    double shift = -real_rest(from->v_ref, ref);
    Interval in = {.ref = ref,
                   .has_surface = from->has_surface,
                   .scatter = line_of(from->scatter, shift),
                   .surface = line_of(from->surface, shift),
                   .surfaceness = line_of(from->surfaceness, shift)};
    for (int c = 0; c < 3; c++) {
        VolLinear sum = {from->scatter.a + from->absorb[c].a, from->scatter.b + from->absorb[c].b};
        *(c == 0 ? &in.extinction : &in.extinction_rest[c - 1]) = line_of(sum, shift);
        in.scatter_color[c] = line_of(from->scatter_color[c], shift);
        in.emit[c] = line_of(from->emit[c], shift);
        in.surface_color[c] = line_of(from->surface_color[c], shift);
    }
    return in;
}

static void free_tf_tables(TfTables *o)
{
    free(o->edges);
    free(o->intervals);
    free(o->next_visible);
    free(o->buckets);
    free(o->isosurfaces);
    free(o->isosurface_values);
    free(o->falling);
    free_lookup(o);
}

/* Buckets of equal width from the first knot to the last.  A bucket tells the knots below the one before it, so that
 * rounding of the bucket's number never leads too far. */
static void fill_buckets(TfTables *o)
{
    const real *knots = o->edges + 1;
    size_t n = o->knot_count, k = 0;
    real width = n > 1 ? knots[n - 1] - knots[0] : 0;
    o->bucket_lo = n ? knots[0] : 0;
    o->bucket_scale = width > 0 && isfinite(KNOT_BUCKETS / width) ? KNOT_BUCKETS / width : 0;
    for (int b = 0; b < KNOT_BUCKETS; b++) {
        real edge = o->bucket_lo + (real)(b - 1) / KNOT_BUCKETS * width;
        while (b > 1 && o->bucket_scale > 0 && k < n && knots[k] < edge)
            k++;
        o->buckets[b] = (int32_t)k;
    }
}

static void fill_few(TfTables *o)
{
    for (size_t j = 0; j <= o->knot_count && j < REGISTER_NUMBERS; j++) {
        const real *numbers = &o->intervals[j].ref;
        for (int n = 0; n < INTERVAL_REALS; n++)
            o->few.numbers[n][j] = numbers[n];
        o->few.next_visible[j] = o->next_visible[j];
    }
}

static unsigned features_of(const VolTfCompiled *tf)
{
    bool shaded = tf->model == VOL_MODEL_HYBRID && (tf->has_surface || tf->isosurface_count);
    bool classic = tf->model == VOL_MODEL_CLASSIC && tf->has_scatter;
    return (tf->has_surface ? FEATURE_SURFACE : 0u) | (tf->coloured ? FEATURE_COLOURED : 0u) |
           (tf->has_emit ? FEATURE_EMIT : 0u) | (tf->isosurface_count ? FEATURE_ISO : 0u) |
           (shaded || classic ? FEATURE_SHADED : 0u) | (classic ? FEATURE_CLASSIC : 0u);
}

static void order_falling(TfTables *o)
{
    size_t filled = 0;
    for (size_t end = o->isosurface_count; end > 0;) {
        size_t begin = end - 1;
        while (begin > 0 && o->isosurfaces[begin - 1].value == o->isosurfaces[end - 1].value)
            begin--;
        for (size_t k = begin; k < end; k++)
            o->falling[filled++] = k;
        end = begin;
    }
}

/* ---- Jumps ---- */

static bool lines_meet(const VolLinear *before, double x, const VolLinear *after)
{
    double a = before->a + before->b * x, b = after->a;
    return fabs(a - b) <= 1e-9 * fmax(fabs(a), fabs(b));
}

/* Whether all that can be seen goes over from one interval to the next without a jump. */
static bool intervals_meet(const VolTfInterval *before, const VolTfInterval *after)
{
    double x = after->v0 - before->v_ref;
    bool meet = lines_meet(&before->scatter, x, &after->scatter) && lines_meet(&before->surface, x, &after->surface) &&
                lines_meet(&before->surfaceness, x, &after->surfaceness);
    for (int c = 0; c < 3 && meet; c++)
        meet = lines_meet(&before->absorb[c], x, &after->absorb[c]) && lines_meet(&before->emit[c], x, &after->emit[c]) &&
               lines_meet(&before->scatter_color[c], x, &after->scatter_color[c]) &&
               lines_meet(&before->surface_color[c], x, &after->surface_color[c]);
    return meet;
}

static bool has_jumps(const VolTfCompiled *tf)
{
    bool jumps = tf->isosurface_count > 0;
    for (size_t i = 0; i < tf->knot_count && !jumps; i++)
        jumps = !intervals_meet(&tf->intervals[i], &tf->intervals[i + 1]);
    return jumps;
}

static VolStatus build_tf_tables(const VolScene *scene, TfTables *o, VolError *err)
{
    const VolTfCompiled *tf = scene->tf;
    size_t intervals = tf->knot_count + 1;
    *o = (TfTables){.knot_count = tf->knot_count,
                  .isosurface_count = tf->isosurface_count,
                  .features = features_of(tf),
                  .channels = tf->coloured ? 3 : 1,
                  .classic = tf->model == VOL_MODEL_CLASSIC,
                  .jumps = has_jumps(tf),
                  .ambient = (real)tf->ambient,
                  .diffuse = (real)tf->diffuse,
                  .specular = (real)tf->specular,
                  .shininess = tf->shininess,
                  .gradient_surfaceness = tf->surfaceness_by_gradient,
                  .g0 = (real)tf->surfaceness_gradient[0],
                  .g1 = (real)tf->surfaceness_gradient[1]};
    o->edges = vol_alloc(intervals + 1, sizeof *o->edges);
    o->intervals = vol_alloc(intervals, sizeof *o->intervals);
    o->next_visible = vol_alloc(intervals + 1, sizeof *o->next_visible);
    o->buckets = vol_alloc(KNOT_BUCKETS, sizeof *o->buckets);
    o->isosurfaces = vol_alloc(tf->isosurface_count, sizeof *o->isosurfaces);
    o->isosurface_values = vol_alloc(tf->isosurface_count, sizeof *o->isosurface_values);
    o->falling = vol_alloc(tf->isosurface_count, sizeof *o->falling);
    if (!o->edges || !o->intervals || !o->next_visible || !o->buckets || !o->isosurfaces || !o->isosurface_values ||
        !o->falling) {
        free_tf_tables(o);
        return vol_fail_memory(err, intervals * sizeof *o->intervals);
    }
    o->edges[0] = -INFINITY;
    o->edges[intervals] = INFINITY;
    o->next_visible[intervals] = (int32_t)intervals;
    for (size_t i = 0; i < tf->knot_count; i++)
        o->edges[i + 1] = real_at_or_above(tf->knots[i]);
    for (size_t i = intervals; i-- > 0;) {
        const VolTfInterval *in = &tf->intervals[i];
        bool visible = in->has_scatter || in->has_absorb || in->has_emit || in->has_surface;
        o->intervals[i] = interval_from(in);
        o->next_visible[i] = visible ? (int32_t)i : o->next_visible[i + 1];
    }
    fill_buckets(o);
    fill_few(o);
    for (size_t i = 0; i < tf->isosurface_count; i++) {
        const VolIsosurface *d = &tf->isosurfaces[i];
        o->isosurfaces[i] = (Isosurface){(real)d->value, {(real)d->color[0], (real)d->color[1], (real)d->color[2]},
                                         d->optical_depth, d->opacity};
        o->isosurface_values[i] = o->isosurfaces[i].value;
    }
    order_falling(o);
    VolStatus status = build_lookup(scene, o, err);
    if (status)
        free_tf_tables(o);
    return status;
}
