/* Indirect light from plane to plane: how far it spreads, what gets through, what is read.
 *
 * Variances are measured of a spot of light that starts on the first plane, without a medium. */
#include <stdlib.h>
#include <string.h>

#include "light/cone.h"
#include "tests/unit/test.h"
#include "trace/lights.h"

static VolStatus pass_all(void *user, const VolConePlanes *p, int32_t k, int32_t i, int thread, float *const passed[3],
                          VolError *err)
{
    (void)user, (void)k, (void)i, (void)thread, (void)err;
    for (int32_t j = 0; j < p->size[1]; j++)
        passed[0][j] = 1;
    return VOL_OK;
}

static VolLight light_of(const char *spec)
{
    VolLight light;
    VolError err;
    if (vol_light_parse(spec, &light, &err) != VOL_OK)
        FAIL("%s", err.text);
    return light;
}

static const VolAffine identity = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, 0}}};

/* From lattice points of plane k, the third index being of no account. */
static VolAffine lattice_of(const VolConePlanes *p, double k)
{
    VolVec3 o = vol_cone_place(p, k, 0, 0), u = vol_sub(vol_cone_place(p, k, 1, 0), o);
    VolVec3 v = vol_sub(vol_cone_place(p, k, 0, 1), o), w = vol_scale(p->along, 1e-9);
    return (VolAffine){{{w.x, w.y, w.z}, {u.x, u.y, u.z}, {v.x, v.y, v.z}, {o.x, o.y, o.z}}};
}

/* The light on plane k: rows along j. */
static float *plane_of(VolCone cone, double k)
{
    const VolConePlanes *p = cone.planes;
    size_t rows = (size_t)p->size[0];
    VolConeRow *row = malloc(rows * sizeof *row);
    float *out = malloc(rows * (size_t)p->size[1] * sizeof *out);
    for (size_t i = 0; i < rows; i++)
        row[i] = (VolConeRow){.first = {0, (int32_t)i, 0}, .count = p->size[1], .at = i * (size_t)p->size[1]};
    cone.index_to_world = lattice_of(p, k);
    cone.rows = row;
    cone.row_count = rows;
    cone.out[0] = out;
    VolError err;
    if (vol_cone_solve(&cone, &err) != VOL_OK)
        FAIL("%s", err.text);
    free(row);
    return out;
}

/* ---- Second moments ---- */

typedef struct Moments {
    double sum, mean[2], xx, yy, xy; /* in lattice spacings */
} Moments;

static Moments moments_of(const VolConePlanes *p, const float *light)
{
    Moments m = {0};
    for (int pass = 0; pass < 2; pass++)
        for (int i = 0; i < p->size[0]; i++)
            for (int j = 0; j < p->size[1]; j++) {
                double v = (double)light[i * p->size[1] + j], x = i - m.mean[0] / (pass ? m.sum : 1),
                       y = j - m.mean[1] / (pass ? m.sum : 1);
                if (pass == 0) {
                    m.sum += v;
                    m.mean[0] += v * i;
                    m.mean[1] += v * j;
                } else {
                    m.xx += v * x * x / m.sum;
                    m.yy += v * y * y / m.sum;
                    m.xy += v * x * y / m.sum;
                }
            }
    return m;
}

/* One lattice point alight. */
static float *spark_at(const VolConePlanes *p, int i, int j)
{
    float *start = calloc((size_t)p->size[0] * (size_t)p->size[1], sizeof *start);
    start[i * p->size[1] + j] = 1;
    return start;
}

static const VolConeDomain box = {{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, 0}}}, {0, 0, 0}, {24, 24, 24}};

/* Variance is rate times path, whatever the planes' distance, how wide the cone is, and on both axes. */
static void test_variance(void)
{
    const char *const suns[] = {"sun:0,0,-1", "sun:1,0,0", "sun:1,2,3", "sun:-1,1,0.2"};
    for (int l = 0; l < 4; l++)
        for (double rate = 0.01; rate < 3; rate *= 6)
            for (double voxel = 1; voxel > 0.2; voxel /= 2) {
                VolLight light = light_of(suns[l]);
                VolConePlanes p;
                if (vol_cone_planes(&light, &box, voxel, rate, &p, NULL))
                    abort();
                float *start = spark_at(&p, p.size[0] / 2, p.size[1] / 2);
                VolCone cone = {.planes = &p, .light = &light, .start = start, .rate = rate, .channels = 1, .pass = pass_all,
                                .threads = 1};
                float *end = plane_of(cone, p.count);
                Moments m = moments_of(&p, end);
                double want = rate * p.step * p.count / (voxel * voxel);
                CHECK_NEAR(m.sum, 1, 1e-3, 0);
                CHECK_NEAR(m.xx, want, 0.01, 0);
                CHECK_NEAR(m.yy, want, 0.01, 0);
                CHECK_NEAR(m.xy, 0, 0, 0.01 * want);
                free(start);
                free(end);
            }
}

