/* Fields at points: every cpu level against the scalar one, and that against voxels interpolated in plain double.
 *
 *     test_gather [--seed N]    random fields N+1, N+2, ... (default 0; a failure names its seed)
 *     test_gather --bench       points per second at every level */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "trace/gather_tmpl.h"
#include "tests/unit/random_fields.h"
#include "tests/unit/test.h"

enum { FIELDS = 200, POINTS = 300 };

static uint64_t first_seed;

static VolCpu levels[4] = {VOL_CPU_SCALAR};
static int level_count = 1;

static void find_levels(void)
{
    static const char *const names[] = {"avx2", "avx512", "neon"};
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        level_count += !vol_cpu_choose(names[i], &levels[level_count], NULL);
}

/* In index space: anywhere around a field, some on voxels and faces, many beside the one before. */
static void random_points(Random *r, const VolGrid *field, size_t count, VolVec3 *points)
{
    double at[3] = {0};
    for (size_t n = 0; n < count; n++) {
        int kind = n ? random_below(r, 4) : 0;
        for (int a = 0; a < 3; a++) {
            if (kind == 0)
                at[a] = random_in(r, field->domain_min[a] - 2, field->domain_max[a] + 2);
            else
                at[a] += random_in(r, -0.3, 0.3);
            if (kind == 1 && random_below(r, 2))
                at[a] = floor(at[a]);
            if (random_below(r, 40) == 0)
                at[a] = random_below(r, 2) ? field->domain_min[a] : field->domain_max[a];
        }
        points[n] = vol_apply(&field->index_to_world, vol_vec3(at[0], at[1], at[2]));
    }
}

static void gathered(const VolGrid *field, VolCpu cpu, bool precise, const VolVec3 *points, size_t count, double *out)
{
    VolGather gather;
    if (vol_gather_new(field, cpu, precise, &gather, NULL))
        abort();
    vol_gather(&gather, points, count, out);
    vol_gather_free(&gather);
}

/* ---- Against plain double ---- */

/* The cell of the domain that a point lies in, or beside which it lies; false: there is only background. */
static bool cell_of(const VolGrid *field, VolVec3 point, int32_t cell[3], double f[3])
{
    VolVec3 index = vol_apply(&field->world_to_index, point);
    const double x[3] = {index.x, index.y, index.z};
    bool inside = true;
    for (int a = 0; a < 3; a++) {
        double whole = floor(x[a]), least = field->cell_min[a], most = field->cell_max[a];
        inside = inside && whole >= least && whole <= most;
        f[a] = whole < least ? 0 : whole > most ? 1 : x[a] - whole;
        cell[a] = (int32_t)fmin(fmax(whole, least), most);
    }
    return inside || field->domain == VOL_DOMAIN_BOX;
}

static double voxel_of(const VolGrid *field, int32_t x, int32_t y, int32_t z, int c)
{
    double rgb[3] = {0};
    if (field->is_rgb)
        vol_grid_voxel_rgb(field, x, y, z, rgb);
    else
        rgb[c] = vol_grid_voxel(field, x, y, z);
    return rgb[c];
}

/* Channel c there, and the largest of the numbers it is made from. */
static double wanted(const VolGrid *field, VolVec3 point, int c, double *largest)
{
    int32_t cell[3];
    double f[3], sum = 0;
    bool finite = true;
    *largest = 0;
    if (!cell_of(field, point, cell, f))
        return vol_grid_in_plane(field, field->background, c);
    for (int n = 0; n < 8; n++) {
        double weight = (n >> 2 ? f[0] : 1 - f[0]) * (n >> 1 & 1 ? f[1] : 1 - f[1]) * (n & 1 ? f[2] : 1 - f[2]);
        double v = voxel_of(field, cell[0] + (n >> 2), cell[1] + (n >> 1 & 1), cell[2] + (n & 1), c);
        finite = finite && isfinite(v);
        sum += weight * v;
        *largest = fmax(*largest, fabs(v));
    }
    return finite ? sum : NAN;
}

