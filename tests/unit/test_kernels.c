/* The ray kernels against each other and against a march that shares nothing with them but the scene.
 *
 *     test_kernels [--seed N]    random scenes N+1, N+2, ... (default 0; a failure names its seed)
 *     test_kernels --bench       seconds of every kernel on larger scenes, against its scalar level */
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "base/cpu.h"
#include "tests/unit/random_scene.h"
#include "tests/unit/test.h"

enum { SCENES = 150, RAYS = 40 };

static uint64_t first_seed;

static VolRadiance traced(RandomScene *s, VolCpu cpu, VolEstimator estimator, const VolRay *ray)
{
    VolRadiance out;
    s->scene.cpu = cpu;
    s->scene.estimator = estimator;
    trace_rays(&s->prepared, ray, 1, &out);
    return out;
}

/* Those that this machine has, beside the scalar one. */
static int levels_of_machine(VolCpu out[3])
{
    static const char *const names[] = {"avx2", "avx512", "neon"};
    int count = 0;
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        count += !vol_cpu_choose(names[i], &out[count], NULL);
    return count;
}

static void begin_scene(uint64_t seed, int flags, bool precise, Random *r, RandomScene *s)
{
    *r = (Random){seed};
    random_scene(r, flags, s);
    s->scene.precise = precise;
    if (vol_scene_prepare(&s->scene, &s->prepared, NULL))
        abort();
}

static void compare_levels(bool precise)
{
    VolCpu levels[3];
    int count = levels_of_machine(levels);
    for (uint64_t seed = first_seed + 1; seed <= first_seed + SCENES; seed++) {
        Random r;
        RandomScene s;
        begin_scene(seed, 0, precise, &r, &s);
        for (int i = 0; i < RAYS; i++) {
            VolRay ray = random_ray(&r, &s);
            if (!vol_ray_clip(&s.scene, &ray))
                continue;
            for (int e = VOL_ESTIMATE_EXACT; e <= VOL_ESTIMATE_DIRECT; e++) {
                VolRadiance a = traced(&s, VOL_CPU_SCALAR, (VolEstimator)e, &ray);
                for (int n = 0; n < count; n++) {
                    VolRadiance b = traced(&s, levels[n], (VolEstimator)e, &ray);
                    if (memcmp(&a, &b, sizeof a) != 0)
                        FAIL("seed %d ray %d estimator %d: scalar and %s differ (R %.17g, %.17g)", (int)seed, i, e,
                             vol_cpu_name(levels[n]), a.color[0], b.color[0]);
                }
            }
        }
        end_scene(&s);
    }
}

/* A ray's result is its own: alone, or with others in any place. */
static void company_changes_nothing(void)
{
    for (uint64_t seed = first_seed + 1; seed <= first_seed + SCENES; seed++)
        for (int e = VOL_ESTIMATE_EXACT; e <= VOL_ESTIMATE_DIRECT; e++) {
            Random r = {seed};
            RandomScene s;
            random_scene(&r, 0, &s);
            s.scene.precise = seed % 4 == 0;
            s.scene.estimator = (VolEstimator)e;
            s.scene.layers = seed % 2 ? 1u << VOL_LAYER_Z | 1u << VOL_LAYER_SURFACE : 0;
            if (vol_cpu_choose("auto", &s.scene.cpu, NULL) || vol_scene_prepare(&s.scene, &s.prepared, NULL))
                abort();
            VolRay rays[VOL_PACKET];
            VolRadiance all[VOL_PACKET], one;
            size_t count = random_packet(&r, &s, VOL_PACKET, rays);
            trace_rays(&s.prepared, rays, count, all);
            for (size_t i = 0; i < count; i++) {
                trace_rays(&s.prepared, &rays[i], 1, &one);
                if (memcmp(&one, &all[i], sizeof one) != 0)
                    FAIL("seed %d ray %d estimator %d: %.17g alone, %.17g in company", (int)seed, (int)i, e, one.color[0],
                         all[i].color[0]);
            }
            end_scene(&s);
        }
}

