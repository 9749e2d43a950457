/* Pre-integration: segments against published numbers, tables against segments, and what must hold of both. */
#include "test.h"

#include <float.h>
#include <jansson.h>
#include <stdint.h>
#include <stdlib.h>

#include "tf/preint.h"
#include "tf/preint_private.h"

/* ---- Transfer functions to test with ---- */

static uint64_t seed = 1;

static double chance(void)
{
    seed = seed * 6364136223846793005u + 1442695040888963407u;
    return (double)(seed >> 11) * 0x1p-53;
}

static VolTfCompiled compile(const char *text)
{
    VolTf tf;
    VolTfCompiled compiled = {0};
    VolError err = {{0}};
    VolBytes bytes = {(unsigned char *)(uintptr_t)text, strlen(text)};
    VolStatus status = vol_tf_parse(&bytes, "test", &tf, NULL, &err);
    if (!status) {
        status = vol_tf_compile(&tf, NULL, &compiled, &err);
        vol_tf_free(&tf);
    }
    if (status)
        FAIL("%s", err.text);
    return compiled;
}

static size_t add(char *text, size_t size, size_t at, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    at += (size_t)vsnprintf(text + at, size - at, format, args);
    va_end(args);
    return at;
}

static size_t add_list(char *text, size_t size, size_t at, const char *key, int nodes, double most)
{
    at = add(text, size, at, ", \"%s\": [", key);
    double v = 0;
    for (int i = 0; i < nodes; i++) {
        double y = chance() < 0.3 ? 0 : most * chance();
        at = add(text, size, at, "%s[%.17g, %.17g, [%.17g, %.17g, %.17g]]", i ? ", " : "", v, y, chance(), chance(),
                 chance());
        if (chance() < 0.85) /* else a jump */
            v += (0.1 + chance()) / nodes;
        else
            at = add(text, size, at, ", [%.17g, %.17g]", v, most * chance()), v += (0.1 + chance()) / nodes;
    }
    return add(text, size, at, "]");
}

/* All kinds of matter, knots anywhere, jumps. */
static VolTfCompiled random_tf(bool colored)
{
    static char text[1 << 14];
    size_t at = add(text, sizeof text, 0, "{\"pellucid\": \"transfer-function/1\", \"particle_step\": 0.5, "
                                          "\"scalar_step\": 0.2, \"interpolate\": \"extinction\"");
    at = add_list(text, sizeof text, at, "surface", 5, 0.9);
    at = add_list(text, sizeof text, at, "scatter", 4, 0.95);
    at = add_list(text, sizeof text, at, "emit", 3, 1);
    if (colored)
        at = add_list(text, sizeof text, at, "absorb", 3, 0.9);
    add(text, sizeof text, at, "}");
    return compile(text);
}

static VolPreint build(const VolTfCompiled *tf, VolPreintOptions options)
{
    VolPreint tables = {0};
    VolError err = {{0}};
    if (options.lo == options.hi)
        vol_preint_default_range(tf, &options.lo, &options.hi);
    if (options.change == 0)
        options.change = INFINITY;
    if (vol_preint_build(tf, &options, &tables, &err))
        FAIL("%s", err.text);
    return tables;
}

/* ---- Published numbers ---- */

static json_t *reference(const char *name)
{
    char path[512];
    const char *tests = getenv("TESTS");
    snprintf(path, sizeof path, "%s/reference/%s", tests ? tests : "tests", name);
    json_t *root = json_load_file(path, JSON_DECODE_INT_AS_REAL, NULL);
    if (!root)
        FAIL("cannot read %s", path);
    return root;
}

static double number(const json_t *object, const char *key) { return json_number_value(json_object_get(object, key)); }

static size_t add_reference_list(char *text, size_t size, size_t at, const json_t *tf, const char *key, const char *amount,
                                 const char *color, double step, bool opacity)
{
    const json_t *knots = json_object_get(tf, "knots"), *mu = json_object_get(tf, amount),
                 *c = color ? json_object_get(tf, color) : NULL;
    at = add(text, size, at, ", \"%s\": [", key);
    for (size_t i = 0; i < json_array_size(knots); i++) {
        double y = json_number_value(json_array_get(mu, i)) * step, rgb = c ? json_number_value(json_array_get(c, i)) : 1;
        at = add(text, size, at, "%s[%.17g, %.17g, [%.17g, %.17g, %.17g]]", i ? ", " : "",
                 json_number_value(json_array_get(knots, i)), opacity ? -expm1(-y) : y, rgb, rgb, rgb);
    }
    return add(text, size, at, "]");
}

