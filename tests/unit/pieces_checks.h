/* trace/pieces_tmpl.h against vol_preint_segment, in the precision that the including file chose. */
#ifndef TESTS_UNIT_PIECES_CHECKS_H
#define TESTS_UNIT_PIECES_CHECKS_H

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "tests/unit/random_scene.h"
#include "tests/unit/test.h"
#include "trace/pieces_tmpl.h"

enum { SCENES = 300, BATCHES = 60 };
#define IN_FLOAT (sizeof(real) == sizeof(float))
#define PIECES_TOLERANCE (IN_FLOAT ? 3e-7 : 3e-14)

static real next_to(real v, bool above)
{
    double to = above ? INFINITY : -INFINITY;
    return IN_FLOAT ? (real)nextafterf((float)v, (float)to) : (real)nextafter((double)v, to);
}

/* A value anywhere, at a knot, or just below it. */
static real random_end(Random *r, const VolTfCompiled *tf)
{
    if (tf->knot_count == 0 || random_below(r, 2))
        return (real)random_in(r, -0.4, 2);
    real knot = real_at_or_above(tf->knots[random_below(r, (int)tf->knot_count)]);
    return random_below(r, 2) ? knot : next_to(knot, false);
}

/* Rising, falling, equal; far, near, all but equal. */
static real random_other_end(Random *r, const VolTfCompiled *tf, real v)
{
    static const double reach[] = {0.2, 0.02, 1e-3, 1e-5};
    int kind = random_below(r, 7);
    if (kind == 0)
        return v;
    if (kind == 1)
        return random_end(r, tf);
    if (kind == 2)
        return next_to(v, random_below(r, 2) != 0);
    return (real)((double)v + random_in(r, -1, 1) * reach[kind - 3]);
}

/* Surfaces and particles so many times as dense. */
static void make_denser(VolTfCompiled *tf, double surface, double particles)
{
    for (size_t j = 0; j <= tf->knot_count; j++) {
        VolTfInterval *in = &tf->intervals[j];
        VolLinear *of_particles[] = {&in->scatter, &in->absorb[0], &in->absorb[1], &in->absorb[2]};
        in->surface = (VolLinear){in->surface.a * surface, in->surface.b * surface};
        for (int n = 0; n < 4; n++)
            *of_particles[n] = (VolLinear){of_particles[n]->a * particles, of_particles[n]->b * particles};
    }
}

static double error_of(real got, double expected) { return fabs((double)got - expected) / fmax(1, fabs(expected)); }

static double error_of_parts(const SegmentParts *parts, const VolPreintSegment *p, unsigned features, int i)
{
    double worst = error_of(parts->particles_a[i], p->p_a[0]);
    for (int c = 0; c < 3; c++) {
        worst = fmax(worst, fabs(exp(-(double)parts->optical_depth[c][i]) - exp(-p->depth[c])));
        worst = fmax(worst, error_of(parts->particles_c[c][i], p->p_c[c]));
        if (!(features & FEATURE_SURFACE))
            continue;
        worst = fmax(worst, fmax(error_of(parts->front_c[c][i], p->fw_c[c]), error_of(parts->front_a[c][i], p->fw_a[c])));
        worst = fmax(worst, fmax(error_of(parts->back_c[c][i], p->bw_c[c]), error_of(parts->back_a[c][i], p->bw_a[c])));
    }
    return worst;
}

typedef struct Segment {
    real v0, v1, length;
} Segment;

static double compare_lane(uint64_t seed, const RandomScene *s, Segment at, const SegmentParts *parts, unsigned features,
                           int i)
{
    VolPreintSegment p;
    vol_preint_segment(&s->compiled, (double)at.v0, (double)at.v1, (double)at.length, &p);
    double error = error_of_parts(parts, &p, features, i);
    if (!(error < PIECES_TOLERANCE))
        FAIL("seed %d: %.17g to %.17g, %.17g long: off by %.3g (depth %.9g, expected %.9g)", (int)seed, (double)at.v0,
             (double)at.v1, (double)at.length, error, (double)parts->optical_depth[0][i], p.depth[0]);
    return error;
}