static void every_level_gives_the_same_bytes_in_float(void) { compare_levels(false); }
static void every_level_gives_the_same_bytes_in_double(void) { compare_levels(true); }

static void skipping_changes_nothing(void)
{
    for (uint64_t seed = first_seed + 1; seed <= first_seed + SCENES; seed++)
        for (int precise = 0; precise < 2; precise++) {
            Random r = {seed};
            RandomScene s;
            random_scene(&r, seed & 1 ? RANDOM_BOUNDED : 0, &s);
            VolScene plain = s.scene;
            VolPrepared prepared_plain;
            plain.skip = false;
            plain.precise = s.scene.precise = precise;
            if (vol_scene_prepare(&s.scene, &s.prepared, NULL) || vol_scene_prepare(&plain, &prepared_plain, NULL))
                abort();
            for (int i = 0; i < RAYS; i++) {
                VolRay ray = random_ray(&r, &s);
                if (!vol_ray_clip(&s.scene, &ray))
                    continue;
                for (int e = VOL_ESTIMATE_EXACT; e <= VOL_ESTIMATE_DIRECT; e++) {
                    VolRadiance a, b;
                    s.scene.estimator = plain.estimator = (VolEstimator)e;
                    trace_rays(&s.prepared, &ray, 1, &a);
                    trace_rays(&prepared_plain, &ray, 1, &b);
                    if (memcmp(&a, &b, sizeof a) != 0)
                        FAIL("seed %d ray %d estimator %d precise %d: %.17g with skipping, %.17g without (tau %.17g, %.17g)",
                             (int)seed, i, e, precise, a.color[0], b.color[0], a.optical_depth[0], b.optical_depth[0]);
                }
            }
            vol_prepared_free(&prepared_plain);
            end_scene(&s);
        }
}

/* Values exactly at a jump of the transfer function are left out: there rounding decides the side. */
static void float_stays_near_double(void)
{
    double worst = 0, sum = 0, count = 0;
    for (uint64_t seed = first_seed + 1; seed <= first_seed + 4 * SCENES; seed++) {
        Random r = {seed};
        RandomScene s;
        random_scene(&r, RANDOM_NO_PLATEAUS | RANDOM_NO_DELTAS | RANDOM_UNSHADED, &s);
        VolScene precise = s.scene;
        VolPrepared prepared_precise;
        precise.precise = true;
        if (vol_scene_prepare(&s.scene, &s.prepared, NULL) || vol_scene_prepare(&precise, &prepared_precise, NULL))
            abort();
        for (int i = 0; i < RAYS; i++) {
            VolRay ray = random_ray(&r, &s);
            if (!vol_ray_clip(&s.scene, &ray))
                continue;
            VolRadiance a, b;
            trace_rays(&s.prepared, &ray, 1, &a);
            trace_rays(&prepared_precise, &ray, 1, &b);
            for (int c = 0; c < 3; c++) {
                double error = fabs(a.color[c] - b.color[c]) / fmax(1, fabs(b.color[c]));
                worst = fmax(worst, error);
                sum += error * error;
                count++;
            }
        }
        vol_prepared_free(&prepared_precise);
        end_scene(&s);
    }
    printf("# colour, float to double: rms %.3g, largest %.3g\n", sqrt(sum / count), worst);
    CHECK(sqrt(sum / count) < 2e-7);
    CHECK(worst < 1e-5);
}

/* ---- A march of many small steps, in double, by voxel look-ups alone ---- */

static bool field_at(const VolGrid *grid, VolVec3 world, double *v)
{
    VolVec3 x = vol_apply(&grid->world_to_index, world);
    double p[3] = {x.x, x.y, x.z}, f[3], sum = 0;
    int32_t base[3];
    for (int a = 0; a < 3; a++) {
        base[a] = (int32_t)floor(p[a]);
        f[a] = p[a] - base[a];
    }
    for (int n = 0; n < 8; n++) {
        double w = (n >> 2 ? f[0] : 1 - f[0]) * (n >> 1 & 1 ? f[1] : 1 - f[1]) * (n & 1 ? f[2] : 1 - f[2]);
        sum += w * vol_grid_voxel(grid, base[0] + (n >> 2), base[1] + (n >> 1 & 1), base[2] + (n & 1));
    }
    *v = sum;
    return isfinite(sum);
}

