/* Diffusion against cosine series in double, dense elimination, and what must hold of any solution.
 *
 *     test_diffusion            the tests
 *     test_diffusion --bench    milliseconds of 128^3: RGB at every cpu level; one channel among occluders */
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "base/fmath.h"
#include "light/cosine_transform.h"
#include "light/diffusion.h"
#include "tests/unit/random_fields.h"
#include "tests/unit/test.h"

static const double pi = 3.14159265358979323846;

static VolCpu levels[3] = {VOL_CPU_SCALAR};
static int level_count = 1;

static size_t count_of(const int32_t n[3]) { return (size_t)n[0] * (size_t)n[1] * (size_t)n[2]; }

/* ---- The cosine series in double ---- */

static void series_lines(double *f, size_t step, int n, bool inverse)
{
    double *in = malloc((size_t)n * sizeof *in), *cosine = malloc(4 * (size_t)n * sizeof *cosine);
    for (int j = 0; j < 4 * n; j++)
        cosine[j] = vol_cos(pi * j / (2.0 * n));
    for (int j = 0; j < n; j++)
        in[j] = f[(size_t)j * step];
    for (int k = 0; k < n; k++) {
        double sum = 0;
        for (int j = 0; j < n; j++)
            sum += inverse ? (j ? 2 : 1) * in[j] * cosine[(2 * k + 1) * j % (4 * n)]
                           : in[j] * cosine[(2 * j + 1) * k % (4 * n)] / n;
        f[(size_t)k * step] = sum;
    }
    free(in);
    free(cosine);
}

static void series_box(double *f, const int32_t n[3], bool inverse)
{
    const size_t step[3] = {(size_t)n[1] * (size_t)n[2], (size_t)n[2], 1};
    for (int a = 0; a < 3; a++) {
        int b = (a + 1) % 3, c = (a + 2) % 3;
        for (int i = 0; i < n[b]; i++)
            for (int j = 0; j < n[c]; j++)
                series_lines(f + (size_t)i * step[b] + (size_t)j * step[c], step[a], n[a], inverse);
    }
}

static double eigen(double s, int k, int n)
{
    double sine = vol_sin(pi * k / (2.0 * n));
    return 4 * s * sine * sine;
}

static void diffused_by_series(const float *field, const int32_t n[3], const double s[3], double *out)
{
    for (size_t v = 0; v < count_of(n); v++)
        out[v] = (double)field[v];
    series_box(out, n, false);
    size_t v = 0;
    for (int i = 0; i < n[0]; i++)
        for (int j = 0; j < n[1]; j++)
            for (int k = 0; k < n[2]; k++)
                out[v++] /= 1 + eigen(s[0], i, n[0]) + eigen(s[1], j, n[1]) + eigen(s[2], k, n[2]);
    series_box(out, n, true);
}

/* ---- Fields ---- */

typedef enum Kind { NOISE, EDGE, POINT, KINDS } Kind;

static float *new_field(const int32_t n[3], Kind kind, uint64_t seed)
{
    Random r = {seed};
    float *field = malloc(count_of(n) * sizeof *field);
    size_t v = 0, spot = count_of(n) / 3;
    for (int i = 0; i < n[0]; i++)
        for (int j = 0; j < n[1]; j++)
            for (int k = 0; k < n[2]; k++, v++)
                field[v] = kind == NOISE  ? (float)random_in(&r, -1, 1)
                           : kind == EDGE ? (2 * i > n[0] || 3 * j > n[1] + k ? 1 : 0)
                                          : (v == spot ? 1 : 0);
    return field;
}

static float *diffused(const float *field, const int32_t n[3], const double s[3], const uint8_t *medium, bool preview,
                       int threads, VolCpu cpu)
{
    float *out = malloc(count_of(n) * sizeof *out);
    memcpy(out, field, count_of(n) * sizeof *out);
    VolDiffusion d = {.n = {n[0], n[1], n[2]}, .channels = 1, .field = {out}, .s = {{s[0], s[1], s[2]}},
                      .medium = medium, .threads = threads, .cpu = cpu};
    VolError err;
    double residual = 0;
    VolStatus status = preview ? vol_diffuse_preview(&d, &err) : vol_diffuse(&d, &residual, &err);
    if (status != VOL_OK)
        FAIL("%s", err.text);
    if (residual > (fmax(s[0], fmax(s[1], s[2])) > 100 ? 2e-5 : 2e-6))
        FAIL("residual %g", residual);
    return out;
}