static void check_field(const VolGrid *field, uint64_t seed, const VolVec3 *points)
{
    const size_t planes = (size_t)vol_grid_planes(field);
    double out[3 * POINTS], other[3 * POINTS];
    for (int precise = 0; precise <= 1; precise++) {
        double rounding = precise ? 0x1p-50 : 0x1p-21;
        gathered(field, VOL_CPU_SCALAR, precise, points, POINTS, out);
        for (size_t n = 0; n < POINTS * planes; n++) {
            double largest, want = wanted(field, points[n / planes], (int)(n % planes), &largest);
            if (isnan(want) ? !isnan(out[n]) : !(fabs(out[n] - want) <= rounding * largest))
                FAIL("seed %d, point %zu: %.17g, want %.17g", (int)seed, n, out[n], want);
        }
        for (int l = 1; l < level_count; l++) {
            gathered(field, levels[l], precise, points, POINTS, other);
            if (memcmp(out, other, POINTS * planes * sizeof *out) != 0)
                FAIL("seed %d: %s differs", (int)seed, vol_cpu_name(levels[l]));
        }
        for (size_t n = 0; n < POINTS; n++) /* each by itself */
            gathered(field, VOL_CPU_SCALAR, precise, &points[n], 1, &other[n * planes]);
        if (memcmp(out, other, POINTS * planes * sizeof *out) != 0)
            FAIL("seed %d: other points matter", (int)seed);
    }
}

static void fields_are_trilinear_at_any_level(void)
{
    for (uint64_t seed = first_seed + 1; seed <= first_seed + FIELDS; seed++) {
        Random r = {seed};
        RandomFields f;
        VolVec3 points[POINTS];
        random_fields(&r, seed % 2, &f);
        random_points(&r, f.rgb, POINTS, points);
        check_field(f.rgb, seed, points);
        check_field(f.channel[seed % 3], seed, points);
        fields_free(&f);
    }
}

/* Tiles of every size, far from the origin, where float knows no single voxel. */
static void places_are_exact_far_away(void)
{
    enum { FAR = 1 << 29 };
    const VolGridSource source = {.index_to_world = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {-FAR, -FAR, -FAR}}}, .box = true,
                                  .box_min = {FAR, FAR, FAR}, .box_max = {FAR + 4199, FAR + 99, FAR + 99},
                                  .background_rgb = {1, 2, 3}};
    FieldBuilders to;
    RandomFields f = {.lo = {FAR, FAR, FAR}, .hi = {FAR + 4199, FAR + 99, FAR + 99}};
    Random r = {3};
    VolVec3 points[POINTS];
    fields_begin(&source, &to);
    fields_tile(&to, source.box_min, 4096, (double[3]){0.25, 0.5, 0.75}, true);
    fields_tile(&to, (int32_t[3]){FAR + 4096, FAR, FAR}, 8, (double[3]){4, 5, 6}, true);
    for (int n = 1; n < 12; n++)
        random_leaf(&r, &f, (int32_t[3]){FAR + 4096 + 8 * n, FAR, FAR}, false, &to);
    fields_finish(&to, &f);
    for (int n = 0; n < POINTS; n++)
        points[n] = vol_vec3(random_in(&r, 4080, 4200), random_in(&r, -1, 20), random_in(&r, -1, 20));
    check_field(f.rgb, 0, points);
    check_field(f.channel[1], 0, points);
    fields_free(&f);
}

static void doubles_are_gathered(void)
{
    const VolGridSource source = {.index_to_world = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}, .box = true,
                                  .box_max = {7, 7, 7}, .as_double = true};
    VolGridBuilder *builder;
    VolGrid *field;
    Random r = {5};
    double values[512];
    uint64_t active[8];
    VolVec3 points[POINTS];
    memset(active, 255, sizeof active);
    for (int n = 0; n < 512; n++)
        values[n] = random_unit(&r);
    if (vol_grid_begin(&source, &builder, NULL) ||
        vol_grid_leaf(builder, (int32_t[3]){0, 0, 0}, NULL, values, active, NULL) || vol_grid_finish(builder, &field, NULL))
        abort();
    random_points(&r, field, POINTS, points);
    check_field(field, 0, points);
    vol_grid_free(field);
}

