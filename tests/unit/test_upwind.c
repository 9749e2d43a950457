/* The schemes as S prints them: the upwind sweep against its own equation and closed forms, relaxation against a few lines
 * of plain text.
 *
 *     test_upwind            the tests
 *     test_upwind --bench    milliseconds of a sweep, 128^3, on one and two threads */
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "light/gauss_seidel.h"
#include "light/upwind.h"
#include "tests/unit/random_fields.h"
#include "tests/unit/test.h"

static VolCpu levels[3] = {VOL_CPU_SCALAR};
static int level_count = 1;

static size_t count_of(const int32_t n[3]) { return (size_t)n[0] * (size_t)n[1] * (size_t)n[2]; }

static float *random_extinction(const int32_t n[3], uint64_t seed)
{
    Random r = {seed};
    float *field = malloc(count_of(n) * sizeof *field);
    for (size_t v = 0; v < count_of(n); v++)
        field[v] = random_below(&r, 3) ? (float)random_in(&r, 0, 0.3) : 0;
    return field;
}

static float *swept(VolUpwind u, const float *extinction, int threads)
{
    u.extinction = extinction;
    u.threads = threads;
    u.cpu = levels[threads % level_count];
    u.transmittance = malloc(count_of(u.n) * sizeof(float));
    for (size_t v = 0; v < count_of(u.n); v++)
        u.transmittance[v] = NAN;
    VolError err;
    if (vol_upwind(&u, &err) != VOL_OK)
        FAIL("%s", err.text);
    return u.transmittance;
}

/* What is left of the equation at a voxel, in units of its largest term. */
static double residual(const VolUpwind *u, const float *t, const float *extinction, const int32_t at[3])
{
    const size_t step[3] = {(size_t)u->n[1] * (size_t)u->n[2], (size_t)u->n[2], 1};
    size_t v = (size_t)at[0] * step[0] + (size_t)at[1] * step[1] + (size_t)at[2];
    double way[3], length = 0, sum = 0, weights = 0;
    for (int a = 0; a < 3; a++) {
        way[a] = u->from_point ? (at[a] - floor(u->light[a] + 0.5)) * u->edge[a] : u->light[a];
        length += way[a] * way[a];
    }
    length = sqrt(length);
    if (length == 0)
        return (double)t[v] - 1;
    for (int a = 0; a < 3; a++) {
        double w = fabs(way[a]) / length / u->edge[a];
        bool inside = way[a] > 0 ? at[a] > 0 : at[a] < u->n[a] - 1;
        weights += w;
        sum += w == 0 ? 0 : w * (inside ? (double)t[way[a] > 0 ? v - step[a] : v + step[a]] : 1);
    }
    return (double)t[v] - sum / (weights + (double)extinction[v]);
}

static void check_equation(const VolUpwind *u)
{
    float *extinction = random_extinction(u->n, 4), *t = swept(*u, extinction, 2);
    int32_t at[3];
    for (at[0] = 0; at[0] < u->n[0]; at[0]++)
        for (at[1] = 0; at[1] < u->n[1]; at[1]++)
            for (at[2] = 0; at[2] < u->n[2]; at[2]++)
                if (!(fabs(residual(u, t, extinction, at)) < 3e-7))
                    FAIL("light %g %g %g: residual %g at %d %d %d", u->light[0], u->light[1], u->light[2],
                         residual(u, t, extinction, at), at[0], at[1], at[2]);
    free(extinction);
    free(t);
}

static const int32_t sizes[][3] = {{1, 1, 1}, {1, 9, 1}, {5, 1, 3}, {20, 17, 33}, {3, 40, 19}, {33, 2, 8}};
enum { SIZES = sizeof sizes / sizeof *sizes };

static void test_suns(void)
{
    for (int i = 0; i < SIZES; i++)
        for (int way = 0; way < 27; way++) {
            double d[3] = {way % 3 - 1, 0.6 * (way / 3 % 3 - 1), 0.2 * (way / 9 - 1)};
            double length = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
            if (length == 0)
                continue;
            VolUpwind u = {.n = {sizes[i][0], sizes[i][1], sizes[i][2]}, .edge = {1, 0.5, 2},
                           .light = {d[0] / length, d[1] / length, d[2] / length}};
            check_equation(&u);
        }
}

