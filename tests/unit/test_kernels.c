/* The ray kernels against each other and against a march that shares nothing with them but the scene. */
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "base/cpu.h"
#include "tests/unit/random_scene.h"
#include "tests/unit/test.h"

enum { SCENES = 150, RAYS = 40 };

static VolRadiance traced(RandomScene *s, VolCpu cpu, VolEstimator estimator, const VolRay *ray)
{
    VolRadiance out;
    s->scene.cpu = cpu;
    s->scene.estimator = estimator;
    vol_kernel(&s->scene)(&s->scene, ray, &out);
    return out;
}

static void compare_levels(bool precise)
{
    VolCpu best;
    if (vol_cpu_choose("auto", &best, NULL))
        FAIL("no cpu level");
    for (uint64_t seed = 1; seed <= SCENES; seed++) {
        Random r = {seed};
        RandomScene s;
        random_scene(&r, 0, &s);
        s.scene.precise = precise;
        if (vol_scene_prepare(&s.scene, NULL))
            abort();
        for (int i = 0; i < RAYS; i++) {
            VolRay ray = random_ray(&r, &s);
            if (!vol_ray_clip(&s.scene, &ray))
                continue;
            for (int e = VOL_ESTIMATE_EXACT; e <= VOL_ESTIMATE_DIRECT; e++) {
                VolRadiance a = traced(&s, VOL_CPU_SCALAR, (VolEstimator)e, &ray);
                VolRadiance b = traced(&s, best, (VolEstimator)e, &ray);
                if (memcmp(&a, &b, sizeof a) != 0)
                    FAIL("seed %d ray %d estimator %d: levels differ (R %.17g, %.17g)", (int)seed, i, e, a.color[0],
                         b.color[0]);
            }
        }
        vol_scene_release(&s.scene);
        random_scene_free(&s);
    }
}

static void every_level_gives_the_same_bytes_in_float(void) { compare_levels(false); }
static void every_level_gives_the_same_bytes_in_double(void) { compare_levels(true); }

static void skipping_changes_nothing(void)
{
    for (uint64_t seed = 1; seed <= SCENES; seed++)
        for (int precise = 0; precise < 2; precise++) {
            Random r = {seed};
            RandomScene s;
            random_scene(&r, 0, &s);
            VolScene plain = s.scene;
            plain.skip = false;
            plain.precise = s.scene.precise = precise;
            if (vol_scene_prepare(&s.scene, NULL) || vol_scene_prepare(&plain, NULL))
                abort();
            for (int i = 0; i < RAYS; i++) {
                VolRay ray = random_ray(&r, &s);
                if (!vol_ray_clip(&s.scene, &ray))
                    continue;
                for (int e = VOL_ESTIMATE_EXACT; e <= VOL_ESTIMATE_DIRECT; e++) {
                    VolRadiance a, b;
                    s.scene.estimator = plain.estimator = (VolEstimator)e;
                    vol_kernel(&s.scene)(&s.scene, &ray, &a);
                    vol_kernel(&plain)(&plain, &ray, &b);
                    if (memcmp(&a, &b, sizeof a) != 0)
                        FAIL("seed %d ray %d estimator %d precise %d: %.17g with skipping, %.17g without (tau %.17g, %.17g)",
                             (int)seed, i, e, precise, a.color[0], b.color[0], a.tau[0], b.tau[0]);
                }
            }
            vol_scene_release(&s.scene);
            vol_scene_release(&plain);
            random_scene_free(&s);
        }
}

/* Values exactly at a jump of the transfer function are left out: there rounding decides the side. */
static void float_stays_near_double(void)
{
    double worst = 0, sum = 0, count = 0;
    for (uint64_t seed = 1; seed <= 4 * SCENES; seed++) {
        Random r = {seed};
        RandomScene s;
        random_scene(&r, RANDOM_NO_PLATEAUS | RANDOM_NO_DELTAS | RANDOM_UNSHADED, &s);
        VolScene precise = s.scene;
        precise.precise = true;
        if (vol_scene_prepare(&s.scene, NULL) || vol_scene_prepare(&precise, NULL))
            abort();
        for (int i = 0; i < RAYS; i++) {
            VolRay ray = random_ray(&r, &s);
            if (!vol_ray_clip(&s.scene, &ray))
                continue;
            VolRadiance a, b;
            vol_kernel(&s.scene)(&s.scene, &ray, &a);
            vol_kernel(&precise)(&precise, &ray, &b);
            for (int c = 0; c < 3; c++) {
                double error = fabs(a.color[c] - b.color[c]) / fmax(1, fabs(b.color[c]));
                worst = fmax(worst, error);
                sum += error * error;
                count++;
            }
        }
        vol_scene_release(&s.scene);
        vol_scene_release(&precise);
        random_scene_free(&s);
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

static void march(const RandomScene *s, const VolRay *ray, int steps, double color[3], double tau[3])
{
    const VolTfCompiled *tf = &s->compiled;
    double h = (ray->t1 - ray->t0) / steps, before, v;
    for (int c = 0; c < 3; c++)
        color[c] = tau[c] = 0;
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
                color[c] += exp(-tau[c] - 0.5 * dtau) * q;
                tau[c] += dtau;
            }
        }
        before = after;
        known = end;
    }
}

