/* What a volume lets through between planes, against rays by the exact estimator.
 *
 *     test_cone_medium [--seed N]    random scenes N+1, N+2, ... (default 0; a failure names its seed)
 *     test_cone_medium --bench       milliseconds of `cone`, 128^3, on one and two threads */
#include <time.h>

#include "base/fmath.h"
#include "light/cone_medium.h"
#include "light/transport.h"
#include "tests/unit/random_scene.h"
#include "tests/unit/test.h"

static uint64_t first_seed;

enum { SCENES = 120 };

/* Of the rays between two planes by the exact estimator. */
static double exact_passed(const VolPrepared *prepared, const VolConePlanes *p, int k, int i, int j, int c)
{
    VolVec3 from = vol_cone_place(p, k, i, j), way = vol_sub(vol_cone_place(p, k + 1, i, j), from);
    VolRay ray = {from, vol_scale(way, 1 / vol_length(way)), 0, vol_length(way)};
    VolRadiance out;
    if (!vol_ray_clip(prepared->scene, &ray))
        return 1;
    trace_rays(prepared, &ray, 1, &out);
    return vol_exp(-out.optical_depth[c]);
}

/* `samples`: of a voxel; returns the root of the mean square of the difference. */
static double check_scene(RandomScene *s, const VolLight *light, int samples)
{
    const VolConeDomain domain = {.index_to_world = s->grid->index_to_world,
                                  .lo = {s->grid->domain_min[0], s->grid->domain_min[1], s->grid->domain_min[2]},
                                  .hi = {s->grid->domain_max[0], s->grid->domain_max[1], s->grid->domain_max[2]}};
    VolConePlanes p;
    VolConeMedium medium;
    VolTfCompiled transport;
    VolPrepared prepared;
    VolError err;
    if (vol_cone_planes(light, &domain, s->grid->voxel, 0.01, &p, &err) != VOL_OK)
        return 0;
    VolScene scene = s->scene, as_absorbed = s->scene;
    as_absorbed.tf = &transport;
    as_absorbed.precise = true;
    as_absorbed.layers = 0;
    as_absorbed.termination_opacity = 1e-12;
    if (vol_cone_medium_new(&scene, samples, 1, &medium, &err) || vol_transport_of(s->scene.tf, &transport, &err) ||
        vol_scene_prepare(&as_absorbed, &prepared, &err)) {
        FAIL("%s", err.text);
        return 0;
    }
    float *row[3];
    for (int c = 0; c < 3; c++)
        row[c] = malloc((size_t)p.size[1] * sizeof **row);
    double sum = 0, count = 0;
    for (int k = 0; k < p.count; k += 5)
        for (int i = 0; i < p.size[0]; i += 7) {
            CHECK(!vol_cone_medium_pass(&medium, &p, k, i, 0, row, &err));
            for (int j = 0; j < p.size[1]; j += 3)
                for (int c = 0; c < medium.channels; c++) {
                    double off = (double)row[c][j] - exact_passed(&prepared, &p, k, i, j, c);
                    CHECK(row[c][j] >= 0 && row[c][j] <= 1);
                    sum += off * off;
                    count++;
                }
        }
    for (int c = 0; c < 3; c++)
        free(row[c]);
    vol_prepared_free(&prepared);
    vol_cone_medium_free(&medium);
    vol_tf_compiled_free(&transport);
    return sqrt(sum / fmax(count, 1));
}