/* The same as voxels of an oblique lattice see it: along four directions across the light. */
static void test_isotropy(void)
{
    const VolConeDomain wide = {identity, {0, 0, 0}, {40, 40, 40}};
    const double rate = 0.4;
    VolLight light = light_of("sun:2,3,6");
    VolConePlanes p;
    if (vol_cone_planes(&light, &wide, 1, rate, &p, NULL))
        abort();
    float *start = spark_at(&p, p.size[0] / 2, p.size[1] / 2), *out = malloc(81 * 81 * 81 * sizeof *out);
    VolConeRow *rows = malloc(81 * 81 * sizeof *rows);
    for (int i = 0; i < 81 * 81; i++)
        rows[i] = (VolConeRow){{i / 81 - 20, i % 81 - 20, -20}, 81, (size_t)i * 81};
    VolCone cone = {.planes = &p, .light = &light, .start = start, .rate = rate, .channels = 1, .pass = pass_all,
                    .index_to_world = identity, .rows = rows, .row_count = 81 * 81, .out = {out}, .threads = 2};
    if (vol_cone_solve(&cone, NULL))
        abort();
    VolVec3 u = vol_scale(p.across[0], 1), v = p.across[1], centre = vol_cone_place(&p, 0, p.size[0] / 2, p.size[1] / 2);
    double sum = 0, second[4] = {0}, path = 0;
    for (int x = 0; x < 81; x++)
        for (int y = 0; y < 81; y++)
            for (int z = 0; z < 81; z++) {
                VolVec3 d = vol_sub(vol_vec3(x - 20, y - 20, z - 20), centre);
                double along = vol_dot(d, p.along), weight = (double)out[(x * 81 + y) * 81 + z];
                if (along < 20 || along > 40)
                    continue;
                for (int a = 0; a < 4; a++) {
                    double angle = a * 0.7853981633974483, side = cos(angle) * vol_dot(d, u) + sin(angle) * vol_dot(d, v);
                    second[a] += weight * side * side;
                }
                sum += weight;
                path += weight * along;
            }
    for (int a = 0; a < 4; a++) {
        CHECK_NEAR(second[a] / second[0], 1, 0.02, 0);
        CHECK_NEAR(second[a] / sum, rate * path / sum, 0.05, 0); /* beside what linear interpolation adds */
    }
    free(rows);
    free(start);
    free(out);
}

/* Light that spreads: s_0 to s_1 along a ray the variance across it becomes rate s_1^2 (1 / s_0 - 1 / s_1), at any angle to
 * the axis. */
static void test_spreading(void)
{
    const VolConeDomain far = {identity, {0, 0, 30}, {60, 60, 70}};
    const double rate = 0.05;
    VolLight light = light_of("point:30,30,-15");
    for (double voxel = 1; voxel > 0.3; voxel /= 2)
        for (int place = 0; place < 3; place++) {
            VolConePlanes p;
            if (vol_cone_planes(&light, &far, voxel, rate, &p, NULL))
                abort();
            int at[2] = {p.size[0] / 2, p.size[1] / 2};
            at[0] += place > 0 ? p.size[0] / 4 : 0;
            at[1] += place > 1 ? p.size[1] / 4 : 0;
            float *start = spark_at(&p, at[0], at[1]);
            VolCone cone = {.planes = &p, .light = &light, .start = start, .rate = rate, .channels = 1, .pass = pass_all,
                            .threads = 1};
            float *end = plane_of(cone, p.count);
            Moments m = moments_of(&p, end);
            double w0 = p.first, w1 = p.first + p.step * p.count, spacing = vol_length(p.across[0]);
            double a = (p.low[0] + at[0]) * spacing, b = (p.low[1] + at[1]) * spacing, secant = sqrt(1 + a * a + b * b);
            /* Across the ray, s = w secant; on the plane the variance away from the axis is secant^2 times that. */
            double across = rate * (1 / w0 - 1 / w1) / secant * secant * secant / (spacing * spacing);
            double off = a * a + b * b, radial = off > 0 ? (m.xx * a * a + m.yy * b * b + 2 * m.xy * a * b) / off : m.xx;
            double aside = off > 0 ? (m.xx * b * b + m.yy * a * a - 2 * m.xy * a * b) / off : m.yy;
            CHECK_NEAR(radial, across * secant * secant, 0.03, 0);
            CHECK_NEAR(aside, across, 0.03, 0);
            free(start);
            free(end);
        }
}

