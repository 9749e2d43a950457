/* Building tables: ranges, memory, and the diagonals spread over threads. */
#include <float.h>
#include <math.h>
#include <stdlib.h>

#include "base/fmath.h"
#include "base/pool.h"
#include "tf/preint_private.h"

#define MOST_1D_NODES ((size_t)1 << 20)

void vol_preint_default_range(const VolTfCompiled *tf, double *lo, double *hi)
{
    *lo = 0;
    *hi = 1;
    if (tf->node_min <= tf->node_max) {
        *lo = tf->node_min;
        *hi = tf->node_max;
    }
    if (*lo == *hi) {
        double half = *lo != 0 ? fabs(*lo) / 2 : 0.5;
        *lo -= half;
        *hi += half;
    }
}

/* Whether all that a table can hold is a float.  What it is made from may be larger by far, but products of four such
 * numbers must be doubles. */
static VolStatus check_magnitudes(const VolPreint *tables, double last_step, VolError *err)
{
    const double most = 1e60;
    VolTfIntegral sum;
    const VolTfCompiled *tf = tables->integrals.tf;
    vol_tf_integrals_between(&tables->integrals, tables->lo, tables->hi, &sum);
    double largest = fmax(sum.surface, fabs(sum.value)), width = tables->hi - tables->lo;
    for (int c = 0; c < 3; c++)
        largest = fmax(largest, fmax(fmax(sum.surface_color[c], fabs(sum.source[c])), sum.particle[c]));
    if (!(largest < FLT_MAX) || !(largest / width * last_step < most) || !(width < most))
        return vol_fail(err, VOL_BAD_INPUT, "the transfer function's integrals are too large to tabulate");
    if (!(tf->max_color < FLT_MAX / 4) || !(tf->max_emit * last_step < FLT_MAX / 4))
        return vol_fail(err, VOL_BAD_INPUT, "the transfer function's colours are too large to tabulate");
    return VOL_OK;
}

static VolStatus check_options(const VolPreintOptions *o, VolError *err)
{
    size_t most = o->octaves ? VOL_PREINT_MOST_NODES : MOST_1D_NODES;
    if (!(isfinite(o->lo) && isfinite(o->hi) && o->lo < o->hi))
        return vol_fail(err, VOL_BAD_INPUT, "the range is empty");
    if (o->n < 2 || o->n > most)
        return vol_fail(err, VOL_BAD_INPUT, "%zu nodes, not 2 to %zu", o->n, most);
    double spacing = (o->hi - o->lo) / (double)(o->n - 1);
    if (!(o->lo + spacing > o->lo && o->hi - spacing < o->hi))
        return vol_fail(err, VOL_BAD_INPUT, "%zu nodes do not fit between numbers so close to each other", o->n);
    if (o->octaves && !(o->step > 0 && isfinite(o->step)))
        return vol_fail(err, VOL_BAD_INPUT, "the step is %g, not above 0", o->step);
    if (o->octaves > 32)
        return vol_fail(err, VOL_BAD_INPUT, "%zu octaves, not up to 32", o->octaves);
    return VOL_OK;
}

/* The diagonals that a change of the value over the step can reach, and one more for interpolation. */
static size_t band_of(const VolPreint *tables, double change)
{
    double bins = ceil(change / ((tables->hi - tables->lo) / (double)(tables->n - 1))) + 1;
    size_t all = tables->n - 1;
    return bins < (double)all ? (size_t)bins : all;
}

static VolStatus allocate_table(const VolPreint *tables, VolPreintTable *table, VolError *err)
{
    size_t rows = table->band + 1, entries = rows * tables->n - rows * (rows - 1) / 2;
    if (!vol_pages_grow(&table->pages, 2 * entries, tables->floats * sizeof(float)))
        return vol_fail_memory(err, 2 * entries * tables->floats * sizeof(float));
    table->rising = table->pages.data;
    table->falling = table->rising + entries * tables->floats;
    return VOL_OK;
}

static bool differ(double a, double b) { return fabs(a - b) > fmax(a, b) / 16; }

/* Whether something begins or ends at once between two samples at one value. */
static bool jumps(const VolTfSample *a, const VolTfSample *b)
{
    bool any = differ(a->surface, b->surface);
    for (int c = 0; c < 3; c++)
        any = any || differ(a->particle[c], b->particle[c]) || differ(a->source[c], b->source[c]) ||
              differ(a->surface * a->surface_color[c], b->surface * b->surface_color[c]);
    return any;
}

/* Whether what attenuates runs to 0 at the sample while something still shines: opacity goes to 0 there, the colour that
 * belongs to it to infinity. */
static bool runs_out(const VolTfSample *at, const VolTfSample *beyond)
{
    bool any = false;
    for (int c = 0; c < 3; c++)
        any = any || (at->source[c] > 0 && at->particle[c] <= 1e-6 * beyond->particle[c] && beyond->particle[c] > 0);
    return any;
}

