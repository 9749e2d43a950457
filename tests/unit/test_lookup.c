/* Segments looked up side by side, as the ray kernels do in float, against the look-ups in double, one by one. */
#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define RANDOM_SCENE_NODES 193 /* bins narrow enough that few are dense */

#include "trace/lookup_tmpl.h"
#include "tests/unit/random_scene.h"
#include "tests/unit/test.h"

enum { SCENES = 300, BATCHES = 60 };
#define TABLES_TOLERANCE 2e-7
#define INTEGRALS_TOLERANCE 3e-7 /* more roundings one after the other */
#define PIECES_TOLERANCE 2.1e-7  /* spans after spans */

/* The least float at or above a number. */
static float at_or_above(double v)
{
    float f = (float)v;
    return (double)f < v ? nextafterf(f, INFINITY) : f;
}

/* A value anywhere, at a knot, or just below it. */
static float random_end(Random *r, const VolTfCompiled *tf)
{
    if (tf->knot_count == 0 || random_below(r, 2))
        return (float)random_in(r, -0.4, 2);
    float knot = at_or_above(tf->knots[random_below(r, (int)tf->knot_count)]);
    return random_below(r, 2) ? knot : nextafterf(knot, -INFINITY);
}

/* Rising, falling, equal; far, near, all but equal. */
static void random_ends(Random *r, const VolTfCompiled *tf, float *v0, float *v1)
{
    static const double reach[] = {0.2, 0.02, 1e-3, 1e-5};
    *v0 = random_end(r, tf);
    int kind = random_below(r, 7);
    if (kind == 0)
        *v1 = *v0;
    else if (kind == 1)
        *v1 = random_end(r, tf);
    else if (kind == 2)
        *v1 = nextafterf(*v0, random_below(r, 2) ? INFINITY : -INFINITY);
    else
        *v1 = (float)((double)*v0 + random_in(r, -1, 1) * reach[kind - 3]);
}

/* Whether v is so near to a node beside a dense bin that rounding may choose the bin. */
static bool at_dense_bin(const VolPreint *tables, float v)
{
    for (size_t i = 0; i + 1 < tables->n; i++)
        if (tables->dense[i] && (fabs((double)v - vol_preint_node(tables, i)) < 1e-6 ||
                                 fabs((double)v - vol_preint_node(tables, i + 1)) < 1e-6))
            return true;
    return false;
}

typedef struct Batch {
    LookupEnd a, b;
    float v0[LANES], v1[LANES];
} Batch;

static void random_batch(Random *r, const VolPrepared *prepared, bool table, unsigned features, Batch *out)
{
    reals v0, v1;
    for (int i = 0; i < LANES; i++) {
        random_ends(r, prepared->scene->tf, &out->v0[i], &out->v1[i]);
        v0[i] = out->v0[i];
        v1[i] = out->v1[i];
    }
    memset(&out->a, 0, sizeof out->a);
    memset(&out->b, 0, sizeof out->b);
    find_end(PREPARED_TABLES(prepared), v0, table, features, &out->a);
    find_end(PREPARED_TABLES(prepared), v1, table, features, &out->b);
}

typedef struct Worst {
    double error, sum, count;
} Worst;

/* Optical depths by what passes. */
static void compare_depths(Worst *w, float got, double expected)
{
    w->error = fmax(w->error, fabs(exp(-(double)got) - exp(-expected)));
}

static void compare(Worst *w, float got, double expected)
{
    double error = fabs((double)got - expected) / fmax(1, fabs(expected));
    w->error = fmax(w->error, error);
    w->sum += error * error;
    w->count++;
}

/* What was looked up for one lane against what was expected, `here`. */
static void judge(Worst *all, const Worst *here, double tolerance, uint64_t seed, const Batch *ends,
                  const SegmentParts *parts, int i)
{
    if (!(here->error < tolerance))
        FAIL("seed %d: %.9g to %.9g: off by %.3g (got particles' opacity %.9g, depth %.9g)", (int)seed,
             (double)ends->v0[i], (double)ends->v1[i], here->error, (double)parts->particles_a[i],
             (double)parts->optical_depth[0][i]);
    all->error = fmax(all->error, here->error);
    all->sum += here->sum;
    all->count += here->count;
}

static void print_worst(const char *what, const Worst *worst)
{
    printf("# %s: rms %.3g, largest %.3g\n", what, sqrt(worst->sum / worst->count), worst->error);
}

/* Calls `check` with batches of segments in random scenes; with tables, or without. */
static void for_batches(bool tables, void (*check)(uint64_t seed, RandomScene *s, const Batch *ends, unsigned features))
{
    for (uint64_t seed = 1; seed <= SCENES; seed++) {
        Random r = {seed};
        RandomScene s;
        random_scene(&r, RANDOM_NO_DELTAS, &s);
        if (!tables)
            s.scene.preint = NULL;
        if (vol_scene_prepare(&s.scene, &s.prepared, NULL))
            abort();
        const TfTables *o = PREPARED_TABLES(&s.prepared);
        unsigned features = o->features & (FEATURE_SURFACE | FEATURE_COLOURED | FEATURE_EMIT);
        for (int n = 0; n < BATCHES; n++) {
            Batch ends;
            random_batch(&r, &s.prepared, o->lookup.entries != NULL, features, &ends);
            check(seed, &s, &ends, features);
        }
        end_scene(&s);
    }
}