static void test_points(void)
{
    const double points[][3] = {{3, 4, 5},       {2.4, 0.6, -7}, {-3, -2.5, 90}, {100, 5.5, 3},
                                {-1e12, 1e12, 0}, {0, 0, 0},      {19, 16, 32}};
    for (int i = 0; i < SIZES; i++)
        for (int p = 0; p < 7; p++) {
            VolUpwind u = {.n = {sizes[i][0], sizes[i][1], sizes[i][2]}, .edge = {1, 0.5, 2}, .from_point = true,
                           .light = {points[p][0], points[p][1], points[p][2]}};
            if (fabs(u.light[0]) < 1e9)
                check_equation(&u);
        }
    VolUpwind far = {.n = {2, 3, 4}, .edge = {1, 1, 1}, .from_point = true, .light = {-1e300, 1e12, 0}};
    float *extinction = random_extinction(far.n, 1), *t = swept(far, extinction, 1);
    for (int v = 0; v < 24; v++)
        CHECK(t[v] >= 0 && t[v] <= 1);
    free(extinction);
    free(t);
}

/* Along an axis: T = (1 + sigma h)^-(k + 1). */
static void test_along_axis(void)
{
    for (int axis = 0; axis < 3; axis++)
        for (int down = 0; down < 2; down++) {
            VolUpwind u = {.n = {12, 13, 14}, .edge = {0.5, 0.5, 0.5}};
            float extinction[12 * 13 * 14];
            for (size_t v = 0; v < count_of(u.n); v++)
                extinction[v] = 0.4f;
            u.light[axis] = down ? -1 : 1;
            float *t = swept(u, extinction, 1);
            for (int x = 0; x < 12; x++)
                for (int y = 0; y < 13; y++)
                    for (int z = 0; z < 14; z++) {
                        int k = axis == 0 ? x : axis == 1 ? y : z;
                        k = down ? u.n[axis] - 1 - k : k;
                        CHECK_NEAR((double)t[(x * 13 + y) * 14 + z], pow(1.2, -(k + 1)), 2e-6, 0);
                    }
            free(t);
        }
}

/* A light and a volume mirrored give the mirror image, to the last bit; threads and cpu levels change nothing. */
static void check_mirrored(VolUpwind u)
{
    float *extinction = random_extinction(u.n, 8), *mirrored = malloc(count_of(u.n) * sizeof *mirrored);
    float *t = swept(u, extinction, 1);
    for (int octant = 0; octant < 8; octant++) {
        VolUpwind other = u;
        for (int a = 0; a < 3; a++)
            if (octant >> a & 1)
                other.light[a] = u.from_point ? u.n[a] - 1 - u.light[a] : -u.light[a];
        for (int pass = 0; pass < 2; pass++) {
            float *got = pass ? swept(other, mirrored, 1 + octant % 6) : NULL;
            size_t v = 0;
            for (int x = 0; x < u.n[0]; x++)
                for (int y = 0; y < u.n[1]; y++)
                    for (int z = 0; z < u.n[2]; z++, v++) {
                        int i = octant & 1 ? u.n[0] - 1 - x : x, j = octant & 2 ? u.n[1] - 1 - y : y;
                        int k = octant & 4 ? u.n[2] - 1 - z : z;
                        size_t w = (size_t)((i * u.n[1] + j) * u.n[2] + k);
                        if (pass)
                            CHECK(memcmp(&got[w], &t[v], sizeof *t) == 0);
                        else
                            mirrored[w] = extinction[v];
                    }
            free(got);
        }
    }
    free(extinction);
    free(mirrored);
    free(t);
}

static void test_mirrored(void)
{
    check_mirrored((VolUpwind){.n = {21, 35, 18}, .edge = {1, 1, 1.5}, .light = {0.48, 0.6, 0.64}});
    check_mirrored((VolUpwind){.n = {21, 35, 18}, .edge = {1, 1, 1.5}, .from_point = true, .light = {4, 30, 9}});
}