/* Finer samples come to the exact rays, whatever attenuates; the mean over scenes by second order. */
static void test_scenes(void)
{
    static const char *const lights[] = {"sun:1,0,0", "sun:0.3,-0.7,0.2", "point:40,31,-26", "spot:-50,-10,12,5,1,-1.2,40"};
    double mean[2] = {0};
    for (uint64_t seed = first_seed + 1; seed <= first_seed + SCENES; seed++) {
        for (int fine = 0; fine < 2; fine++) {
            Random r = {seed};
            RandomScene s;
            VolLight light;
            random_scene(&r, RANDOM_NO_PLATEAUS | RANDOM_UNSHADED | RANDOM_NO_DELTAS, &s);
            s.scene.clip_count = seed % 2;
            if (vol_light_parse(lights[seed % 4], &light, NULL))
                abort();
            double off = check_scene(&s, &light, fine ? 64 : 16);
            mean[fine] += off * off / SCENES;
            if (fine && !(off < 2e-3))
                FAIL("seed %llu: off by %g", (unsigned long long)seed, off);
            random_scene_free(&s);
        }
    }
    CHECK(sqrt(mean[1]) < 0.4 * sqrt(mean[0]));
}

/* ---- Closed forms ---- */

/* n^3 voxels, v = x / (n - 1), a box. */
static VolGrid *ramp(int n)
{
    VolGridSource source = {.box = true, .box_max = {n - 1, n - 1, n - 1},
                            .index_to_world = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, 0}}}};
    VolGridBuilder *builder;
    VolGrid *grid;
    uint64_t active[8];
    memset(active, 255, sizeof active);
    if (vol_grid_begin(&source, &builder, NULL))
        abort();
    for (int32_t x = 0; x < n; x += 8)
        for (int32_t y = 0; y < n; y += 8)
            for (int32_t z = 0; z < n; z += 8) {
                float values[512];
                for (int v = 0; v < 512; v++)
                    values[v] = (float)(x + (v >> 6)) / (float)(n - 1);
                if (vol_grid_leaf(builder, (int32_t[3]){x, y, z}, values, NULL, active, NULL))
                    abort();
            }
    if (vol_grid_finish(builder, &grid, NULL))
        abort();
    return grid;
}

static double lit_at(const RandomScene *s, const char *spec, VolVec3 place, int c)
{
    VolLight light;
    VolConePlanes p;
    VolConeMedium medium;
    const VolGrid *g = s->grid;
    const VolConeDomain domain = {g->index_to_world, {0, 0, 0}, {g->domain_max[0], g->domain_max[1], g->domain_max[2]}};
    float out[3] = {0};
    VolConeRow row = {.count = 1};
    VolAffine at = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {place.x, place.y, place.z}}};
    VolError err;
    VolStatus status = vol_light_parse(spec, &light, &err);
    if (status == VOL_OK)
        status = vol_cone_planes(&light, &domain, 1, 0.002, &p, &err);
    if (status == VOL_OK)
        status = vol_cone_medium_new(&s->scene, 2, 1, &medium, &err);
    VolCone cone = {.planes = &p, .light = &light, .rate = 0.002, .pass = vol_cone_medium_pass, .user = &medium,
                    .index_to_world = at, .rows = &row, .row_count = 1, .out = {out, out + 1, out + 2}, .threads = 1};
    if (status == VOL_OK) {
        cone.channels = medium.channels;
        status = vol_cone_solve(&cone, &err);
        vol_cone_medium_free(&medium);
    }
    if (status != VOL_OK)
        FAIL("%s", err.text);
    return (double)out[c < cone.channels ? c : 0];
}

