/* The direct estimator: against a march of its own definition, by voxel look-ups one sample after the other; and against
 * itself, with rays in other company, on other cpu levels, without leaving anything out. */
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "base/cpu.h"
#include "tests/unit/random_scene.h"
#include "tests/unit/test.h"

enum { SCENES = 300, RAYS = 8 };

/* From many samples in a cell to bricks with none. */
static const double step_lengths[] = {0.03, 0.2, 0.9, 5};

static bool direct_scene(uint64_t seed, int flags, Random *r, RandomScene *s)
{
    *r = (Random){seed * 7919};
    random_scene(r, flags, s);
    s->scene.estimator = VOL_ESTIMATE_DIRECT;
    s->scene.step = step_lengths[seed % 4];
    s->scene.layers = seed / 4 % 2 ? 1u << VOL_LAYER_Z | 1u << VOL_LAYER_NORMAL : 0;
    s->scene.precise = seed / 8 % 2;
    s->scene.cpu = VOL_CPU_SCALAR;
    return vol_scene_prepare(&s->scene, &s->prepared, NULL) == VOL_OK;
}

static void company_levels_and_skipping_change_nothing(void)
{
    size_t marched = 0;
    for (uint64_t seed = 1; seed <= SCENES; seed++) {
        Random r;
        RandomScene s;
        VolRay rays[RAYS];
        VolRadiance all[RAYS], other[RAYS];
        if (!direct_scene(seed, 0, &r, &s))
            abort();
        size_t count = random_packet(&r, &s, RAYS, rays);
        trace_rays(&s.prepared, rays, count, all);
        for (size_t i = 0; i < count; i++) {
            trace_rays(&s.prepared, &rays[i], 1, &other[i]);
            if (memcmp(&other[i], &all[i], sizeof *all) != 0)
                FAIL("seed %d ray %d: R %.17g in company, %.17g alone", (int)seed, (int)i, all[i].color[0],
                     other[i].color[0]);
            marched += all[i].cells > 0;
        }
        VolScene best = s.scene, plain = s.scene;
        VolPrepared prepared_best = s.prepared, prepared_plain;
        prepared_best.scene = &best;
        if (vol_cpu_choose("auto", &best.cpu, NULL))
            abort();
        trace_rays(&prepared_best, rays, count, other);
        if (memcmp(all, other, count * sizeof *all) != 0)
            FAIL("seed %d: cpu levels differ", (int)seed);
        plain.skip = false;
        if (vol_scene_prepare(&plain, &prepared_plain, NULL))
            abort();
        trace_rays(&prepared_plain, rays, count, other);
        for (size_t i = 0; i < count; i++)
            if (memcmp(&other[i], &all[i], sizeof *all) != 0)
                FAIL("seed %d ray %d: R %.17g tau %.17g with skipping, %.17g %.17g without", (int)seed, (int)i,
                     all[i].color[0], all[i].optical_depth[0], other[i].color[0], other[i].optical_depth[0]);
        vol_prepared_free(&prepared_plain);
        end_scene(&s);
    }
    CHECK(marched > SCENES); /* most rays met something */
}

/* ---- Rays that go together ---- */

enum { NEIGHBOURS = 16 };

/* Rays within a voxel or two of another, all in its direction or nearly, that meet the domain. */
static size_t rays_near(Random *r, const RandomScene *s, const VolRay *first, VolRay rays[NEIGHBOURS])
{
    bool parallel = random_below(r, 3) == 0;
    size_t count = 0;
    for (int tries = 0; tries < 2 * NEIGHBOURS && count < NEIGHBOURS; tries++) {
        VolVec3 aside = vol_vec3(random_in(r, -1, 1), random_in(r, -1, 1), random_in(r, -1, 1));
        VolVec3 turn = vol_vec3(random_in(r, -1, 1), random_in(r, -1, 1), random_in(r, -1, 1));
        VolVec3 direction = vol_along(first->direction, parallel ? 0 : 0.02, turn);
        rays[count] = (VolRay){vol_along(first->origin, s->grid->voxel, aside),
                               vol_scale(direction, 1 / vol_length(direction)), 0, INFINITY};
        count += vol_ray_clip(&s->scene, &rays[count]);
    }
    return count;
}