static VolTfCompiled yang_tf(const json_t *root)
{
    char text[8192];
    const json_t *tf = json_object_get(root, "tf");
    double step = 0.05;
    size_t at = add(text, sizeof text, 0, "{\"pellucid\": \"transfer-function/1\", \"interpolate\": \"extinction\", "
                                          "\"particle_step\": 0.05, \"scalar_step\": 0.05");
    at = add_reference_list(text, sizeof text, at, tf, "surface", "mu_sg", "c_s", step, true);
    at = add_reference_list(text, sizeof text, at, tf, "scatter", "mu_p", "c_p", step, true);
    at = add_reference_list(text, sizeof text, at, tf, "emit", "e_p", NULL, step, false);
    add(text, sizeof text, at, "}");
    return compile(text);
}

/* Adds what lies from s0 to s1 of a longer segment, seen through `t`. */
static void add_part(VolPreintSegment *sum, double *t, const VolPreintSegment *part, double s0, double s1)
{
    double a = part->fw_a[0] + part->bw_a[0], c = part->fw_c[0] + part->bw_c[0];
    double back = s0 * a + (s1 - s0) * part->bw_a[0], back_c = s0 * c + (s1 - s0) * part->bw_c[0];
    sum->bw_a[0] += *t * back;
    sum->fw_a[0] += *t * (a - back);
    sum->bw_c[0] += *t * back_c;
    sum->fw_c[0] += *t * (c - back_c);
    sum->p_a[0] += *t * part->p_a[0];
    sum->p_c[0] += *t * part->p_c[0];
    *t *= 1 - part->alpha[0];
}

/* With isosurfaces: cut where v crosses one. */
static void cut_segment(const VolTfCompiled *tf, const json_t *isosurfaces, double v0, double v1, double dl,
                        VolPreintSegment *sum, double *t)
{
    double s = 0, v = v0;
    *sum = (VolPreintSegment){{0}};
    *t = 1;
    for (size_t n = 0, count = json_array_size(isosurfaces); n <= count; n++) {
        const json_t *delta = n < count ? json_array_get(isosurfaces, v1 > v0 ? n : count - 1 - n) : NULL;
        double value = delta ? json_number_value(json_array_get(delta, 0)) : v1;
        if (delta && (v0 < value) == (v1 < value))
            continue;
        double end = delta ? (value - v0) / (v1 - v0) : 1;
        VolPreintSegment part;
        vol_preint_segment(tf, v, value, dl * (end - s), &part);
        add_part(sum, t, &part, s, end);
        s = end;
        v = value;
        if (!delta)
            break;
        double alpha = -expm1(-json_number_value(json_array_get(delta, 1)));
        double c = json_number_value(json_array_get(delta, 2));
        VolPreintSegment surface = {.fw_a = {alpha}, .fw_c = {alpha * c}, .alpha = {alpha}};
        add_part(sum, t, &surface, s, s);
    }
}

static void test_published_segments(void)
{
    json_t *root = reference("yang_segments.json");
    VolTfCompiled tf = yang_tf(root);
    const json_t *isosurfaces = json_object_get(json_object_get(root, "tf"), "deltas");
    const json_t *segments = json_object_get(root, "segments");
    CHECK(json_array_size(segments) == 41);
    for (size_t i = 0; i < json_array_size(segments); i++) {
        const json_t *want = json_array_get(segments, i);
        VolPreintSegment got;
        double t, parts = number(want, "alpha_s_fw") + number(want, "alpha_s_bw") + number(want, "alpha_p");
        if (fabs(parts + number(want, "T") - 1) > 1e-6) { /* its quadrature failed at a depth of a million: no truth */
            CHECK(number(want, "dl") == 1e6);
            continue;
        }
        cut_segment(&tf, isosurfaces, number(want, "v0"), number(want, "v1"), number(want, "dl"), &got, &t);
        CHECK_NEAR(t, number(want, "T"), 1e-11, 1e-15); /* 1 - alpha has the digits of alpha */
        CHECK_NEAR(got.fw_a[0], number(want, "alpha_s_fw"), 1e-11, 1e-15);
        CHECK_NEAR(got.bw_a[0], number(want, "alpha_s_bw"), 1e-11, 1e-15);
        CHECK_NEAR(got.fw_c[0], number(want, "c_s_fw"), 1e-11, 1e-15);
        CHECK_NEAR(got.bw_c[0], number(want, "c_s_bw"), 1e-11, 1e-15);
        CHECK_NEAR(got.p_a[0], number(want, "alpha_p"), 1e-11, 1e-15);
        CHECK_NEAR(got.p_c[0], number(want, "c_p"), 1e-11, 1e-15);
    }
    vol_tf_compiled_free(&tf);
    json_decref(root);
}