/* ---- Boxes ---- */

static const int32_t sizes[][3] = {{1, 1, 1},    {1, 7, 1},   {1, 1, 5},   {6, 1, 1},    {2, 2, 2},   {5, 1, 3},
                                   {16, 16, 16}, {17, 31, 8}, {9, 15, 35}, {4, 33, 21},  {3, 64, 77}, {13, 37, 34},
                                   {2, 53, 6},   {2, 3, 127}, {40, 4, 30}, {7, 128, 12}, {3, 121, 50}};
static const double rates[][3] = {{0, 0, 0},     {0.1, 0.1, 0.1}, {1, 1, 1},    {10, 2.5, 40},
                                  {100, 100, 100}, {3e3, 1e4, 1},   {1e6, 1e6, 1e6}, {1e6, 7e5, 0.3}};
enum { SIZES = sizeof sizes / sizeof *sizes, RATES = sizeof rates / sizeof *rates };

static double largest_of(const float *field, size_t count)
{
    double largest = 0;
    for (size_t v = 0; v < count; v++)
        largest = fmax(largest, fabs((double)field[v]));
    return largest;
}

static double bound_of(const double s[3]) { return fmax(s[0], fmax(s[1], s[2])) > 100 ? 1e-4 : 1e-5; }

static void check_series(const int32_t n[3], const double s[3], Kind kind)
{
    size_t count = count_of(n);
    float *field = new_field(n, kind, 7), *got = diffused(field, n, s, NULL, false, 1, levels[level_count - 1]);
    double *want = malloc(count * sizeof *want), worst = 0;
    diffused_by_series(field, n, s, want);
    for (size_t v = 0; v < count; v++)
        worst = fmax(worst, fabs((double)got[v] - want[v]));
    if (!(worst <= bound_of(s) * largest_of(field, count)))
        FAIL("%dx%dx%d, s %g %g %g, kind %d: off by %.3g", n[0], n[1], n[2], s[0], s[1], s[2], kind, worst);
    free(field);
    free(got);
    free(want);
}

static void test_series(void)
{
    for (int i = 0; i < SIZES; i++)
        for (int j = 0; j < RATES; j++)
            for (Kind kind = 0; kind < KINDS; kind++)
                check_series(sizes[i], rates[j], kind);
}

/* Sizes as they are in use; odd, unequal. */
static void test_series_large(void)
{
    const int32_t n[][3] = {{65, 97, 33}, {64, 64, 64}, {20, 131, 75}};
    const double s[][3] = {{100, 50, 12.5}, {1e6, 1e6, 1e6}, {1e5, 2e5, 5e4}};
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            check_series(n[i], s[j], EDGE);
}

/* One cosine mode is scaled by its factor. */
static void test_symbol(void)
{
    const int32_t n[3] = {18, 25, 33};
    const int modes[][3] = {{0, 0, 0}, {1, 0, 0}, {0, 3, 0}, {0, 0, 32}, {5, 7, 2}, {17, 24, 32}};
    const double s[3] = {10, 40, 2.5};
    float *field = malloc(count_of(n) * sizeof *field);
    for (int m = 0; m < 6; m++) {
        const int *k = modes[m];
        size_t v = 0;
        for (int x = 0; x < n[0]; x++)
            for (int y = 0; y < n[1]; y++)
                for (int z = 0; z < n[2]; z++)
                    field[v++] = (float)(vol_cos(pi * k[0] * (x + 0.5) / n[0]) * vol_cos(pi * k[1] * (y + 0.5) / n[1]) *
                                         vol_cos(pi * k[2] * (z + 0.5) / n[2]));
        double factor = 1 / (1 + eigen(s[0], k[0], n[0]) + eigen(s[1], k[1], n[1]) + eigen(s[2], k[2], n[2]));
        float *got = diffused(field, n, s, NULL, false, 1, levels[level_count - 1]);
        for (v = 0; v < count_of(n); v++)
            CHECK_NEAR((double)got[v], factor * (double)field[v], 0, 1e-5);
        free(got);
    }
    free(field);
}

static double sum_of(const float *field, size_t count)
{
    double sum = 0;
    for (size_t v = 0; v < count; v++)
        sum += (double)field[v];
    return sum;
}