/* How many look the same alone, and in turns with rays from anywhere, so that no packet's are near one another. */
static size_t same_in_other_company(Random *r, const RandomScene *s, const VolRay *rays, size_t count,
                                    const VolRadiance *expected)
{
    VolRay mixed[2 * NEIGHBOURS];
    VolRadiance out[2 * NEIGHBOURS], alone;
    size_t n = 0, same = 0;
    for (size_t i = 0; i < count; i++) {
        mixed[n++] = rays[i];
        mixed[n] = rays[i];
        random_packet(r, s, 1, &mixed[n++]);
    }
    trace_rays(&s->prepared, mixed, n, out);
    for (size_t i = 0; i < count; i++) {
        trace_rays(&s->prepared, &rays[i], 1, &alone);
        same += memcmp(&out[2 * i], &expected[i], sizeof alone) == 0 && memcmp(&alone, &expected[i], sizeof alone) == 0;
    }
    return same;
}

static void neighbours_go_together_with_the_same_results(void)
{
    size_t marched = 0;
    for (uint64_t seed = 1; seed <= SCENES; seed++) {
        Random r;
        RandomScene s;
        VolRay rays[NEIGHBOURS];
        VolRadiance scalar[NEIGHBOURS], best[NEIGHBOURS];
        if (!direct_scene(seed, RANDOM_UNSHADED | RANDOM_NO_DELTAS, &r, &s))
            abort();
        VolRay first = random_ray(&r, &s);
        size_t count = rays_near(&r, &s, &first, rays);
        trace_rays(&s.prepared, rays, count, scalar);
        if (same_in_other_company(&r, &s, rays, count, scalar) != count)
            FAIL("seed %d: rays together and on their own differ", (int)seed);
        if (vol_cpu_choose("auto", &s.scene.cpu, NULL))
            abort();
        trace_rays(&s.prepared, rays, count, best);
        if (memcmp(scalar, best, count * sizeof *best) != 0)
            FAIL("seed %d: cpu levels differ", (int)seed);
        if (same_in_other_company(&r, &s, rays, count, best) != count)
            FAIL("seed %d: rays together and on their own differ at the best cpu level", (int)seed);
        for (size_t i = 0; i < count; i++)
            marched += scalar[i].cells > 0;
        end_scene(&s);
    }
    CHECK(marched > 4 * SCENES);
}

/* ---- The definition, in double ---- */

typedef struct Known {
    double t, v;
    bool valid;
} Known;

static Known known_at(const VolGrid *grid, const VolRay *ray, double t)
{
    VolVec3 x = vol_apply(&grid->world_to_index, vol_along(ray->origin, t, ray->direction));
    double p[3] = {x.x, x.y, x.z}, sum = 0, finite = 0;
    int32_t cell[3];
    for (int a = 0; a < 3; a++) {
        p[a] = fmin(fmax(p[a], grid->domain_min[a]), grid->domain_max[a]);
        cell[a] = (int32_t)fmin(fmax(floor(p[a]), grid->cell_min[a]), grid->cell_max[a]);
        p[a] -= cell[a];
    }
    for (int n = 0; n < 8; n++) {
        double w = (n >> 2 ? p[0] : 1 - p[0]) * (n >> 1 & 1 ? p[1] : 1 - p[1]) * (n & 1 ? p[2] : 1 - p[2]);
        double v = vol_grid_voxel(grid, cell[0] + (n >> 2), cell[1] + (n >> 1 & 1), cell[2] + (n & 1));
        sum += w * v;
        finite += v * 0;
    }
    return (Known){t, sum, finite == 0};
}

typedef struct Reference {
    const RandomScene *s;
    double h, color[3], optical_depth[3];
    double extinction[3], source[3]; /* of the step, per world unit */
    double cursor;
} Reference;

static double line(VolLinear l, double x) { return l.a + l.b * x; }

static void classify_reference(Reference *m, Known a, Known here, Known b)
{
    const VolTfCompiled *tf = &m->s->compiled;
    memset(m->extinction, 0, sizeof m->extinction);
    memset(m->source, 0, sizeof m->source);
    if (!here.valid)
        return;
    const VolTfInterval *in = &tf->intervals[vol_tf_interval(tf, here.v)];
    double x = here.v - in->v_ref;
    a = a.valid ? a : here;
    b = b.valid ? b : here;
    double surface = b.t > a.t ? fabs(b.v - a.v) / (b.t - a.t) * line(in->surface, x) : 0;
    for (int c = 0; c < 3; c++) {
        double scatter = line(in->scatter, x);
        m->extinction[c] = scatter + line(in->absorb[c], x) + surface;
        m->source[c] = scatter * line(in->scatter_color[c], x) + line(in->emit[c], x) +
                       surface * line(in->surface_color[c], x);
    }
}

static void advance_reference(Reference *m, double t)
{
    double dl = t - m->cursor;
    if (!(dl > 0))
        return;
    for (int c = 0; c < 3; c++) {
        double x = m->extinction[c] * dl;
        m->color[c] += exp(-m->optical_depth[c]) * m->source[c] * dl * (x > 0 ? -expm1(-x) / x : 1);
        m->optical_depth[c] += x;
    }
    m->cursor = t;
}