/* psi(F, B) is what a segment shows whose extinction runs from F to B and that glows with 1. */
static void test_linear_extinction(void)
{
    json_t *root = reference("psi_values.json");
    const json_t *values = json_object_get(root, "values");
    CHECK(json_array_size(values) == 144);
    double knots[2] = {0, 1};
    VolTfInterval intervals[3] = {{.v0 = -INFINITY, .v1 = 0}, {.v0 = 0, .v1 = 1}, {.v0 = 1, .v1 = INFINITY, .v_ref = 1}};
    VolTfCompiled tf = {.knots = knots, .knot_count = 2, .intervals = intervals};
    for (size_t i = 0; i < json_array_size(values); i++) {
        const json_t *row = json_array_get(values, i);
        double f = json_number_value(json_array_get(row, 0)), b = json_number_value(json_array_get(row, 1));
        double want = strtod(json_string_value(json_array_get(row, 2)), NULL);
        intervals[1].scatter = (VolLinear){f, b - f};
        for (int c = 0; c < 3; c++)
            intervals[1].emit[c] = (VolLinear){1, 0};
        VolPreintSegment got;
        vol_preint_segment(&tf, 0, 1, 1, &got);
        CHECK_NEAR(got.p_c[0], want, 1e-13, 0);
        CHECK_NEAR(got.alpha[0], -expm1(-(f + b) / 2), 1e-14, 0);
    }
    json_decref(root);
}

/* ---- Tables ---- */

static double entry_error(const VolPreint *t, const VolPreintTable *table, size_t i, size_t j)
{
    VolPreintSegment s;
    double most = 0;
    size_t n = (size_t)t->channels;
    const float *e = vol_preint_entry(t, table, i, j);
    vol_preint_segment(t->integrals.tf, vol_preint_node(t, i), vol_preint_node(t, j), table->step, &s);
    for (size_t c = 0; c < 3; c++) {
        size_t a = n == 3 ? c : 0, color = 3 * n + c;
        const double want[6] = {s.fw_a[c], s.bw_a[c], s.p_a[c], s.fw_c[c], s.bw_c[c], s.p_c[c]};
        const float got[6] = {e[a], e[n + a], e[2 * n + a], e[color], e[color + 3], e[color + 6]};
        for (int k = 0; k < 6; k++)
            most = fmax(most, fabs((double)got[k] - want[k]));
    }
    return most;
}

static double random_error(const VolPreint *t, int trials, size_t nodes)
{
    double most = 0;
    for (int k = 0; k < trials; k++) {
        size_t every = (t->n - 1) / (nodes - 1);
        size_t i = (size_t)(chance() * (double)nodes), j = (size_t)(chance() * (double)nodes);
        most = fmax(most, entry_error(t, &t->octaves[0], i * every, j * every));
    }
    return most;
}

static void test_against_quadrature(void)
{
    for (int k = 0; k < 12; k++) {
        VolTfCompiled tf = random_tf(k & 1);
        VolPreint t = build(&tf, (VolPreintOptions){.n = 257, .step = k < 6 ? 0.5 : 3, .octaves = 1, .threads = 2});
        CHECK_NEAR(random_error(&t, 1500, 257), 0, 0, 1e-6);
        vol_preint_free(&t);
        vol_tf_compiled_free(&tf);
    }
}

/* The whole range in n - 1 bins, none of them cut: order 2 at least, with knots and jumps inside bins. */
static double coarse_error(const VolTfCompiled *tf, size_t n)
{
    VolPreintOptions options = {.n = n, .step = 1, .octaves = 1, .change = INFINITY};
    VolPreint t;
    Bins bins[3];
    VolError err;
    State *work = vol_alloc_aligned(64, 2 * n, sizeof *work);
    vol_preint_default_range(tf, &options.lo, &options.hi);
    CHECK(vol_preint_allocate(tf, &options, NULL, &t, &err) == VOL_OK);
    for (int c = 0; c < t.channels; c++) {
        CHECK(vol_preint_bins(&t, c, (VolPreintCut){1, 0}, &bins[c], &err) == VOL_OK);
        vol_preint_diagonal(&t, &t.octaves[0], &bins[c], n - 1, c, work, work + n);
        vol_preint_bins_free(&bins[c]);
    }
    double error = entry_error(&t, &t.octaves[0], 0, n - 1) + entry_error(&t, &t.octaves[0], n - 1, 0);
    vol_preint_free(&t);
    free(work);
    return error;
}