/* ---- What gets through ---- */

static VolStatus pass_slab(void *user, const VolConePlanes *p, int32_t k, int32_t i, int thread, float *const passed[3],
                           VolError *err)
{
    (void)i, (void)thread, (void)err;
    const double *extinction = user;
    for (int32_t j = 0; j < p->size[1]; j++) {
        double path = vol_length(vol_sub(vol_cone_place(p, k + 1, i, j), vol_cone_place(p, k, i, j)));
        for (int c = 0; c < 3; c++)
            passed[c][j] = (float)exp(-extinction[c] * path);
    }
    return VOL_OK;
}

static void lit_voxels(VolCone cone, int32_t n, float *out[3], int threads)
{
    VolConeRow *rows = malloc((size_t)(n * n) * sizeof *rows);
    for (int i = 0; i < n * n; i++)
        rows[i] = (VolConeRow){{i / n, i % n, 0}, n, (size_t)(i * n)};
    cone.index_to_world = identity;
    cone.rows = rows;
    cone.row_count = (size_t)(n * n);
    cone.threads = threads;
    for (int c = 0; c < cone.channels; c++) {
        cone.out[c] = out[c];
        for (int v = 0; v < n * n * n; v++)
            out[c][v] = -1;
    }
    VolError err;
    if (vol_cone_solve(&cone, &err) != VOL_OK)
        FAIL("%s", err.text);
    free(rows);
}

/* Attenuated along rays: exactly at planes, here those of voxels; a medium that is everywhere is blurred into itself. */
static void test_slab(void)
{
    enum { N = 25 };
    double extinction[3] = {0.02, 0.1, 0.3};
    const char *const lights[] = {"sun:0,0,-1", "sun:0,1,0", "point:12,12,80"};
    float *out[3];
    for (int c = 0; c < 3; c++)
        out[c] = malloc(N * N * N * sizeof *out[c]);
    for (int l = 0; l < 3; l++) {
        VolLight light = light_of(lights[l]);
        VolConePlanes p;
        if (vol_cone_planes(&light, &box, 1, 0.03, &p, NULL))
            abort();
        VolCone cone = {.planes = &p, .light = &light, .rate = 0.03, .channels = 3, .pass = pass_slab, .user = extinction};
        lit_voxels(cone, N, out, 2);
        for (int v = 0; v < N * N * N; v++) {
            int x = v / N / N, y = v / N % N, z = v % N;
            VolVec3 way = vol_sub(vol_vec3(x, y, z), light.position);
            double path = l == 0 ? 24 - z : l == 1 ? y : vol_length(way) * (24 - z) / (80 - z);
            for (int c = 0; c < 3; c++)
                CHECK_NEAR((double)out[c][v], exp(-extinction[c] * path), l < 2 ? 1e-5 : 0.02, 0);
        }
    }
    for (int c = 0; c < 3; c++)
        free(out[c]);
}

/* Every voxel of a lattice is read once, whatever the light and on any number of threads, to the same bits; without a medium
 * it reads 1. */
static void test_reading(void)
{
    enum { N = 25 };
    const char *const lights[] = {"sun:0,0,-1", "sun:3,-2,1", "sun:-1,-1,-1", "point:12,12,80", "point:60,50,40",
                                  "spot:12,12,60,0,0,-1,80"};
    float *out[2] = {malloc(N * N * N * sizeof(float)), malloc(N * N * N * sizeof(float))};
    for (int l = 0; l < 6; l++)
        for (int printed = 0; printed < 2; printed++) {
            VolLight light = light_of(lights[l]);
            VolConePlanes p;
            if (printed ? vol_cone_slices(&light, &box, &p, NULL) : vol_cone_planes(&light, &box, 1, 0.1, &p, NULL))
                abort();
            VolCone cone = {.planes = &p, .light = &light, .rate = 0.1, .taps = printed ? 0.3 : 0, .channels = 1,
                            .pass = pass_all};
            for (int threads = 1; threads <= 2; threads++)
                lit_voxels(cone, N, (float *[3]){out[threads - 1], NULL, NULL}, threads);
            CHECK(memcmp(out[0], out[1], N * N * N * sizeof(float)) == 0);
            for (int v = 0; v < N * N * N; v++)
                if (l == 5 ? !(out[0][v] >= 0 && out[0][v] <= 1) : !(fabs((double)out[0][v] - 1) < 1e-5))
                    FAIL("%s, printed %d: %g at voxel %d", lights[l], printed, (double)out[0][v], v);
        }
    free(out[0]);
    free(out[1]);
}