/* transport 1/2 per unit where v is 0 to 1/4 at v = 1; a soft surface of all the range; an isosurface at v = 1/4. */
static void test_closed_forms(void)
{
    RandomScene s = {.grid = ramp(16)};
    VolTf *tf = &s.tf;
    const char *text = "{\"pellucid\": \"transfer-function/1\", \"interpolate\": \"extinction\", "
                       "\"scatter\": [[0, 0.9]], \"surface\": [[0, 0.5], [1, 0.5]], \"scalar_step\": 2, "
                       "\"transport\": [[0, [0.5, 0.9, 1]], [1, [0.25, 0.9, 1]]], "
                       "\"isosurfaces\": [{\"value\": 0.25, \"opacity\": 0.6}]}";
    VolBytes bytes = {(unsigned char *)(uintptr_t)text, strlen(text)};
    if (vol_tf_parse(&bytes, "test", tf, NULL, NULL) || vol_tf_compile(tf, NULL, &s.compiled, NULL))
        abort();
    s.scene = (VolScene){.volume = vol_volume_of_grid(s.grid), .tf = &s.compiled};
    /* Across: nothing but particles.  Their extinction is ln 2 (1 + v); x = 3.5 is a lattice point's, v = 3.5 / 15. */
    CHECK_NEAR(lit_at(&s, "sun:0,1,0", vol_vec3(3.5, 9, 8), 0), vol_exp(-9 * (1 + 3.5 / 15) * vol_log(2)), 3e-3, 0);
    CHECK_NEAR(lit_at(&s, "sun:0,1,0", vol_vec3(3, 9, 8), 1), vol_exp(9 * vol_log(0.9)), 1e-4, 0);
    CHECK_NEAR(lit_at(&s, "sun:0,1,0", vol_vec3(3, 9, 8), 2), 1, 1e-6, 0);
    /* Along: through the isosurface and 9/15 of half a scalar step of surface. */
    double surface = vol_exp(vol_log(0.5) / 2 * 9 / 15);
    CHECK_NEAR(lit_at(&s, "sun:1,0,0", vol_vec3(9, 8, 8), 2), 0.4 * surface, 1e-5, 0);
    CHECK_NEAR(lit_at(&s, "sun:1,0,0", vol_vec3(9, 8, 8), 1), 0.4 * surface * vol_exp(9 * vol_log(0.9)), 1e-5, 0);
    CHECK_NEAR(lit_at(&s, "sun:1,0,0", vol_vec3(9, 8, 8), 0),
               0.4 * surface * vol_exp(-vol_log(2) * (9 + 9 * 9 / 30.0)), 1e-4, 0);
    /* From the other end the isosurface lies behind. */
    CHECK_NEAR(lit_at(&s, "sun:-1,0,0", vol_vec3(9, 8, 8), 2), vol_exp(vol_log(0.5) / 2 * 6 / 15), 1e-5, 0);
    vol_grid_free(s.grid);
    vol_tf_compiled_free(&s.compiled);
    vol_tf_free(tf);
}

/* As tests/micro has it: a slab so wide that the blur does nothing; indirect light starts at 1 and is what `transport`
 * leaves at every voxel. */
static void test_slab(void)
{
    const char *text = "{\"pellucid\": \"transfer-function/1\", \"scatter\": [[0, 0.4], [1, 0.4]], "
                       "\"transport\": [[0, [0.9, 0.6, 0.3]], [1, [0.9, 0.6, 0.3]]]}";
    const double angle = vol_tan(5 * 3.14159265358979323846 / 180), left[3] = {0.9, 0.6, 0.3};
    VolGridSource source = {.box = true, .box_max = {10, 10, 3}, .background = 0.5,
                            .index_to_world = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, 0}}}};
    VolGridBuilder *builder;
    RandomScene s = {0};
    VolBytes bytes = {(unsigned char *)(uintptr_t)text, strlen(text)};
    VolLight light;
    VolConePlanes p;
    VolConeMedium medium;
    float out[3][4];
    VolConeRow row = {{5, 5, 0}, 4, 0};
    if (vol_grid_begin(&source, &builder, NULL) || vol_grid_finish(builder, &s.grid, NULL) ||
        vol_tf_parse(&bytes, "test", &s.tf, NULL, NULL) || vol_tf_compile(&s.tf, NULL, &s.compiled, NULL) ||
        vol_light_parse("sun:0,0,-1:1,0.5,0.25", &light, NULL))
        abort();
    s.scene = (VolScene){.volume = vol_volume_of_grid(s.grid), .tf = &s.compiled};
    const VolConeDomain domain = {s.grid->index_to_world, {0, 0, 0}, {10, 10, 3}};
    if (vol_cone_planes(&light, &domain, 1, 0.5 * angle * angle, &p, NULL) ||
        vol_cone_medium_new(&s.scene, 2, 1, &medium, NULL))
        abort();
    VolCone cone = {.planes = &p, .light = &light, .rate = 0.5 * angle * angle, .channels = medium.channels,
                    .pass = vol_cone_medium_pass, .user = &medium, .index_to_world = s.grid->index_to_world, .rows = &row,
                    .row_count = 1, .out = {out[0], out[1], out[2]}, .threads = 1};
    CHECK(medium.channels == 3 && !vol_cone_solve(&cone, NULL));
    for (int c = 0; c < 3; c++)
        for (int z = 0; z < 4; z++)
            CHECK_NEAR((double)out[c][z], vol_pow(left[c], 3 - z), 1e-6, 0);
    vol_cone_medium_free(&medium);
    vol_grid_free(s.grid);
    vol_tf_compiled_free(&s.compiled);
    vol_tf_free(&s.tf);
}