static void test_order(void)
{
    enum { OCTAVES = 5, TRIALS = 12 };
    double error[OCTAVES] = {0}, slope = 0, sum_x2 = 0;
    for (int k = 0; k < TRIALS; k++) {
        VolTfCompiled tf = random_tf(k & 1);
        for (int o = 0; o < OCTAVES; o++)
            error[o] += coarse_error(&tf, ((size_t)8 << o) + 1) / TRIALS;
        vol_tf_compiled_free(&tf);
    }
    for (int o = 0; o < OCTAVES; o++) {
        double x = o - (OCTAVES - 1) / 2.0;
        slope -= x * log2(error[o]);
        sum_x2 += x * x;
    }
    if (!(slope / sum_x2 >= 1.9))
        FAIL("order %.2f, errors %.3g %.3g %.3g %.3g %.3g", slope / sum_x2, error[0], error[1], error[2], error[3],
             error[4]);
}

/* With depths of 1e4 in each bin and far beyond. */
static void test_deep_bins_stay_finite(void)
{
    static const double steps[] = {1, 1e-3, 1e-6, 1e-12};
    for (int k = 0; k < 4; k++) {
        char text[512];
        snprintf(text, sizeof text, "{\"pellucid\": \"transfer-function/1\", \"particle_step\": %g, "
                 "\"scalar_step\": %g, \"surface\": [[0, 0.1], [0.3, 1, [1, 0, 0]], [1, 0.9]], "
                 "\"scatter\": [[0, 1, [0, 1, 0]], [0.5, 0], [1, 1]], "
                 "\"absorb\": [[0.2, 0, [1, 0.5, 0]], [0.8, 1, [1, 0.5, 0]]], "
                 "\"emit\": [[0, 1], [1, 0]]}", steps[k], steps[k]);
        VolTfCompiled tf = compile(text);
        VolPreint t = build(&tf, (VolPreintOptions){.n = 65, .step = 65 * 1e4, .octaves = 2, .threads = 1});
        for (size_t o = 0; o < 2; o++)
            for (size_t i = 0; i < t.n; i++)
                for (size_t j = 0; j < t.n; j++)
                    for (size_t f = 0; f < t.floats; f++) {
                        float x = vol_preint_entry(&t, &t.octaves[o], i, j)[f];
                        CHECK(isfinite(x) && x >= 0);
                        CHECK(f >= 9 || x <= 1);
                    }
        VolPreintSegment s;
        vol_preint_full_at(&t, 0.21, 0.77, 1e9, &s);
        CHECK_NEAR(s.alpha[0], 1, 1e-15, 0);
        CHECK(isfinite(s.fw_c[0] + s.bw_c[1] + s.p_c[2]));
        vol_preint_free(&t);
        vol_tf_compiled_free(&tf);
    }
}

/* The leaves of a diagonal, composed one by one, are what the windows are, rounded to float. */
static void test_windows_are_compositions(void)
{
    enum { N = 97 };
    VolTfCompiled tf = random_tf(false);
    VolPreint t = build(&tf, (VolPreintOptions){.n = N, .step = 1, .octaves = 1, .threads = 1});
    VolError err;
    Bins bins;
    State *work = vol_alloc_aligned(64, 2 * N, sizeof *work);
    CHECK(vol_preint_bins(&t, 0, (VolPreintCut){1, SIZE_MAX}, &bins, &err) == VOL_OK);
    size_t compared = 0, unlike = 0;
    for (size_t k = 1; k < N; k++) {
        vol_preint_diagonal(&t, &t.octaves[0], &bins, k, 0, work, work + N);
        for (size_t i = 0; i + k < N; i++)
            for (int lane = 0; lane < 2; lane++) {
                double through = 1, a0 = 0, a1 = 0, p = 0, c0 = 0, c1 = 0, q = 0;
                for (size_t b = 0; b < k; b++) {
                    const State *leaf = &work[i + b];
                    const Light *opacity = &leaf->light[0], *green = &leaf->light[1]; /* quantities 0 and 2 */
                    a0 += through * opacity->all[lane];
                    a1 += through * (opacity->moment[lane] + (double)b * opacity->all[lane]);
                    p += through * opacity->particles[lane];
                    c0 += through * green->all[lane];
                    c1 += through * (green->moment[lane] + (double)b * green->all[lane]);
                    q += through * green->particles[lane];
                    through *= leaf->t[lane];
                }
                const float *e = lane ? vol_preint_entry(&t, &t.octaves[0], N - 1 - i, N - 1 - i - k)
                                      : vol_preint_entry(&t, &t.octaves[0], i, i + k);
                const double want[6] = {a0 - a1 / (double)k, a1 / (double)k, p, c0 - c1 / (double)k, c1 / (double)k, q};
                const float got[6] = {e[0], e[1], e[2], e[4], e[7], e[10]};
                for (int f = 0; f < 6; f++, compared++) {
                    unlike += got[f] != (float)want[f];
                    CHECK_NEAR((double)got[f], want[f], 0x1.00001p-24, 1e-30);
                }
            }
    }
    /* A difference of d makes another float in d / 1e-7 of the cases. */
    if (unlike > 2)
        FAIL("%zu of %zu floats are not the nearest", unlike, compared);
    free(work);
    vol_preint_bins_free(&bins);
    vol_preint_free(&t);
    vol_tf_compiled_free(&tf);
}