static double line(VolLinear l, double x) { return l.a + l.b * x; }

static void march(const RandomScene *s, const VolRay *ray, int steps, double color[3], double optical_depth[3])
{
    const VolTfCompiled *tf = &s->compiled;
    double h = (ray->t1 - ray->t0) / steps, before, v;
    for (int c = 0; c < 3; c++)
        color[c] = optical_depth[c] = 0;
    bool known = field_at(s->grid, vol_along(ray->origin, ray->t0, ray->direction), &before);
    for (int i = 0; i < steps; i++) {
        double after;
        bool ok = field_at(s->grid, vol_along(ray->origin, ray->t0 + (i + 0.5) * h, ray->direction), &v);
        bool end = field_at(s->grid, vol_along(ray->origin, ray->t0 + (i + 1) * h, ray->direction), &after);
        if (ok && known && end) {
            const VolTfInterval *in = &tf->intervals[vol_tf_interval(tf, v)];
            double x = v - in->v_ref, surface = line(in->surface, x) * fabs(after - before);
            for (int c = 0; c < 3; c++) {
                double mu = line(in->scatter, x) * h;
                double dtau = mu + line(in->absorb[c], x) * h + surface;
                double q = line(in->scatter_color[c], x) * mu + line(in->emit[c], x) * h;
                q += line(in->surface_color[c], x) * surface;
                color[c] += exp(-optical_depth[c] - 0.5 * dtau) * q;
                optical_depth[c] += dtau;
            }
        }
        before = after;
        known = end;
    }
}

/* Along the face of a cell with a hole rounding decides which side the ray is on. */
static bool may_graze_a_hole(const RandomScene *s, const VolRay *ray)
{
    VolVec3 d = vol_apply_linear(&s->grid->world_to_index, ray->direction);
    return s->grid->bad_voxels && (fabs(d.x) < 1e-9 || fabs(d.y) < 1e-9 || fabs(d.z) < 1e-9);
}

static void exact_agrees_with_a_fine_march(void)
{
    double worst = 0;
    for (uint64_t seed = first_seed + 1; seed <= first_seed + 60; seed++) {
        Random r;
        RandomScene s;
        begin_scene(seed, RANDOM_NO_DELTAS | RANDOM_UNSHADED, true, &r, &s);
        for (int i = 0; i < 3; i++) {
            VolRay ray = random_ray(&r, &s);
            if (!vol_ray_clip(&s.scene, &ray) || may_graze_a_hole(&s, &ray))
                continue;
            VolRadiance got;
            double color[3], optical_depth[3];
            trace_rays(&s.prepared, &ray, 1, &got);
            march(&s, &ray, 40000, color, optical_depth);
            for (int c = 0; c < 3; c++) {
                double error = fabs(got.color[c] - color[c]) / fmax(1, color[c]);
                error = fmax(error, fabs(exp(-got.optical_depth[s.compiled.coloured ? c : 0]) - exp(-optical_depth[c])));
                worst = fmax(worst, error);
                if (!(error < 2e-3))
                    FAIL("seed %d ray %d channel %d: colour %.10g, march %.10g; tau %.10g, %.10g", (int)seed, i, c,
                         got.color[c], color[c], got.optical_depth[0], optical_depth[c]);
            }
        }
        end_scene(&s);
    }
    /* Jumps and spikes hold the march back to first order: single rays may be off by 1e-3. */
    printf("# largest difference from the march: %.3g\n", worst);
}

static void stop_at(RandomScene *s, double opacity)
{
    vol_prepared_free(&s->prepared);
    s->scene.termination_opacity = opacity;
    if (vol_scene_prepare(&s->scene, &s->prepared, NULL))
        abort();
}