static double delta_value(const Reference *m, size_t k)
{
    double value = m->s->compiled.isosurfaces[k].value;
    return m->s->scene.precise ? value : (double)(float)value;
}

/* The isosurfaces between two samples; rising or falling, equal values in list order. */
static void cross_reference(Reference *m, Known a, Known b, double from, double to)
{
    const VolTfCompiled *tf = &m->s->compiled;
    if (!a.valid || !b.valid)
        return;
    double value = a.v;
    bool rising = b.v > a.v, first = true;
    for (;;) {
        /* The next value on the way. */
        double next = NAN;
        for (size_t k = 0; k < tf->isosurface_count; k++) {
            double d = delta_value(m, k);
            bool ahead = first || (rising ? d > value : d < value);
            if ((a.v < d) != (b.v < d) && ahead && (isnan(next) || (rising ? d < next : d > next)))
                next = d;
        }
        if (isnan(next))
            return;
        first = false;
        value = next;
        double t = a.t + (b.t - a.t) * ((value - a.v) / (b.v - a.v));
        if (t <= from || t > to)
            continue;
        advance_reference(m, t);
        for (size_t k = 0; k < tf->isosurface_count; k++) {
            if (delta_value(m, k) != value)
                continue;
            for (int c = 0; c < 3; c++) {
                m->color[c] += exp(-m->optical_depth[c]) * tf->isosurfaces[k].opacity * tf->isosurfaces[k].color[c];
                m->optical_depth[c] += tf->isosurfaces[k].optical_depth;
            }
        }
    }
}

static void reference(const RandomScene *s, const VolRay *ray, Reference *m)
{
    double h = s->scene.step, length = ray->t1 - ray->t0;
    size_t n = (size_t)fmax(1, ceil(length / h * (1 - 0x1p-40)));
    *m = (Reference){.s = s, .h = h, .cursor = ray->t0};
    Known before = known_at(s->grid, ray, ray->t0), here = {0}, after;
    for (size_t i = 0; i < n; i++) {
        double begin = ray->t0 + (double)i * h, end = i + 1 == n ? ray->t1 : ray->t0 + (double)(i + 1) * h;
        double next_end = i + 2 >= n ? ray->t1 : ray->t0 + (double)(i + 2) * h;
        if (i == 0)
            here = known_at(s->grid, ray, 0.5 * (begin + end));
        after = known_at(s->grid, ray, i + 1 == n ? ray->t1 : 0.5 * (end + next_end));
        classify_reference(m, before, here, after);
        m->cursor = begin;
        cross_reference(m, before, here, i ? begin : -INFINITY, INFINITY);
        cross_reference(m, here, after, -INFINITY, end);
        advance_reference(m, end);
        before = here;
        here = after;
    }
}

/* Values exactly at a jump of the transfer function are left out: there rounding decides the side. */
static void agrees_with_its_definition(void)
{
    double worst = 0, brightest = 0;
    for (uint64_t seed = 1; seed <= SCENES; seed++) {
        Random r;
        RandomScene s;
        VolRay rays[RAYS];
        VolRadiance got[RAYS];
        if (!direct_scene(seed, RANDOM_NO_PLATEAUS | RANDOM_UNSHADED, &r, &s))
            abort();
        size_t count = random_packet(&r, &s, RAYS, rays);
        trace_rays(&s.prepared, rays, count, got);
        for (size_t i = 0; i < count; i++) {
            Reference want;
            reference(&s, &rays[i], &want);
            for (int c = 0; c < 3; c++) {
                double error = fabs(got[i].color[c] - want.color[c]) / fmax(1, want.color[c]);
                double reached = got[i].optical_depth[s.compiled.coloured ? c : 0];
                error = fmax(error, fabs(exp(-reached) - exp(-want.optical_depth[c])));
                if (s.scene.precise)
                    worst = fmax(worst, error);
                brightest = fmax(brightest, want.color[c]);
                if (!(error < (s.scene.precise ? 1e-9 : 2e-3)))
                    FAIL("seed %d step %g ray %d channel %d: colour %.10g, not %.10g; tau %.10g, %.10g", (int)seed,
                         s.scene.step, (int)i, c, got[i].color[c], want.color[c],
                         reached, want.optical_depth[c]);
            }
        }
        end_scene(&s);
    }
    printf("# largest difference from the definition, in double: %.3g\n", worst);
    CHECK(brightest > 0.1);
}

int main(void)
{
    RUN(company_levels_and_skipping_change_nothing);
    RUN(neighbours_go_together_with_the_same_results);
    RUN(agrees_with_its_definition);
    return test_end();
}