/* ---- Time ---- */

static double seconds(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void bench(int threads)
{
    enum { N = 128 };
    RandomScene s = {.grid = ramp(N)};
    const char *text = "{\"pellucid\": \"transfer-function/1\", \"scatter\": [[0.2, 0], [1, 0.1]], "
                       "\"transport\": [[0, [1, 1, 1]], [1, [0.9, 0.95, 0.99]]]}";
    VolBytes bytes = {(unsigned char *)(uintptr_t)text, strlen(text)};
    VolLight light;
    VolConePlanes p;
    VolConeMedium medium;
    if (vol_tf_parse(&bytes, "test", &s.tf, NULL, NULL) || vol_tf_compile(&s.tf, NULL, &s.compiled, NULL) ||
        vol_light_parse("sun:1,2,3", &light, NULL))
        abort();
    s.scene = (VolScene){.volume = vol_volume_of_grid(s.grid), .tf = &s.compiled};
    if (vol_cpu_choose("auto", &s.scene.cpu, NULL))
        abort();
    const VolConeDomain domain = {s.grid->index_to_world, {0, 0, 0}, {N - 1, N - 1, N - 1}};
    VolConeRow *rows = malloc(N * N * sizeof *rows);
    float *out = malloc(3 * N * N * N * sizeof *out);
    for (int i = 0; i < N * N; i++)
        rows[i] = (VolConeRow){{i / N, i % N, 0}, N, (size_t)i * N};
    double start = seconds();
    if (vol_cone_planes(&light, &domain, 1, 0.036, &p, NULL) || vol_cone_medium_new(&s.scene, 2, threads, &medium, NULL))
        abort();
    VolCone cone = {.planes = &p, .light = &light, .rate = 0.036, .channels = medium.channels, .pass = vol_cone_medium_pass,
                    .user = &medium, .index_to_world = s.grid->index_to_world, .rows = rows, .row_count = N * N,
                    .out = {out, out + N * N * N, out + 2 * N * N * N}, .threads = threads};
    if (vol_cone_solve(&cone, NULL))
        abort();
    printf("128^3, sun 1,2,3, %d planes of %dx%d, %d threads: %.0f ms\n", p.count, p.size[0], p.size[1], threads,
           1e3 * (seconds() - start));
    vol_cone_medium_free(&medium);
    vol_grid_free(s.grid);
    vol_tf_compiled_free(&s.compiled);
    vol_tf_free(&s.tf);
    free(rows);
    free(out);
}

int main(int argc, char **argv)
{
    if (argc > 1 && strcmp(argv[1], "--bench") == 0) {
        bench(1);
        bench(2);
        return 0;
    }
    first_seed = seed_before_first(argc, argv);
    RUN(test_scenes);
    RUN(test_closed_forms);
    RUN(test_slab);
    return test_end();
}