/* The properties on both sides of a knot. */
static void sample_sides(const VolTfCompiled *tf, size_t knot, VolTfSample *left, VolTfSample *right)
{
    vol_tf_sample_within(&tf->intervals[knot], tf->knots[knot], left);
    vol_tf_sample_within(&tf->intervals[knot + 1], tf->knots[knot], right);
}

/* Whether properties break at a knot in (v0, v1]: there what lies between a bin's ends is not between what they show. */
static bool breaks_between(const VolTfCompiled *tf, double v0, double v1)
{
    for (size_t i = vol_tf_interval(tf, v0); i < tf->knot_count && tf->knots[i] <= v1; i++) {
        const VolTfInterval *below = &tf->intervals[i], *above = below + 1;
        VolTfSample left, right, low, high;
        sample_sides(tf, i, &left, &right);
        vol_tf_sample_within(below, fmax(below->v0, v0), &low);
        vol_tf_sample_within(above, fmin(above->v1, v1), &high);
        if (tf->knots[i] > v0 && (jumps(&left, &right) || runs_out(&left, &low) || runs_out(&right, &high)))
            return true;
    }
    return false;
}

/* The largest of each property at knots. */
static VolTfSample largest_at_knots(const VolTfCompiled *tf)
{
    VolTfSample most = {.surface = 0};
    for (size_t i = 0; i < tf->knot_count; i++) {
        VolTfSample side[2];
        sample_sides(tf, i, &side[0], &side[1]);
        for (int s = 0; s < 2; s++) {
            most.surface = fmax(most.surface, side[s].surface);
            for (int c = 0; c < 3; c++) {
                most.particle[c] = fmax(most.particle[c], side[s].particle[c]);
                most.source[c] = fmax(most.source[c], side[s].source[c]);
            }
        }
    }
    return most;
}

/* Whether a lies farther from the chord, `share` of the way from v to w, than an eighth of the largest. */
static bool lies_off(double a, double v, double w, double share, double most)
{
    return fabs(a - (v + (w - v) * share)) > most / 8;
}

/* Whether properties bend so sharply at a knot in (v0, v1) that what lies between a bin's ends is far from what they show:
 * there is a peak, a pit, or the foot or top of a steep slope. */
static bool bends_between(const VolTfCompiled *tf, double v0, double v1, const VolTfSample *most)
{
    VolTfSample low, high;
    vol_tf_sample(tf, v0, &low);
    vol_tf_sample(tf, v1, &high);
    for (size_t i = vol_tf_interval(tf, v0); i < tf->knot_count && tf->knots[i] < v1; i++) {
        double share = (tf->knots[i] - v0) / (v1 - v0);
        VolTfSample at, below;
        sample_sides(tf, i, &below, &at);
        bool off = lies_off(at.surface, low.surface, high.surface, share, most->surface);
        for (int c = 0; c < 3; c++)
            off = off || lies_off(at.particle[c], low.particle[c], high.particle[c], share, most->particle[c]) ||
                  lies_off(at.source[c], low.source[c], high.source[c], share, most->source[c]);
        if (off)
            return true;
    }
    return false;
}

/* Marks the bins in which a surface is so dense that entries at their ends say little of what lies between, and those in
 * which properties break or bend sharply. */
static VolStatus mark_dense_bins(VolPreint *tables, VolError *err)
{
    const VolTfCompiled *tf = tables->integrals.tf;
    const VolTfSample most = largest_at_knots(tf);
    tables->dense = vol_alloc_zero(tables->n, 1);
    if (!tables->dense)
        return vol_fail_memory(err, tables->n);
    for (size_t i = 0; i + 1 < tables->n; i++) {
        VolTfIntegral bin;
        double v0 = vol_preint_node(tables, i), v1 = vol_preint_node(tables, i + 1);
        vol_tf_integrals_between(&tables->integrals, v0, v1, &bin);
        tables->dense[i] =
            bin.surface > VOL_PREINT_DENSE || breaks_between(tf, v0, v1) || bends_between(tf, v0, v1, &most);
    }
    return VOL_OK;
}

VolStatus vol_preint_allocate(const VolTfCompiled *tf, const VolPreintOptions *options, const size_t *bands,
                              VolPreint *out, VolError *err)
{
    *out = (VolPreint){.lo = options->lo, .hi = options->hi, .n = options->n, .channels = tf->coloured ? 3 : 1};
    out->floats = 3 * (size_t)out->channels + 9;
    VolStatus status = check_options(options, err);
    if (!status)
        status = vol_tf_integrals_new(tf, &out->integrals, err);
    if (!status)
        status = check_magnitudes(out, options->octaves ? ldexp(options->step, (int)options->octaves - 1) : 1, err);
    if (!status)
        status = mark_dense_bins(out, err);
    if (!status && options->octaves) {
        out->octaves = vol_alloc_zero(options->octaves, sizeof *out->octaves);
        status = out->octaves ? VOL_OK : vol_fail_memory(err, options->octaves * sizeof *out->octaves);
    }
    for (size_t o = 0; !status && o < options->octaves; o++) {
        VolPreintTable *table = &out->octaves[out->octave_count++];
        table->step = ldexp(options->step, (int)o);
        table->band = bands ? bands[o] : band_of(out, ldexp(options->change, (int)o));
        status = allocate_table(out, table, err);
    }
    if (status)
        vol_preint_free(out);
    return status;
}