/* ---- In kernels ---- */

static void lanes_are_split_and_gathered(void)
{
    ints cell;
    reals place, x;
    RandomFields f;
    Random r = {11};
    VolGather gather;
    Gather g;
    for (int i = 0; i < LANES; i++)
        x[i] = (real)(i - 3) * (real)0.75;
    gather_split(ints_all(100), x, &cell, &place);
    for (int i = 0; i < LANES; i++)
        CHECK((real)cell[i] - 100 + place[i] == x[i] && place[i] >= 0 && place[i] <= 1);
    gather_split(ints_all(0), reals_all(-INFINITY), &cell, &place);
    CHECK(cell[0] == -(1 << 30));
    random_fields(&r, false, &f);
    if (vol_gather_new(f.channel[0], VOL_CPU_SCALAR, false, &gather, NULL))
        abort();
    gather_begin(&g, &gather);
    const ints at[3] = {ints_all(f.lo[0]), ints_all(f.lo[1]), ints_all(f.lo[2])};
    const reals f0[3] = {reals_all(0), reals_all(0), reals_all(0)};
    reals rgb[3], v = gather_number(&g, at, f0, ints_all(-1));
    gather_rgb(&g, at, f0, ints_all(-1), rgb);
    CHECK((double)v[0] == vol_grid_voxel(f.channel[0], f.lo[0], f.lo[1], f.lo[2]));
    CHECK(rgb[0][1] == v[1] && rgb[1][1] == v[1] && rgb[2][1] == v[1]);
    vol_gather_free(&gather);
    fields_free(&f);
}

/* ---- Speed ---- */

static void bench(void)
{
    enum { MANY = 1 << 20 };
    Random r = {1};
    RandomFields f;
    VolVec3 *points = malloc(MANY * sizeof *points);
    double *out = malloc(3 * MANY * sizeof *out);
    random_fields(&r, false, &f);
    for (int n = 0; n < MANY; n++) { /* as along rays */
        double t = (double)(n % 1000) / 1000;
        VolVec3 index = {f.lo[0] + t * (f.hi[0] - f.lo[0]), f.lo[1] + 0.4 * t, f.lo[2] + 0.5 + 0.2 * t};
        points[n] = vol_apply(&f.rgb->index_to_world, index);
    }
    for (int l = 0; l < level_count; l++)
        for (int k = 0; k < 4; k++) {
            struct timespec a, b;
            clock_gettime(CLOCK_MONOTONIC, &a);
            gathered(k & 2 ? f.rgb : f.channel[0], levels[l], k & 1, points, MANY, out);
            clock_gettime(CLOCK_MONOTONIC, &b);
            double seconds = (double)(b.tv_sec - a.tv_sec) + (double)(b.tv_nsec - a.tv_nsec) * 1e-9;
            printf("# %s, %s, %s: %.1f million points per second\n", vol_cpu_name(levels[l]), k & 1 ? "double" : "float",
                   k & 2 ? "RGB" : "scalar", MANY / seconds * 1e-6);
        }
    fields_free(&f);
    free(points);
    free(out);
}

int main(int argc, char **argv)
{
    find_levels();
    if (argc == 2 && strcmp(argv[1], "--bench") == 0) {
        bench();
        return 0;
    }
    first_seed = seed_before_first(argc, argv);
    RUN(fields_are_trilinear_at_any_level);
    RUN(places_are_exact_far_away);
    RUN(doubles_are_gathered);
    RUN(lanes_are_split_and_gathered);
    return test_end();
}