static void early_termination_keeps_its_bound(void)
{
    double worst = 0;
    /* In scene 331 what is reflected and what is emitted add up behind an opaque part. */
    for (uint64_t seed = first_seed + 201; seed <= first_seed + 200 + SCENES; seed++) {
        Random r;
        RandomScene s;
        begin_scene(seed, 0, true, &r, &s);
        for (int i = 0; i < RAYS; i++) {
            VolRay ray = random_ray(&r, &s);
            if (!vol_ray_clip(&s.scene, &ray))
                continue;
            VolRadiance all, cut;
            stop_at(&s, 0x1p-200);
            trace_rays(&s.prepared, &ray, 1, &all);
            stop_at(&s, 0x1p-10);
            trace_rays(&s.prepared, &ray, 1, &cut);
            for (int c = 0; c < 3; c++) {
                double error = fabs(all.color[c] - cut.color[c]);
                error = fmax(error, fabs(exp(-all.optical_depth[c]) - exp(-cut.optical_depth[c])));
                worst = fmax(worst, error);
                if (!(error <= 0x1p-10))
                    FAIL("seed %d ray %d channel %d: changed by %.3g", (int)seed, i, c, error);
            }
        }
        end_scene(&s);
    }
    printf("# stop at 2^-10: largest change %.3g of %.3g allowed\n", worst, 0x1p-10);
    CHECK(worst > 0); /* the test would notice nothing if no ray were cut */
}

static void parts_add_up_to_the_colour(void)
{
    for (uint64_t seed = first_seed + 1; seed <= first_seed + SCENES; seed++) {
        Random r = {seed};
        RandomScene s;
        random_scene(&r, 0, &s);
        s.scene.layers = 1u << VOL_LAYER_SURFACE;
        if (vol_scene_prepare(&s.scene, &s.prepared, NULL))
            abort();
        for (int i = 0; i < RAYS; i++) {
            VolRay ray = random_ray(&r, &s);
            VolRadiance out;
            if (!vol_ray_clip(&s.scene, &ray))
                continue;
            for (int e = VOL_ESTIMATE_EXACT; e <= VOL_ESTIMATE_DIRECT; e++) {
                out = traced(&s, VOL_CPU_SCALAR, (VolEstimator)e, &ray);
                for (int c = 0; c < 3; c++) {
                    double sum = out.sum[VOL_SUM_SURFACE][c] + out.sum[VOL_SUM_SCATTER][c] + out.sum[VOL_SUM_EMIT][c];
                    CHECK_NEAR(sum, out.color[c], 1e-6, 1e-7);
                    CHECK(isfinite(out.color[c]) && out.color[c] >= 0 && out.optical_depth[c] >= 0);
                }
            }
        }
        end_scene(&s);
    }
}

/* ---- Counts ---- */

/* Along x: a thin brick, one with nothing in it, one that rises, two that nothing is seen through. */
static VolGrid *row_of_bricks(void)
{
    static const double values[] = {0.25, 0, 0, 1, 1};
    VolGridSource source = {.box = true, .box_max = {39, 7, 7}};
    VolGridBuilder *builder;
    VolGrid *grid;
    for (int a = 0; a < 3; a++)
        source.index_to_world.m[a][a] = 1;
    if (vol_grid_begin(&source, &builder, NULL))
        abort();
    for (int32_t n = 0; n < 5; n++)
        if (vol_grid_tile(builder, (int32_t[]){8 * n, 0, 0}, 8, values[n], true, NULL))
            abort();
    if (vol_grid_finish(builder, &grid, NULL))
        abort();
    return grid;
}