/* Lanes that are not asked for may hold anything, and keep what they have. */
static double compare_batch(uint64_t seed, Random *r, RandomScene *s)
{
    const TfTables *o = PREPARED_TABLES(&s->prepared);
    unsigned features = o->features & (FEATURE_SURFACE | FEATURE_COLOURED | FEATURE_EMIT);
    Segment at[LANES];
    LookupEnd a, b;
    SegmentParts parts;
    reals v[2], length;
    for (int i = 0; i < LANES; i++) {
        at[i].v0 = random_end(r, &s->compiled);
        at[i].v1 = random_other_end(r, &s->compiled, at[i].v0);
        at[i].length = (real)(random_in(r, 0, 1) * pow(10, random_in(r, -3, IN_FLOAT ? 0 : 1)));
        v[0][i] = at[i].v0, v[1][i] = at[i].v1, length[i] = at[i].length;
    }
    ints mask = mask_of((unsigned)random_below(r, 1 << LANES));
    memset(&parts, 0x7f, sizeof parts);
    SegmentParts before = parts;
    find_end(o, reals_select(mask, v[0], reals_all(NAN)), false, features, &a);
    find_end(o, reals_select(mask, v[1], reals_all(INFINITY)), false, features, &b);
    look_up_pieces(o, &a, &b, length, mask, features, &parts);
    double worst = 0;
    for (int i = 0; i < LANES; i++)
        if (mask[i])
            worst = fmax(worst, compare_lane(seed, s, at[i], &parts, features, i));
        else
            CHECK(memcmp((real *)&parts.particles_c[1] + i, (real *)&before.particles_c[1] + i, sizeof(real)) == 0);
    return worst;
}

static void pieces_are_what_the_definition_says(void)
{
    double worst = 0;
    for (uint64_t seed = 1; seed <= SCENES; seed++) {
        Random r = {seed};
        RandomScene s;
        random_scene(&r, RANDOM_NO_DELTAS, &s);
        /* Where extinction falls from enormous to 0, rounding of the value alone makes more than the tolerance. */
        double surface = pow(10, random_in(&r, 0, IN_FLOAT ? 1 : 4));
        double particles = pow(10, random_in(&r, -2, IN_FLOAT ? 0 : 2));
        if (seed % 3)
            make_denser(&s.compiled, surface, particles);
        s.scene.preint = NULL;
        if (vol_scene_prepare(&s.scene, &s.prepared, NULL))
            abort();
        for (int n = 0; n < BATCHES; n++)
            worst = fmax(worst, compare_batch(seed, &r, &s));
        end_scene(&s);
    }
    printf("# off by %.3g at most\n", worst);
}

/* Numbers far beyond those that squares of floats hold: nothing but opaque. */
static void enormous_amounts_are_opaque(void)
{
    for (int kind = 0; kind < 3; kind++) {
        Random r = {1};
        RandomScene s;
        memset(&s, 0, sizeof s);
        s.grid = random_grid(&r, 0, &s);
        scene_look(&s, "{\"pellucid\": \"transfer-function/1\", \"scatter\": [[0, 0.5, [1, 0.5, 0]], [1, 0.5, [1, 0.5, 0]]],"
                       " \"surface\": [[0, 0.5, [0, 0.5, 1]], [1, 0.9, [0, 0.5, 1]]]}",
                   &(VolPreintOptions){.n = 5, .step = 1});
        s.scene = (VolScene){.volume = vol_volume_of_grid(s.grid), .tf = &s.compiled, .integrals = &s.integrals};
        make_denser(&s.compiled, kind == 0 ? 1 : 1e18, kind == 1 ? 1 : 1e18);
        if (vol_scene_prepare(&s.scene, &s.prepared, NULL))
            abort();
        const TfTables *o = PREPARED_TABLES(&s.prepared);
        LookupEnd a, b;
        SegmentParts parts;
        find_end(o, reals_all(-1), false, o->features, &a);
        find_end(o, reals_all((real)1e6), false, o->features, &b);
        look_up_pieces(o, &a, &b, reals_all((real)1e10), ints_all(-1), o->features, &parts);
        double alpha = (double)(parts.front_a[0][0] + parts.back_a[0][0] + parts.particles_a[0]);
        CHECK(parts.optical_depth[0][0] > 1e3f && isfinite(parts.optical_depth[0][0]));
        CHECK_NEAR(alpha, 1, 1e-6, 0);
        CHECK_NEAR((double)(parts.front_c[1][0] + parts.back_c[1][0] + parts.particles_c[1][0]), 0.5, 1e-6, 0);
        end_scene(&s);
    }
}

int main(void)
{
    RUN(pieces_are_what_the_definition_says);
    RUN(enormous_amounts_are_opaque);
    return test_end();
}

#endif