/* Opaque: nothing behind; no NaN. */
static void test_extremes(void)
{
    VolUpwind u = {.n = {4, 4, 4}, .edge = {1e-3, 1, 1e3}, .light = {0.6, 0, 0.8}};
    float extinction[64];
    for (int point = 0; point < 2; point++)
        for (int k = 0; k < 3; k++) {
            for (int v = 0; v < 64; v++)
                extinction[v] = k == 0 ? 0 : k == 1 ? 1e30f : INFINITY;
            u.from_point = point;
            float *t = swept(u, extinction, 1);
            for (int v = 0; v < 64; v++)
                if (!(k == 0 ? fabs((double)t[v] - 1) < 1e-6 : t[v] < 1e-20f || (point && t[v] == 1)))
                    FAIL("extinction %g: %g at %d", (double)extinction[v], (double)t[v], v);
            free(t);
        }
}

/* ---- Relaxation ---- */

static void test_relaxation(void)
{
    const int32_t n[3] = {3, 4, 5};
    const double s[3] = {2, 0.5, 8};
    Random r = {3};
    float field[60], got[60];
    uint8_t medium[60];
    for (int v = 0; v < 60; v++) {
        got[v] = field[v] = (float)random_in(&r, 0, 1);
        medium[v] = random_below(&r, 5) ? VOL_MEDIUM_INSIDE : VOL_MEDIUM_OCCLUDER;
    }
    VolDiffusion d = {.n = {3, 4, 5}, .channels = 1, .field = {got}, .s = {{2, 0.5, 8}}, .medium = medium, .threads = 1};
    CHECK(!vol_relax_as_printed(&d, 20, NULL));
    for (int sweep = 0; sweep < 20; sweep++)
        for (int v = 0; v < 60; v++) {
            int at[3] = {v / 20, v / 5 % 4, v % 5}, step[3] = {20, 5, 1};
            double sum = (double)field[v], weight = 1;
            for (int a = 0; a < 3; a++)
                for (int way = -1; way <= 1; way += 2) {
                    bool inside = at[a] + way >= 0 && at[a] + way < n[a];
                    if (!inside || medium[v + way * step[a]] != VOL_MEDIUM_INSIDE)
                        continue;
                    sum += s[a] * (double)field[v + way * step[a]];
                    weight += s[a];
                }
            if (medium[v] == VOL_MEDIUM_INSIDE)
                field[v] = (float)(sum / weight);
        }
    for (int v = 0; v < 60; v++)
        CHECK_NEAR((double)got[v], (double)field[v], 1e-6, 0);
}

/* ---- Time ---- */

static double seconds(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

int main(int argc, char **argv)
{
    static const char *const names[] = {"avx2", "avx512"};
    for (int i = 0; i < 2; i++)
        level_count += !vol_cpu_choose(names[i], &levels[level_count], NULL);
    if (argc > 1 && strcmp(argv[1], "--bench") == 0) {
        for (int point = 0; point < 2; point++)
            for (int threads = 1; threads <= 2; threads++) {
                VolUpwind u = {.n = {128, 128, 128}, .edge = {1, 1, 1}, .light = {0.48, 0.6, 0.64}, .from_point = point,
                               .threads = threads, .cpu = levels[level_count - 1]};
                float *extinction = random_extinction(u.n, 1);
                double best = 1e9;
                u.transmittance = calloc(count_of(u.n), sizeof(float));
                u.extinction = extinction;
                for (int run = 0; run < 9; run++) {
                    double start = seconds();
                    if (vol_upwind(&u, NULL))
                        abort();
                    best = fmin(best, seconds() - start);
                }
                printf("128^3, %s, %d threads: %.2f ms\n", point ? "a point" : "a sun", threads, 1e3 * best);
                free(extinction);
                free(u.transmittance);
            }
        return 0;
    }
    RUN(test_suns);
    RUN(test_points);
    RUN(test_along_axis);
    RUN(test_mirrored);
    RUN(test_extremes);
    RUN(test_relaxation);
    return test_end();
}