static void exact_agrees_with_a_fine_march(void)
{
    double worst = 0;
    for (uint64_t seed = 1; seed <= 60; seed++) {
        Random r = {seed};
        RandomScene s;
        random_scene(&r, RANDOM_NO_DELTAS | RANDOM_UNSHADED, &s);
        s.scene.precise = true;
        if (vol_scene_prepare(&s.scene, NULL))
            abort();
        for (int i = 0; i < 3; i++) {
            VolRay ray = random_ray(&r, &s);
            if (!vol_ray_clip(&s.scene, &ray))
                continue;
            VolRadiance got;
            double color[3], tau[3];
            vol_kernel(&s.scene)(&s.scene, &ray, &got);
            march(&s, &ray, 40000, color, tau);
            for (int c = 0; c < 3; c++) {
                double error = fabs(got.color[c] - color[c]) / fmax(1, color[c]);
                error = fmax(error, fabs(exp(-got.tau[s.compiled.coloured ? c : 0]) - exp(-tau[c])));
                worst = fmax(worst, error);
                if (!(error < 2e-3))
                    FAIL("seed %d ray %d channel %d: colour %.10g, march %.10g; tau %.10g, %.10g", (int)seed, i, c,
                         got.color[c], color[c], got.tau[0], tau[c]);
            }
        }
        vol_scene_release(&s.scene);
        random_scene_free(&s);
    }
    /* Jumps and spikes hold the march back to first order: single rays may be off by 1e-3. */
    printf("# largest difference from the march: %.3g\n", worst);
}

static void early_termination_keeps_its_bound(void)
{
    double worst = 0;
    for (uint64_t seed = 1; seed <= SCENES; seed++) {
        Random r = {seed};
        RandomScene s;
        random_scene(&r, 0, &s);
        s.scene.precise = true;
        if (vol_scene_prepare(&s.scene, NULL))
            abort();
        for (int i = 0; i < RAYS; i++) {
            VolRay ray = random_ray(&r, &s);
            if (!vol_ray_clip(&s.scene, &ray))
                continue;
            VolRadiance all, cut;
            s.scene.stop_opacity = 0x1p-200;
            vol_kernel(&s.scene)(&s.scene, &ray, &all);
            s.scene.stop_opacity = 0x1p-10;
            vol_kernel(&s.scene)(&s.scene, &ray, &cut);
            for (int c = 0; c < 3; c++) {
                double error = fabs(all.color[c] - cut.color[c]);
                error = fmax(error, fabs(exp(-all.tau[c]) - exp(-cut.tau[c])));
                worst = fmax(worst, error);
            }
        }
        vol_scene_release(&s.scene);
        random_scene_free(&s);
    }
    printf("# stop at 2^-10: largest change %.3g of %.3g allowed\n", worst, 0x1p-10);
    CHECK(worst <= 0x1p-10);
    CHECK(worst > 0); /* the test would notice nothing if no ray were cut */
}

static void parts_add_up_to_the_colour(void)
{
    for (uint64_t seed = 1; seed <= SCENES; seed++) {
        Random r = {seed};
        RandomScene s;
        random_scene(&r, 0, &s);
        if (vol_scene_prepare(&s.scene, NULL))
            abort();
        for (int i = 0; i < RAYS; i++) {
            VolRay ray = random_ray(&r, &s);
            VolRadiance out;
            if (!vol_ray_clip(&s.scene, &ray))
                continue;
            for (int e = VOL_ESTIMATE_EXACT; e <= VOL_ESTIMATE_DIRECT; e++) {
                out = traced(&s, VOL_CPU_SCALAR, (VolEstimator)e, &ray);
                for (int c = 0; c < 3; c++) {
                    CHECK_NEAR(out.surface[c] + out.scatter[c] + out.emit[c], out.color[c], 1e-6, 1e-7);
                    CHECK(isfinite(out.color[c]) && out.color[c] >= 0 && out.tau[c] >= 0);
                }
            }
        }
        vol_scene_release(&s.scene);
        random_scene_free(&s);
    }
}

int main(void)
{
    RUN(every_level_gives_the_same_bytes_in_float);
    RUN(every_level_gives_the_same_bytes_in_double);
    RUN(skipping_changes_nothing);
    RUN(float_stays_near_double);
    RUN(exact_agrees_with_a_fine_march);
    RUN(early_termination_keeps_its_bound);
    RUN(parts_add_up_to_the_colour);
    return test_end();
}