/* Light is neither lost nor made, and no value leaves the range of what was there. */
static void check_principles(const int32_t n[3], const double s[3], Kind kind, const uint8_t *medium, bool preview)
{
    size_t count = count_of(n);
    float *field = new_field(n, kind, 3), *got = diffused(field, n, s, medium, preview, 2, levels[level_count - 1]);
    double least = INFINITY, most = -INFINITY, slack = bound_of(s) * largest_of(field, count);
    for (size_t v = 0; v < count; v++) {
        least = fmin(least, (double)field[v]);
        most = fmax(most, (double)field[v]);
    }
    for (size_t v = 0; v < count; v++)
        if (!((double)got[v] >= least - slack && (double)got[v] <= most + slack))
            FAIL("%g is outside %g..%g", (double)got[v], least, most);
    double before = sum_of(field, count) / (double)count, after = sum_of(got, count) / (double)count;
    if (!(fabs(after - before) <= slack))
        FAIL("%dx%dx%d, s %g, kind %d: mean %.9g became %.9g", n[0], n[1], n[2], s[0], kind, before, after);
    free(field);
    free(got);
}

static void test_principles(void)
{
    for (int i = 0; i < SIZES; i++)
        for (int j = 0; j < RATES; j++)
            for (Kind kind = 0; kind < KINDS; kind++)
                for (int preview = 0; preview < 2; preview++)
                    check_principles(sizes[i], rates[j], kind, NULL, preview);
}

/* Rates that are products with the largest double, too: no infinity, no NaN. */
static void test_extreme_rates(void)
{
    const int32_t n[3] = {5, 6, 7};
    const double s[][3] = {{1e30, 1e30, 1e30}, {1e300, 0, 1e300}, {0, 1e-30, 1e12}};
    for (int j = 0; j < 3; j++)
        for (int preview = 0; preview < 2; preview++)
            check_principles(n, s[j], EDGE, NULL, preview);
}

/* ---- Same bytes ---- */

static void check_bytes(const int32_t n[3], const uint8_t *medium, bool preview)
{
    const double s[3] = {30, 7, 12};
    size_t bytes = count_of(n) * sizeof(float);
    float *field = new_field(n, NOISE, 11), *first = diffused(field, n, s, medium, preview, 1, VOL_CPU_SCALAR);
    for (int l = 0; l < level_count; l++)
        for (int threads = 1; threads <= 3; threads++) {
            float *other = diffused(field, n, s, medium, preview, threads, levels[l]);
            if (memcmp(first, other, bytes) != 0)
                FAIL("%dx%dx%d, %s on %d threads, preview %d, masked %d: other bytes", n[0], n[1], n[2],
                     vol_cpu_name(levels[l]), threads, preview, medium != NULL);
            free(other);
        }
    free(field);
    free(first);
}

static uint8_t *random_medium(const int32_t n[3], uint64_t seed)
{
    Random r = {seed};
    uint8_t *medium = malloc(count_of(n));
    for (size_t v = 0; v < count_of(n); v++) {
        int kind = random_below(&r, 8);
        medium[v] = kind == 0 ? VOL_MEDIUM_BLANK : kind == 1 ? VOL_MEDIUM_OCCLUDER : VOL_MEDIUM_INSIDE;
    }
    return medium;
}

static void test_bytes(void)
{
    for (int i = 0; i < SIZES; i++) {
        uint8_t *medium = random_medium(sizes[i], (uint64_t)i);
        for (int preview = 0; preview < 2; preview++) {
            check_bytes(sizes[i], NULL, preview);
            check_bytes(sizes[i], medium, preview);
        }
        free(medium);
    }
}

/* Channels do not know of each other. */
static void test_channels(void)
{
    const int32_t n[3] = {9, 14, 22};
    const double s[3][3] = {{1, 2, 3}, {100, 50, 20}, {0, 0, 0}};
    for (int preview = 0; preview < 2; preview++) {
        VolDiffusion d = {.n = {n[0], n[1], n[2]}, .channels = 3, .threads = 2, .cpu = levels[level_count - 1]};
        float *alone[3];
        memcpy(d.s, s, sizeof s);
        for (int c = 0; c < 3; c++) {
            d.field[c] = new_field(n, NOISE, (uint64_t)c);
            alone[c] = diffused(d.field[c], n, s[c], NULL, preview, 1, d.cpu);
        }
        CHECK(preview ? !vol_diffuse_preview(&d, NULL) : !vol_diffuse(&d, NULL, NULL));
        for (int c = 0; c < 3; c++) {
            CHECK(memcmp(alone[c], d.field[c], count_of(n) * sizeof(float)) == 0);
            free(alone[c]);
            free(d.field[c]);
        }
    }
}