/* T_2l(i, j) = T_l(i, m) o T_l(m, j), m halfway. */
static void test_octaves_double(void)
{
    VolTfCompiled tf = random_tf(true);
    VolPreint t = build(&tf, (VolPreintOptions){.n = 129, .step = 0.4, .octaves = 3, .threads = 2});
    CHECK(t.octave_count == 3 && t.octaves[2].step == 0.4 * 4);
    for (size_t o = 0; o < 2; o++)
        for (size_t i = 0; i < t.n; i += 3)
            for (size_t j = i & 1; j < t.n; j += 2) {
                const float *a = vol_preint_entry(&t, &t.octaves[o], i, (i + j) / 2),
                            *b = vol_preint_entry(&t, &t.octaves[o], (i + j) / 2, j),
                            *e = vol_preint_entry(&t, &t.octaves[o + 1], i, j);
                for (size_t c = 0; c < 3; c++) {
                    double through = 1 - (double)(a[c] + a[3 + c] + a[6 + c]), all = (double)b[c] + (double)b[3 + c];
                    CHECK_NEAR((double)e[3 + c], (double)a[3 + c] / 2 + through * (all + (double)b[3 + c]) / 2, 0, 4e-7);
                    CHECK_NEAR((double)e[6 + c], (double)a[6 + c] + through * (double)b[6 + c], 0, 4e-7);
                    CHECK_NEAR((double)e[15 + c], (double)a[15 + c] + through * (double)b[15 + c], 0, 8e-7);
                }
            }
    vol_preint_free(&t);
    vol_tf_compiled_free(&tf);
}

static void test_band(void)
{
    VolTfCompiled tf = random_tf(false);
    VolPreint full = build(&tf, (VolPreintOptions){.n = 129, .step = 0.5, .octaves = 2, .threads = 1});
    double change = (full.hi - full.lo) * 9.5 / 128;
    VolPreint band = build(&tf, (VolPreintOptions){.n = 129, .step = 0.5, .octaves = 2, .threads = 1, .change = change});
    CHECK(full.octaves[0].band == 128 && band.octaves[0].band == 11 && band.octaves[1].band == 20);
    for (size_t i = 0; i < 129; i++)
        for (size_t j = 0; j < 129; j++)
            if (vol_preint_in_band(&band.octaves[0], i, j))
                CHECK(memcmp(vol_preint_entry(&band, &band.octaves[0], i, j),
                             vol_preint_entry(&full, &full.octaves[0], i, j), full.floats * sizeof(float)) == 0);
    for (int k = 0; k < 300; k++) { /* within the band the same; elsewhere the segment itself, never a clamp */
        double v0 = full.lo + (full.hi - full.lo) * (chance() * 1.2 - 0.1), v1 = v0 + change * (4 * chance() - 2);
        VolPreintSegment a, b;
        vol_preint_full_at(&band, v0, v1, 0.5, &a);
        bool inside = fabs(v1 - v0) <= change && fmin(v0, v1) >= full.lo && fmax(v0, v1) <= full.hi;
        if (inside)
            vol_preint_full_at(&full, v0, v1, 0.5, &b);
        else
            vol_preint_segment(&tf, v0, v1, 0.5, &b);
        if (inside || fabs(v1 - v0) > change * 11 / 9.5)
            CHECK(memcmp(&a, &b, sizeof a) == 0);
    }
    vol_preint_free(&full);
    vol_preint_free(&band);
    vol_tf_compiled_free(&tf);
}

static void test_threads_do_not_matter(void)
{
    VolTfCompiled tf = random_tf(true);
    VolPreint one = build(&tf, (VolPreintOptions){.n = 150, .step = 0.5, .octaves = 2, .threads = 1});
    VolPreint many = build(&tf, (VolPreintOptions){.n = 150, .step = 0.5, .octaves = 2, .threads = 7});
    size_t size = 150 * 151 / 2 * one.floats * sizeof(float);
    for (int o = 0; o < 2; o++) {
        CHECK(memcmp(one.octaves[o].rising, many.octaves[o].rising, size) == 0);
        CHECK(memcmp(one.octaves[o].falling, many.octaves[o].falling, size) == 0);
    }
    vol_preint_free(&one);
    vol_preint_free(&many);
    vol_tf_compiled_free(&tf);
}