static void what_a_ray_passed_counts_however_it_ends(void)
{
    RandomScene s = {.grid = row_of_bricks()};
    scene_look(&s, "{\"pellucid\": \"transfer-function/1\", \"particle_step\": 1, \"interpolate\": \"opacity\", "
                   "\"scatter\": [[0.1, 0], [0.25, 0.01], [1, 0.9999]]}",
               &(VolPreintOptions){.hi = 1, .n = 64, .step = 0.5, .octaves = 1, .change = INFINITY, .threads = 1});
    s.scene = (VolScene){.volume = vol_volume_of_grid(s.grid), .tf = &s.compiled, .skip = true, .preint = &s.tables,
                         .integrals = &s.integrals, .step = 0.5};
    for (int e = VOL_ESTIMATE_EXACT; e <= VOL_ESTIMATE_DIRECT; e++) {
        VolScratch scratch;
        VolRay ray = {{-1, 3.5, 3.5}, {1, 0, 0}, 0, INFINITY};
        VolRadiance out;
        s.scene.estimator = (VolEstimator)e;
        if (vol_scene_prepare(&s.scene, &s.prepared, NULL) || !vol_ray_clip(&s.scene, &ray) ||
            vol_scratch_new(&s.prepared, &scratch, NULL))
            abort();
        vol_trace_rays(&(VolTraceCall){.prepared = &s.prepared, .scratch = &scratch, .rays = &ray, .count = 1, .out = &out});
        CHECK(scratch.skipped.rays_ended == 1 && scratch.skipped.bricks_entered == 3);
        if (scratch.skipped.blocks != 1)
            FAIL("estimator %d: %d blocks passed over", e, (int)scratch.skipped.blocks);
        vol_scratch_free(&scratch);
        vol_prepared_free(&s.prepared);
    }
    random_scene_free(&s);
}

/* ---- Bench ---- */

static const char *const bench_tf[][2] = {
    {"particles", "\"scatter\": [[0.3, 0, [0.1, 0.1, 0.6]], [0.5, 0.05, [0.9, 0.9, 0.3]], [1, 0.2]]"},
    {"shaded surfaces", "\"scatter\": [[0.3, 0], [1, 0.1]], \"surface\": [[0.5, 0], [0.55, 0.1], [0.6, 0]]"},
    {"all terms", "\"scatter\": [[0.3, 0], [1, 0.1]], \"surface\": [[0.5, 0], [0.55, 0.1], [0.6, 0]], "
                  "\"absorb\": [[0, 0], [1, 0.1, [1, 0.5, 0.2]]], \"emit\": [[0.8, 0], [0.9, 0.2, [1, 0.3, 0]]], "
                  "\"isosurfaces\": [{\"value\": 0.4, \"opacity\": 0.3}]"}};

static double seconds_now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* Waves in a cube of 64^3 voxels. */
static void bench_grid(RandomScene *s)
{
    enum { SIDE = 64 };
    VolGridSource source = {.box = true, .box_max = {SIDE - 1, SIDE - 1, SIDE - 1}};
    VolGridBuilder *builder;
    for (int a = 0; a < 3; a++)
        source.index_to_world.m[a][a] = 1;
    if (vol_grid_begin(&source, &builder, NULL))
        abort();
    for (int b = 0; b < SIDE * SIDE * SIDE / 512; b++) {
        float values[512];
        uint64_t active[8];
        int32_t origin[3] = {b / 64 * 8, b / 8 % 8 * 8, b % 8 * 8};
        memset(active, 255, sizeof active);
        for (int n = 0; n < 512; n++)
            values[n] = (float)(0.5 + 0.17 * (sin((origin[0] + (n >> 6)) * 0.31) + sin((origin[1] + (n >> 3 & 7)) * 0.27) +
                                              sin((origin[2] + (n & 7)) * 0.23)));
        if (vol_grid_leaf(builder, origin, values, NULL, active, NULL))
            abort();
    }
    if (vol_grid_finish(builder, &s->grid, NULL))
        abort();
    s->scene.volume = vol_volume_of_grid(s->grid);
}