/* ---- Among blanks and occluders ---- */

/* Gauss elimination of count x count numbers, row after row, the right side last. */
static void eliminate(double *rows, size_t count)
{
    const size_t width = count + 1;
    for (size_t i = 0; i < count; i++)
        for (size_t j = 0; j < count; j++) {
            double factor = j == i ? 0 : rows[j * width + i] / rows[i * width + i];
            for (size_t k = i; factor != 0 && k < width; k++)
                rows[j * width + k] -= factor * rows[i * width + k];
        }
}

/* I + s_axis K_axis for axis = 0..2, all of them for axis = 3. */
static void dense_solution(const float *field, const int32_t n[3], const double s[3], const uint8_t *medium, int axis,
                           double *out)
{
    const size_t count = count_of(n), width = count + 1, step[3] = {(size_t)n[1] * (size_t)n[2], (size_t)n[2], 1};
    double *rows = calloc(count * width, sizeof *rows);
    for (size_t v = 0; v < count; v++) {
        rows[v * width + v] += 1;
        rows[v * width + count] = (double)field[v];
        for (int a = 0; a < 3; a++) {
            if ((axis < 3 && a != axis) || (v / step[a]) % (size_t)n[a] == (size_t)n[a] - 1)
                continue;
            size_t w = v + step[a];
            if (medium && (medium[v] != VOL_MEDIUM_INSIDE || medium[w] != VOL_MEDIUM_INSIDE))
                continue;
            rows[v * width + v] += s[a];
            rows[w * width + w] += s[a];
            rows[v * width + w] -= s[a];
            rows[w * width + v] -= s[a];
        }
    }
    eliminate(rows, count);
    for (size_t v = 0; v < count; v++)
        out[v] = rows[v * width + count] / rows[v * width + v];
    free(rows);
}

static void check_dense(const int32_t n[3], const double s[3], const uint8_t *medium, bool preview, Kind kind)
{
    const size_t count = count_of(n);
    float *field = new_field(n, kind, 5), *got = diffused(field, n, s, medium, preview, 2, levels[level_count - 1]);
    float *step = malloc(count * sizeof *step);
    double *want = malloc(count * sizeof *want);
    memcpy(step, field, count * sizeof *step);
    static const int order[2][3] = {{3, -1, -1}, {2, 0, 1}};
    for (int i = 0; i < 3 && order[preview][i] >= 0; i++) {
        dense_solution(step, n, s, medium, order[preview][i], want);
        for (size_t v = 0; v < count; v++)
            step[v] = (float)want[v];
    }
    for (size_t v = 0; v < count; v++)
        CHECK_NEAR((double)got[v], want[v], 0, bound_of(s) * largest_of(field, count));
    for (size_t v = 0; medium && v < count; v++)
        CHECK(medium[v] == VOL_MEDIUM_INSIDE || got[v] == field[v]);
    free(field);
    free(step);
    free(got);
    free(want);
}

static void test_dense(void)
{
    const int32_t n[][3] = {{1, 1, 1}, {1, 9, 1}, {4, 5, 6}, {7, 3, 8}, {2, 9, 5}};
    for (int i = 0; i < 5; i++)
        for (int j = 0; j < RATES; j++)
            for (int preview = 0; preview < 2; preview++) {
                uint8_t *medium = random_medium(n[i], (uint64_t)(i + 100));
                check_dense(n[i], rates[j], NULL, preview, NOISE);
                check_dense(n[i], rates[j], medium, preview, NOISE);
                check_dense(n[i], rates[j], medium, preview, POINT);
                free(medium);
            }
}

/* A wall with a hole, one without, and rubble: the bound on the error holds however stiff. */
static void test_walls(void)
{
    const int32_t n[3] = {24, 31, 28};
    for (int kind = 0; kind < 3; kind++) {
        uint8_t *medium = random_medium(n, 9);
        size_t v = 0;
        for (int x = 0; kind < 2 && x < n[0]; x++)
            for (int y = 0; y < n[1]; y++)
                for (int z = 0; z < n[2]; z++)
                    medium[v++] = y == 13 && (kind == 0 || x != 12 || z != 9) ? VOL_MEDIUM_OCCLUDER : VOL_MEDIUM_INSIDE;
        for (int j = 0; j < RATES; j++)
            check_principles(n, rates[j], EDGE, medium, false);
        free(medium);
    }
}

