/* From the compiled transfer function to the kernel's tables; once for float, once for double. */
#include <math.h>

#include "trace/jumps.h"
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
    free(o->jump);
    free(o->intervals);
    free(o->next_visible);
    free(o->buckets);
    free(o->isosurfaces);
    free(o->isosurface_values);
    free(o->falling);
    free_lookup(o);
}

/* How many knots lie below where a bucket begins, or some buckets on. */
static size_t knots_below(const TfTables *o, int bucket, real width, size_t from)
{
    const real *knots = o->edges + 1;
    real edge = o->bucket_lo + (real)bucket / KNOT_BUCKETS * width;
    while (from < o->knot_count && knots[from] < edge)
        from++;
    return from;
}

/* Buckets of equal width from the first knot to the last.  A bucket tells the knots below the one before it, and a search
 * that begins there ends below the one after it at the latest, so that rounding of the bucket's number never leads astray.
 * Values below the first knot are in the first bucket, those above the last one in the last. */
static void fill_buckets(TfTables *o)
{
    const real *knots = o->edges + 1;
    size_t n = o->knot_count, below = 0, end = 0;
    real width = n > 1 ? knots[n - 1] - knots[0] : 0;
    o->bucket_lo = n ? knots[0] : 0;
    o->bucket_scale = width > 0 && isfinite(KNOT_BUCKETS / width) ? KNOT_BUCKETS / width : 0;
    o->bucket_steps = o->bucket_scale > 0 ? 1 : (int32_t)n;
    for (int b = 0; b < KNOT_BUCKETS; b++) {
        if (b > 1 && o->bucket_scale > 0)
            below = knots_below(o, b - 1, width, below);
        o->buckets[b] = (int32_t)below;
        end = b + 2 < KNOT_BUCKETS ? knots_below(o, b + 2, width, end) : n;
        if (o->bucket_scale > 0 && (int32_t)(end - below) > o->bucket_steps)
            o->bucket_steps = (int32_t)(end - below);
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

/* The most that give_up_steep() can make of any interval in a cell whose values change by as much as the largest one: where
 * even that is less than what it lets pass, it need not be asked. */
static bool is_steep(const VolScene *scene)
{
    const VolTfCompiled *tf = scene->tf;
    const VolAffine *m = vol_volume_to_world(&scene->volume);
    double lo, hi, most = 0, diagonal = 0;
    for (int a = 0; a < 3; a++)
        diagonal += sqrt(m->m[a][0] * m->m[a][0] + m->m[a][1] * m->m[a][1] + m->m[a][2] * m->m[a][2]);
    for (size_t j = 0; j <= tf->knot_count; j++) {
        const VolTfInterval *in = &tf->intervals[j];
        double width = isfinite(in->v1 - in->v0) ? in->v1 - in->v0 : 0;
        for (int c = 0; c < 3; c++)
            most = fmax(most, (fabs(in->scatter.b + in->absorb[c].b) + fabs(in->emit[c].b)) * diagonal +
                                  fabs(in->scatter_color[c].b) + fabs(in->surface.a) + fabs(in->surface.b) * width);
    }
    bool some = vol_volume_range(&scene->volume, &lo, &hi);
    return some && !(most * 2 * fmax(fabs(lo), fabs(hi)) * 0x1p-24 < BLUR_LIMIT);
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
                  .steep = is_steep(scene),
                  .jumps = vol_has_jumps(tf),
                  .ambient = (real)tf->ambient,
                  .diffuse = (real)tf->diffuse,
                  .specular = (real)tf->specular,
                  .shininess = tf->shininess,
                  .gradient_surfaceness = tf->surfaceness_by_gradient,
                  .g0 = (real)tf->surfaceness_gradient[0],
                  .g1 = (real)tf->surfaceness_gradient[1]};
    o->edges = vol_alloc(intervals + 1, sizeof *o->edges);
    o->jump = vol_alloc_zero(intervals + 1, sizeof *o->jump);
    o->intervals = vol_alloc(intervals, sizeof *o->intervals);
    o->next_visible = vol_alloc(intervals + 1, sizeof *o->next_visible);
    o->buckets = vol_alloc(KNOT_BUCKETS, sizeof *o->buckets);
    o->isosurfaces = vol_alloc(tf->isosurface_count, sizeof *o->isosurfaces);
    o->isosurface_values = vol_alloc(tf->isosurface_count, sizeof *o->isosurface_values);
    o->falling = vol_alloc(tf->isosurface_count, sizeof *o->falling);
    if (!o->edges || !o->jump || !o->intervals || !o->next_visible || !o->buckets || !o->isosurfaces ||
        !o->isosurface_values || !o->falling) {
        free_tf_tables(o);
        return vol_fail_memory(err, intervals * sizeof *o->intervals);
    }
    o->edges[0] = -INFINITY;
    o->edges[intervals] = INFINITY;
    o->next_visible[intervals] = (int32_t)intervals;
    for (size_t i = 0; i < tf->knot_count; i++) {
        o->edges[i + 1] = real_at_or_above(tf->knots[i]);
        o->jump[i + 1] = (real)vol_jump_at_knot(tf, i);
    }
    for (size_t i = intervals; i-- > 0;) {
        const VolTfInterval *in = &tf->intervals[i];
        bool visible = in->has_scatter || in->has_absorb || in->has_emit || in->has_surface;
        o->intervals[i] = interval_from(in);
        o->next_visible[i] = visible ? (int32_t)i : o->next_visible[i + 1];
    }
    fill_buckets(o);
    fill_few(o);
    for (size_t i = 0; i < tf->isosurface_count; i++) {
        const VolIsosurface *d = &tf->isosurfaces[i], *before = i > 0 ? d - 1 : NULL;
        real value = before ? real_in_order(before->value, o->isosurface_values[i - 1], d->value) : (real)d->value;
        o->isosurfaces[i] = (Isosurface){value, {(real)d->color[0], (real)d->color[1], (real)d->color[2]},
                                         (real)vol_particles_around(tf, d->value), d->optical_depth, d->opacity};
        o->isosurface_values[i] = value;
    }
    order_falling(o);
    VolStatus status = build_lookup(scene, o, err);
    if (status)
        free_tf_tables(o);
    return status;
}