/* Seconds for a square of rays; best of three. */
static double bench_rays(const VolPrepared *prepared, double *cells)
{
    enum { SIDE = 96, ROWS = VOL_PACKET / 4 };
    VolScratch scratch;
    double best = INFINITY;
    if (vol_scratch_new(prepared, &scratch, NULL))
        abort();
    for (int run = 0; run < 3; run++) {
        double begin = seconds_now();
        *cells = 0;
        for (int n = 0; n < SIDE * SIDE; n += VOL_PACKET) {
            VolRay rays[VOL_PACKET];
            VolRadiance out[VOL_PACKET];
            size_t count = 0;
            for (int i = 0; i < VOL_PACKET; i++) {
                int x = n / (ROWS * SIDE) * ROWS + i / 4, y = n % (ROWS * SIDE) / VOL_PACKET * 4 + i % 4;
                VolVec3 from = {90.0 * x / SIDE - 20, 90.0 * y / SIDE - 20, -200}, to = {31.5, 31.5, 31.5};
                VolVec3 d = vol_vec3(0.3 * (to.x - from.x), 0.3 * (to.y - from.y), to.z - from.z);
                rays[count] = (VolRay){from, vol_scale(d, 1 / vol_length(d)), 0, INFINITY};
                count += vol_ray_clip(prepared->scene, &rays[count]);
            }
            if (count)
                vol_trace_rays(&(VolTraceCall){.prepared = prepared, .scratch = &scratch, .rays = rays, .count = count,
                                               .out = out});
            for (size_t i = 0; i < count; i++)
                *cells += out[i].cells;
        }
        best = fmin(best, seconds_now() - begin);
    }
    vol_scratch_free(&scratch);
    return best;
}

static void bench_kernel(RandomScene *s, const char *tf_name, VolCpu best)
{
    static const char *const names[] = {"exact", "full", "integrals", "direct"};
    for (int precise = 0; precise < 2; precise++)
        for (int e = VOL_ESTIMATE_EXACT; e <= VOL_ESTIMATE_DIRECT; e++) {
            double seconds[2], cells = 0;
            s->scene.precise = precise;
            s->scene.estimator = (VolEstimator)e;
            for (int level = 0; level < 2; level++) {
                s->scene.cpu = level ? best : VOL_CPU_SCALAR;
                if (vol_scene_prepare(&s->scene, &s->prepared, NULL))
                    abort();
                seconds[level] = bench_rays(&s->prepared, &cells);
                vol_prepared_free(&s->prepared);
            }
            printf("%-16s %-10s %-6s %7.1f ns per cell or sample, scalar %7.1f: %5.1f times\n", tf_name, names[e],
                   precise ? "double" : "float", 1e9 * seconds[1] / cells, 1e9 * seconds[0] / cells,
                   seconds[0] / seconds[1]);
        }
}

static void bench(void)
{
    VolCpu best;
    if (vol_cpu_choose("auto", &best, NULL))
        abort();
    for (size_t i = 0; i < sizeof bench_tf / sizeof *bench_tf; i++) {
        char text[2000];
        RandomScene s = {.scene = {.skip = true, .light_count = 1, .step = 0.5}};
        snprintf(text, sizeof text, "{\"pellucid\": \"transfer-function/1\", %s}", bench_tf[i][1]);
        bench_grid(&s);
        scene_look(&s, text, &(VolPreintOptions){.hi = 1, .n = 256, .step = 0.5, .octaves = 1, .change = INFINITY,
                                                 .threads = 1});
        s.lights[0] = vol_light_head();
        s.scene.tf = &s.compiled;
        s.scene.lights = s.lights;
        s.scene.preint = &s.tables;
        s.scene.integrals = &s.integrals;
        bench_kernel(&s, bench_tf[i][0], best);
        random_scene_free(&s);
    }
}

int main(int argc, char **argv)
{
    if (argc == 2 && strcmp(argv[1], "--bench") == 0) {
        bench();
        return 0;
    }
    first_seed = seed_before_first(argc, argv);
    RUN(every_level_gives_the_same_bytes_in_float);
    RUN(every_level_gives_the_same_bytes_in_double);
    RUN(company_changes_nothing);
    RUN(skipping_changes_nothing);
    RUN(float_stays_near_double);
    RUN(exact_agrees_with_a_fine_march);
    RUN(early_termination_keeps_its_bound);
    RUN(parts_add_up_to_the_colour);
    RUN(what_a_ray_passed_counts_however_it_ends);
    return test_end();
}