/* fw + bw + particles = 1 - exp(-depth): in float to the rounding of its three parts, looked up to that of doubles. */
static void test_opacities_add_up(void)
{
    for (int k = 0; k < 6; k++) {
        VolTfCompiled tf = random_tf(k & 1);
        VolPreint t = build(&tf, (VolPreintOptions){.n = 65, .step = k < 3 ? 0.01 : 2, .octaves = 3, .threads = 1});
        size_t n = (size_t)t.channels;
        for (size_t i = 0; i < t.n; i++)
            for (size_t j = 0; j < t.n; j++) {
                VolPreintSegment s;
                const float *e = vol_preint_entry(&t, &t.octaves[0], i, j);
                vol_preint_segment(&tf, vol_preint_node(&t, i), vol_preint_node(&t, j), t.octaves[0].step, &s);
                for (size_t c = 0; c < n; c++)
                    CHECK_NEAR((double)e[c] + (double)e[n + c] + (double)e[2 * n + c], s.alpha[c], FLT_EPSILON, 0);
            }
        for (int m = 0; m < 500; m++) {
            VolPreintSegment s, exact;
            double v0 = t.lo + chance() * (t.hi - t.lo), v1 = t.lo + chance() * (t.hi - t.lo), dl = 5 * chance();
            vol_preint_full_at(&t, v0, v1, dl, &s);
            vol_preint_segment(&tf, v0, v1, dl, &exact);
            bool by_definition = memcmp(&s, &exact, sizeof s) == 0; /* in dense bins, and beyond the band */
            for (int c = 0; c < 3; c++) {
                CHECK_NEAR(s.alpha[c], exact.alpha[c], 0, 1e-14);
                if (!by_definition)
                    CHECK_NEAR(s.fw_a[c] + s.bw_a[c] + s.p_a[c], s.alpha[c], 6e-16, 0);
                CHECK_NEAR(exact.fw_a[c] + exact.bw_a[c] + exact.p_a[c], exact.alpha[c], 4e-15, 0);
            }
        }
        vol_preint_free(&t);
        vol_tf_compiled_free(&tf);
    }
}

static double lookup_error(const VolPreint *t, double dl, int trials)
{
    double most = 0;
    for (int k = 0; k < trials; k++) {
        VolPreintSegment got, want;
        double v0 = t->lo + chance() * (t->hi - t->lo), v1 = v0 + 0.2 * (chance() - 0.5);
        vol_preint_full_at(t, v0, v1, dl, &got);
        vol_preint_segment(t->integrals.tf, v0, v1, dl, &want);
        for (int c = 0; c < 3; c++) {
            most = fmax(most, fabs(got.fw_c[c] - want.fw_c[c]));
            most = fmax(most, fabs(got.bw_c[c] - want.bw_c[c]));
            most = fmax(most, fabs(got.p_c[c] - want.p_c[c]));
            most = fmax(most, fabs(got.fw_a[c] - want.fw_a[c]));
        }
    }
    return most;
}

static const char smooth[] =
    "{\"pellucid\": \"transfer-function/1\", \"interpolate\": \"extinction\", \"scalar_step\": 0.2, "
    "\"surface\": [[0, 0.1, [1, 0, 0]], [0.5, 0.5, [0, 1, 0]], [1, 0.2, [0, 0, 1]]], "
    "\"scatter\": [[0, 0.5, [0, 0, 1]], [0.5, 0.2, [1, 1, 0]], [1, 0.6, [1, 0, 1]]], \"emit\": [[0, 0.1], [1, 0.4]]}";

static void test_between_nodes(void)
{
    VolTfCompiled tf = compile(smooth);
    double error[3];
    for (int k = 0; k < 3; k++) { /* knots on nodes: order 2 */
        VolPreint t = build(&tf, (VolPreintOptions){.n = ((size_t)32 << k) + 1, .step = 0.5, .octaves = 1, .threads = 1});
        seed = 77;
        error[k] = lookup_error(&t, 0.5, 4000);
        vol_preint_free(&t);
    }
    double order = log2(error[0] / error[2]) / 2;
    if (!(order > 1.8 && order < 2.4 && error[2] < 1e-3))
        FAIL("order %.2f, errors %.3g %.3g %.3g", order, error[0], error[1], error[2]);
    vol_tf_compiled_free(&tf);
}