static void test_refused(void)
{
    float value = 0;
    VolError err;
    VolDiffusion d = {.n = {1, VOL_DIFFUSION_LONGEST + 1, 1}, .channels = 1, .field = {&value}};
    CHECK(vol_diffuse(&d, NULL, &err) == VOL_BAD_INPUT);
    CHECK_TEXT(err.text, "diffusion on a box of 1 x 65537 x 1 voxels: at most 65536 along an axis");
    CHECK(vol_diffuse_preview(&d, NULL) == VOL_BAD_INPUT);
}

static void test_none_inside(void)
{
    const int32_t n[3] = {3, 4, 2};
    uint8_t medium[24] = {0};
    for (int preview = 0; preview < 2; preview++)
        check_dense(n, rates[4], medium, preview, NOISE);
}

/* ---- Time ---- */

static double seconds(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void bench(const int32_t n[3], VolCpu cpu, int threads)
{
    double best[2] = {1e9, 1e9};
    VolDiffusion d = {.n = {n[0], n[1], n[2]}, .channels = 3, .threads = threads, .cpu = cpu};
    for (int c = 0; c < 3; c++) {
        d.field[c] = new_field(n, EDGE, 1);
        for (int a = 0; a < 3; a++)
            d.s[c][a] = 5;
    }
    for (int preview = 0; preview < 2; preview++)
        for (int run = 0; run < 7; run++) {
            double start = seconds();
            if (preview ? vol_diffuse_preview(&d, NULL) : vol_diffuse(&d, NULL, NULL))
                abort();
            best[preview] = fmin(best[preview], seconds() - start);
        }
    printf("%dx%dx%d %s, %d threads: %.1f ms, preview %.1f ms\n", n[0], n[1], n[2], vol_cpu_name(cpu), threads,
           1e3 * best[0], 1e3 * best[1]);
    for (int c = 0; c < 3; c++)
        free(d.field[c]);
}

/* A wall with a hole, one channel. */
static void bench_masked(double s, int threads)
{
    const int32_t n[3] = {128, 128, 128};
    uint8_t *medium = malloc(count_of(n));
    float *field = new_field(n, EDGE, 1);
    for (size_t v = 0; v < count_of(n); v++)
        medium[v] = v / 128 % 128 == 60 && v % 128 != 40 ? VOL_MEDIUM_OCCLUDER : VOL_MEDIUM_INSIDE;
    VolDiffusion d = {.n = {n[0], n[1], n[2]}, .channels = 1, .field = {field}, .s = {{s, s, s}}, .medium = medium,
                      .threads = threads, .cpu = levels[level_count - 1]};
    double start = seconds(), residual;
    if (vol_diffuse(&d, &residual, NULL))
        abort();
    printf("128^3 with a wall, s %g, one channel, %d threads: %.0f ms, residual %.1e\n", s, threads,
           1e3 * (seconds() - start), residual);
    free(medium);
    free(field);
}

int main(int argc, char **argv)
{
    static const char *const names[] = {"avx2", "avx512"};
    for (int i = 0; i < 2; i++)
        level_count += !vol_cpu_choose(names[i], &levels[level_count], NULL);
    if (argc > 1 && strcmp(argv[1], "--bench") == 0) {
        const int32_t n[][3] = {{128, 128, 128}, {130, 127, 131}};
        for (int i = 0; i < 2; i++)
            for (int l = 0; l < level_count; l++)
                for (int threads = 1; threads <= 2; threads++)
                    bench(n[i], levels[l], threads);
        for (double s = 1; s < 1e7; s *= 100)
            bench_masked(s, 2);
        return 0;
    }
    RUN(test_series);
    RUN(test_series_large);
    RUN(test_symbol);
    RUN(test_principles);
    RUN(test_extreme_rates);
    RUN(test_bytes);
    RUN(test_channels);
    RUN(test_dense);
    RUN(test_walls);
    RUN(test_none_inside);
    RUN(test_refused);
    return test_end();
}