/* ---- Tables ---- */

static Worst tables_worst;
static double tables_covered, tables_all;

static void compare_with_tables(uint64_t seed, RandomScene *s, const Batch *ends, unsigned features)
{
    const TfTables *o = PREPARED_TABLES(&s->prepared);
    SegmentParts parts;
    Doubles length;
    ints known = {0};
    memset(&length, 0, sizeof length);
    memset(&parts, 0, sizeof parts);
    if (o->lookup.entries) {
        known = look_up_table(o, &ends->a, &ends->b, ints_all(-1), features, (real)s->scene.step, &parts);
        tables_covered += __builtin_popcount(mask_bits(known));
    }
    tables_all += LANES;
    look_up_full(&s->prepared, &ends->a, &ends->b, &length, ints_all(-1), ints_all(-1), features, &parts);
    for (int i = 0; i < LANES; i++) {
        VolPreintSegment p;
        Worst here = {0};
        if (at_dense_bin(&s->tables, ends->v0[i]) || at_dense_bin(&s->tables, ends->v1[i]))
            continue;
        if (features & FEATURE_COLOURED)
            vol_preint_segment(s->scene.tf, (double)ends->v0[i], (double)ends->v1[i], s->scene.step, &p);
        else
            vol_preint_full_at(&s->tables, (double)ends->v0[i], (double)ends->v1[i], s->scene.step, &p);
        compare_depths(&here, parts.optical_depth[0][i], p.depth[0]);
        compare(&here, parts.particles_a[i], p.p_a[0]);
        for (int c = 0; c < 3; c++) {
            compare(&here, parts.particles_c[c][i], p.p_c[c]);
            if (features & FEATURE_SURFACE) {
                compare(&here, parts.front_c[c][i], p.fw_c[c]);
                compare(&here, parts.front_a[c][i], p.fw_a[c]);
                compare(&here, parts.back_c[c][i], p.bw_c[c]);
                compare(&here, parts.back_a[c][i], p.bw_a[c]);
            }
        }
        judge(&tables_worst, &here, known[i] ? TABLES_TOLERANCE : PIECES_TOLERANCE, seed, ends, &parts, i);
    }
}

static void tables_agree(void)
{
    for_batches(true, compare_with_tables);
    print_worst("tables", &tables_worst);
    printf("# %.0f%% side by side\n", 100 * tables_covered / tables_all);
    CHECK(tables_covered > 0.3 * tables_all);
}

/* ---- Integrals ---- */

static Worst integrals_worst;
static Random lengths;

/* Where the surface stands between the ends. */
static void compare_places(uint64_t seed, const Batch *ends, const SegmentParts *parts, const VolPreintApproximation *p,
                           int i)
{
    double v0 = (double)ends->v0[i], v1 = (double)ends->v1[i], where = (p->v_c - v0) / (v1 - v0);
    if (p->surface_a[0] > 1e-3 && fabs(v1 - v0) > 1e-2 && !(fabs((double)parts->where[i] - where) < 1e-4))
        FAIL("seed %d: %.9g to %.9g: the surface stands at %.9g, not %.9g", (int)seed, v0, v1, (double)parts->where[i],
             where);
}

static void compare_with_integrals(uint64_t seed, RandomScene *s, const Batch *ends, unsigned features)
{
    SegmentParts parts;
    reals length;
    memset(&parts, 0, sizeof parts);
    for (int i = 0; i < LANES; i++)
        length[i] = (real)random_in(&lengths, 0, 0.4);
    look_up_integrals(&s->prepared, &ends->a, &ends->b, length, ints_all(-1), features, &parts);
    for (int i = 0; i < LANES; i++) {
        VolPreintApproximation p;
        Worst here = {0};
        vol_preint_integrals_at(&s->integrals, (double)ends->v0[i], (double)ends->v1[i], (double)length[i], &p);
        for (int c = 0; c < 3; c++) {
            compare_depths(&here, parts.optical_depth[features & FEATURE_COLOURED ? c : 0][i], p.depth[c]);
            compare(&here, parts.particles_c[c][i], p.particle_c[c]);
            if (features & FEATURE_SURFACE) {
                compare(&here, parts.front_c[c][i], p.surface_c[c]);
                compare(&here, parts.front_a[c][i], p.surface_a[c]);
            }
        }
        compare(&here, parts.particles_a[i], p.particle_a[0]);
        compare_places(seed, ends, &parts, &p, i);
        judge(&integrals_worst, &here, INTEGRALS_TOLERANCE, seed, ends, &parts, i);
    }
}

static void integrals_agree(void)
{
    for_batches(false, compare_with_integrals);
    print_worst("integrals", &integrals_worst);
}

int main(void)
{
    RUN(tables_agree);
    RUN(integrals_agree);
    return test_end();
}