static void test_other_steps(void)
{
    VolTfCompiled tf = compile(smooth);
    VolPreint t = build(&tf, (VolPreintOptions){.n = 257, .step = 0.5, .octaves = 4, .threads = 1});
    /* The tables' own steps (0.5, 1, 2, 4), between them, and below and above all: there mean colours are those of
     * the end. */
    static const double bound[][2] = {{0.5, 1e-3}, {1, 1e-3}, {4, 2e-3}, {0.75, 1e-3}, {1.5, 1e-3}, {3, 2e-3},
                                      {0.4, 3e-3}, {0.01, 1e-2}, {5, 2e-2}};
    for (int k = 0; k < 9; k++)
        CHECK_NEAR(lookup_error(&t, bound[k][0], 1000), 0, 0, bound[k][1]);
    VolPreintSegment s;
    vol_preint_full_at(&t, 0.3, 0.4, 0, &s); /* no length, still a change of the value */
    CHECK(s.p_a[0] == 0 && s.p_c[0] == 0 && s.fw_a[0] > 0);
    vol_preint_free(&t);
    vol_tf_compiled_free(&tf);
}

static void test_unchanged_value_shows_no_surface(void)
{
    VolTfCompiled tf = random_tf(false);
    VolPreint t = build(&tf, (VolPreintOptions){.n = 64, .step = 0.5, .octaves = 1, .threads = 1});
    for (int k = 0; k < 200; k++) {
        VolPreintSegment s;
        VolTfSample at;
        double v = t.lo + chance() * (t.hi - t.lo);
        vol_preint_full_at(&t, v, v, 0.5, &s);
        vol_tf_sample(&tf, v, &at);
        CHECK(s.fw_a[0] == 0 && s.bw_c[1] == 0);
        CHECK_NEAR(s.p_a[0], -expm1(-at.particle[0] * 0.5), 1e-14, 0);
    }
    vol_preint_free(&t);
    vol_tf_compiled_free(&tf);
}

/* ---- Integrals ---- */

static void test_integrals(void)
{
    VolError err;
    for (int k = 0; k < 4; k++) {
        VolTfCompiled tf = random_tf(true);
        VolTfIntegrals integrals;
        CHECK(vol_tf_integrals_new(&tf, &integrals, &err) == VOL_OK);
        double lo = -0.5 + chance(), hi = lo + 0.7, surface = 0, value = 0, particle = 0, source = 0, color = 0;
        enum { N = 200000 };
        for (int i = 0; i < N; i++) {
            double v = lo + (hi - lo) * (i + 0.5) / N;
            VolTfSample s;
            vol_tf_sample(&tf, v, &s);
            surface += s.surface * (hi - lo) / N;
            value += s.surface * v * (hi - lo) / N;
            particle += s.particle[1] * (hi - lo) / N;
            source += s.source[2] * (hi - lo) / N;
            color += s.surface * s.surface_color[0] * (hi - lo) / N;
        }
        VolTfIntegral got;
        vol_tf_integrals_between(&integrals, lo, hi, &got);
        CHECK_NEAR(got.surface, surface, 0, 1e-4);
        CHECK_NEAR(got.value, value, 0, 1e-4);
        CHECK_NEAR(got.particle[1], particle, 0, 1e-4);
        CHECK_NEAR(got.source[2], source, 0, 1e-4);
        CHECK_NEAR(got.surface_color[0], color, 0, 1e-4);
        vol_tf_integrals_free(&integrals);
        vol_tf_compiled_free(&tf);
    }
}