void vol_preint_free(VolPreint *tables)
{
    for (size_t o = 0; o < tables->octave_count; o++)
        vol_pages_free(&tables->octaves[o].pages);
    free(tables->octaves);
    free(tables->dense);
    vol_tf_integrals_free(&tables->integrals);
    *tables = (VolPreint){0};
}

/* v0 = v1: homogeneous particles, no surface. */
static void put_main_diagonal(const VolPreint *tables, const VolPreintTable *table)
{
    size_t channels = (size_t)tables->channels;
    for (size_t i = 0; i < tables->n; i++) {
        VolPreintSegment s;
        float *entry = vol_preint_entry(tables, table, i, i);
        double v = vol_preint_node(tables, i);
        vol_preint_segment(tables->integrals.tf, v, v, table->step, &s);
        for (size_t c = 0; c < 3; c++) {
            if (c < channels)
                entry[2 * channels + c] = (float)s.p_a[c];
            entry[3 * channels + 6 + c] = (float)s.p_c[c];
        }
    }
}

/* On diagonal k a step's whole optical depth falls on k bins.  What a leaf leaves out, knots and the curvature of
 * the properties over its optical depth, falls at least as fast as 1 / k^3: bins of the first diagonals are cut
 * finer.  Of very many knots those of the last level are passed over: their bins keep means and first moments. */
typedef struct Level {
    size_t last; /* diagonal */
    VolPreintCut how;
} Level;

enum { LEVELS = 4, MANY_KNOTS = 65536 };
static const Level levels[LEVELS] = {{4, {16, SIZE_MAX}}, {16, {4, SIZE_MAX}}, {64, {1, SIZE_MAX}}, {SIZE_MAX, {1, 16}}};

typedef struct Building {
    const VolPreint *tables;
    const VolPreintTable *table;
    VolPreintDiagonal *diagonal;
    Bins bins[LEVELS][3]; /* per channel of attenuation */
    State **work; /* one per thread: leaves, then suffixes */
} Building;

static VolStatus build_diagonal(void *user, size_t index, int thread, VolError *err)
{
    const Building *b = user;
    (void)err;
    State *leaves = b->work[thread], *suffix = leaves + b->tables->n;
    size_t k = index + 1;
    int level = 0;
    while (levels[level].last < k)
        level++;
    for (int c = 0; c < b->tables->channels; c++)
        b->diagonal(b->tables, b->table, &b->bins[level][c], k, c, leaves, suffix);
    return VOL_OK;
}

static VolStatus build_tables(const VolPreint *tables, int threads, Building *b, VolError *err)
{
    VolStatus status = VOL_OK;
    for (int l = 0; l < LEVELS; l++)
        for (int c = 0; !status && c < tables->channels; c++) {
            VolPreintCut how = levels[l].how;
            if (tables->integrals.tf->knot_count > (l == LEVELS - 1 ? 2 * tables->n : MANY_KNOTS))
                how.most_knots = l == LEVELS - 1 ? 0 : 16;
            status = vol_preint_bins(tables, c, how, &b->bins[l][c], err);
        }
    for (int t = 0; !status && t < threads; t++) {
        b->work[t] = vol_alloc_aligned(64, 2 * tables->n, sizeof(State));
        if (!b->work[t])
            status = vol_fail_memory(err, 2 * tables->n * sizeof(State));
    }
    for (size_t o = 0; !status && o < tables->octave_count; o++) {
        b->table = &tables->octaves[o];
        put_main_diagonal(tables, b->table);
        status = vol_parallel(threads, b->table->band, build_diagonal, b, err);
    }
    return status;
}

VolStatus vol_preint_build(const VolTfCompiled *tf, const VolPreintOptions *options, VolPreint *out, VolError *err)
{
    int threads = options->threads > 1 ? options->threads : 1;
    VolStatus status = vol_preint_allocate(tf, options, NULL, out, err);
    if (status)
        return status;
    Building b = {.tables = out, .diagonal = vol_preint_diagonal,
                  .work = vol_alloc_zero((size_t)threads, sizeof *b.work)};
#if defined(__x86_64__)
    if (vol_cpu_runs_avx2(options->cpu))
        b.diagonal = vol_preint_diagonal_avx2;
#endif
    status = b.work ? build_tables(out, threads, &b, err) : vol_fail_memory(err, (size_t)threads * sizeof *b.work);
    for (int t = 0; b.work && t < threads; t++)
        free(b.work[t]);
    for (int l = 0; l < LEVELS; l++)
        for (int c = 0; c < 3; c++)
            vol_preint_bins_free(&b.bins[l][c]);
    free(b.work);
    if (status)
        vol_preint_free(out);
    return status;
}