/* A spot's profile starts the light: unblurred it arrives as it left, but for what lattice points 1 voxel apart can tell. */
static void test_spot(void)
{
    enum { N = 25 };
    VolLight light = light_of("spot:12,12,60,0,0,-1,20");
    VolConePlanes p;
    float *out = malloc(N * N * N * sizeof *out), *plane[3] = {out, NULL, NULL};
    if (vol_cone_planes(&light, &box, 1, 0, &p, NULL))
        abort();
    lit_voxels((VolCone){.planes = &p, .light = &light, .channels = 1, .pass = pass_all}, N, plane, 1);
    int full = 0, dark = 0;
    for (int v = 0; v < N * N * N; v++) {
        double x = v / N / N - 12, y = v / N % N - 12, z = 60 - v % N, off = sqrt(x * x + y * y);
        double inner = z * sqrt(1 - light.cos_full * light.cos_full) / light.cos_full;
        double outer = z * sqrt(1 - light.cos_edge * light.cos_edge) / light.cos_edge;
        if (off < inner - 2) {
            CHECK(out[v] == 1);
            full++;
        } else if (off > outer + 2) {
            CHECK(out[v] == 0);
            dark++;
        }
    }
    CHECK(full > 1000 && dark > 1000);
    free(out);
}

/* As printed, K 9: after N slices N o^2 / 2 along each axis, less as slices come closer. */
static void test_as_printed(void)
{
    VolLight light = light_of("sun:0,0,-1");
    VolConePlanes p;
    if (vol_cone_slices(&light, &box, &p, NULL))
        abort();
    CHECK(p.count == 24);
    float *start = spark_at(&p, p.size[0] / 2, p.size[1] / 2);
    for (double o = 1; o < 3; o++) {
        VolCone cone = {.planes = &p, .light = &light, .start = start, .taps = o, .channels = 1, .pass = pass_all,
                        .threads = 1};
        float *end = plane_of(cone, 4);
        Moments m = moments_of(&p, end);
        CHECK_NEAR(m.xx, 4 * o * o / 2, 1e-5, 0);
        CHECK_NEAR(m.yy, 4 * o * o / 2, 1e-5, 0);
        free(end);
    }
    free(start);
}

/* Blurred over far more than the domain: still between what there was. */
static void test_wide(void)
{
    enum { N = 25 };
    const char *const lights[] = {"sun:1,1,-3", "point:12,12,80", "spot:12,12,60,0,0,-1,40"};
    float *out = malloc(N * N * N * sizeof *out), *plane[3] = {out, NULL, NULL};
    for (int l = 0; l < 3; l++)
        for (double rate = 1; rate < 1e13; rate *= 1e4) {
            VolLight light = light_of(lights[l]);
            VolConePlanes p;
            if (vol_cone_planes(&light, &box, 1, rate, &p, NULL))
                abort();
            lit_voxels((VolCone){.planes = &p, .light = &light, .rate = rate, .channels = 1, .pass = pass_all}, N, plane, 1);
            for (int v = 0; v < N * N * N; v++)
                if (!(out[v] >= 0 && out[v] <= 1.0001f) || (l < 2 && out[v] < 0.9999f))
                    FAIL("%s, rate %g: %g", lights[l], rate, (double)out[v]);
        }
    free(out);
}

static void check_refused(const char *spec, const char *why)
{
    VolLight light = light_of(spec);
    VolConePlanes p;
    VolError err = {""};
    CHECK(vol_cone_planes(&light, &box, 1, 0.1, &p, &err) == VOL_USAGE);
    CHECK_TEXT(err.text, why);
}

static void test_refused(void)
{
    check_refused("point:12,12,12", "a light of --method cone lies outside the domain");
    check_refused("point:3,4,5", "a light of --method cone lies outside the domain");
    check_refused("point:12,12,30", "--method cone: a light sees the domain under at most 90 degrees");
    check_refused("spot:12,12,25,0,0,-1,100", "--method cone: a light sees the domain under at most 90 degrees");
    VolLight light = light_of("spot:12,12,25,0,0,-1,60");
    VolConePlanes p;
    CHECK(vol_cone_planes(&light, &box, 1, 0.1, &p, NULL) == VOL_OK);
}

int main(void)
{
    RUN(test_variance);
    RUN(test_isotropy);
    RUN(test_spreading);
    RUN(test_slab);
    RUN(test_reading);
    RUN(test_spot);
    RUN(test_as_printed);
    RUN(test_wide);
    RUN(test_refused);
    return test_end();
}