/* Y 17: exact opacity, colours right to first order; v0 = v1 and depth 0 are limits, not exceptions. */
static void test_approximation(void)
{
    VolError err;
    VolTfCompiled tf = compile(smooth);
    VolTfIntegrals integrals;
    CHECK(vol_tf_integrals_new(&tf, &integrals, &err) == VOL_OK);
    double error[2] = {0};
    for (int k = 0; k < 2; k++)
        for (int i = 0; i < 100; i++) {
            double h = k ? 0.01 : 0.02, v0 = 0.1 + 0.3 * i / 100, v1 = v0 + h;
            VolPreintApproximation a;
            VolPreintSegment s;
            vol_preint_integrals_at(&integrals, v0, v1, h, &a);
            vol_preint_segment(&tf, v0, v1, h, &s);
            CHECK_NEAR(a.alpha[0], s.alpha[0], 1e-14, 0);
            CHECK_NEAR(a.surface_a[0] + a.particle_a[0], a.alpha[0], 1e-15, 0);
            CHECK(a.v_c > v0 && a.v_c < v1);
            error[k] = fmax(error[k], fabs(a.surface_c[2] + a.particle_c[2] - s.fw_c[2] - s.bw_c[2] - s.p_c[2]));
        }
    CHECK_NEAR(log2(error[0] / error[1]), 3, 0, 0.1);

    VolPreintApproximation at, near, nothing;
    VolPreintSegment s;
    vol_preint_integrals_at(&integrals, 0.3, 0.3, 2, &at);
    vol_preint_integrals_at(&integrals, 0.3, nextafter(0.3, 1), 2, &near);
    vol_preint_segment(&tf, 0.3, 0.3, 2, &s);
    CHECK(at.surface_a[0] == 0 && at.v_c == 0.3);
    CHECK_NEAR(at.particle_c[1], s.p_c[1], 1e-14, 0);
    CHECK_NEAR(near.particle_c[1], at.particle_c[1], 1e-12, 0);
    vol_tf_integrals_free(&integrals);
    vol_tf_compiled_free(&tf);

    VolTfCompiled empty = compile("{\"pellucid\": \"transfer-function/1\"}");
    CHECK(vol_tf_integrals_new(&empty, &integrals, &err) == VOL_OK);
    vol_preint_integrals_at(&integrals, 1, 2, 1, &nothing);
    CHECK(nothing.alpha[0] == 0 && nothing.surface_c[0] == 0 && nothing.v_c == 1.5);
    vol_tf_integrals_free(&integrals);
    vol_tf_compiled_free(&empty);
}

/* ---- Faults ---- */

static void refuse(const char *text, VolPreintOptions options, const char *why)
{
    VolTfCompiled tf = compile(text);
    VolPreint t;
    VolError err = {{0}};
    if (options.lo == options.hi)
        vol_preint_default_range(&tf, &options.lo, &options.hi);
    CHECK(vol_preint_build(&tf, &options, &t, &err) == VOL_BAD_INPUT);
    if (!strstr(err.text, why))
        FAIL("'%s' does not say '%s'", err.text, why);
    vol_tf_compiled_free(&tf);
}

static void test_faults(void)
{
    VolPreintOptions good = {.n = 16, .step = 1, .octaves = 1, .change = INFINITY, .threads = 1}, o = good;
    o.lo = 2, o.hi = 1;
    refuse(smooth, o, "range is empty");
    o = good, o.n = 1;
    refuse(smooth, o, "1 nodes");
    o = good, o.n = VOL_PREINT_MOST_NODES + 1;
    refuse(smooth, o, "4097 nodes");
    o = good, o.step = 0;
    refuse(smooth, o, "step is 0");
    o = good, o.lo = 1, o.hi = nextafter(1, 2);
    refuse(smooth, o, "do not fit");
    refuse("{\"pellucid\": \"transfer-function/1\", \"particle_step\": 1e-30, \"emit\": [[0, 1e18], [1, 1]]}", good,
           "too large");
    refuse("{\"pellucid\": \"transfer-function/1\", \"scatter\": [[-1e300, 0.5], [1e300, 1]]}", good, "too large");
    refuse("{\"pellucid\": \"transfer-function/1\", \"particle_step\": 1e-40, \"scatter\": [[0, 0.5], [1, 1]]}", good,
           "too large");
}

static void test_default_range(void)
{
    static const struct {
        const char *list;
        double lo, hi;
    } cases[] = {{"", 0, 1}, {", \"scatter\": [[3, 0.5]]", 1.5, 4.5}, {", \"scatter\": [[0, 0.5]]", -0.5, 0.5},
                 {", \"scatter\": [[-2, 0.5], [7, 0]], \"isosurfaces\": [{\"value\": 9, \"opacity\": 1}]", -2, 9}};
    for (int k = 0; k < 4; k++) {
        char text[300];
        snprintf(text, sizeof text, "{\"pellucid\": \"transfer-function/1\"%s}", cases[k].list);
        VolTfCompiled tf = compile(text);
        double lo, hi;
        vol_preint_default_range(&tf, &lo, &hi);
        CHECK(lo == cases[k].lo && hi == cases[k].hi);
        vol_tf_compiled_free(&tf);
    }
}

int main(void)
{
    RUN(test_published_segments);
    RUN(test_linear_extinction);
    RUN(test_against_quadrature);
    RUN(test_order);
    RUN(test_deep_bins_stay_finite);
    RUN(test_windows_are_compositions);
    RUN(test_octaves_double);
    RUN(test_band);
    RUN(test_threads_do_not_matter);
    RUN(test_opacities_add_up);
    RUN(test_between_nodes);
    RUN(test_other_steps);
    RUN(test_unchanged_value_shows_no_surface);
    RUN(test_integrals);
    RUN(test_approximation);
    RUN(test_faults);
    RUN(test_default_range);
    return test_end();
}
