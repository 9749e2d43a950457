/* Transfer functions as optical properties: conversion to extinction, inserted nodes, intervals, queries.
 * Expected numbers come from the C library's functions and from brute force, not from the code under test. */
#include "test.h"
#include "tf_help.h"

#include <stdint.h>
#include <stdlib.h>
#include <time.h>

#define OPAQUE (1 - 0x1p-24)

static VolTfCompiled compiled(const char *text)
{
    VolTf tf;
    VolTfCompiled c = {0};
    VolError err = {{0}};
    VolStatus status = tf_parse(text, &tf, &err);
    if (status == VOL_OK) {
        status = vol_tf_compile(&tf, &tf_log, &c, &err);
        vol_tf_free(&tf);
    }
    if (status != VOL_OK)
        FAIL("%s: %s", text, err.text);
    return c;
}

static double at(VolLinear line, const VolTfInterval *interval, double v)
{
    return line.a + line.b * (v - interval->v_ref);
}

static double scatter_at(const VolTfCompiled *c, double v)
{
    const VolTfInterval *interval = &c->intervals[vol_tf_interval(c, v)];
    return at(interval->scatter, interval, v);
}

/* ---- Inserted nodes ---- */

/* scatter from opacity 0 at 0 to 0.9 at 1: inserted nodes and their extinction, from an independent computation. */
static const double ramp_to_09[][2] = {
    {0.0, 0.0}, {0.0625, 0.05789397841890259}, {0.125, 0.11934675763256619}, {0.1875, 0.18482468701207316},
    {0.25, 0.25489224962879004}, {0.3125, 0.33024168687057687}, {0.375, 0.4117347211217598},
    {0.4375, 0.5004628367304441}, {0.5, 0.5978370007556205}, {0.5625, 0.7057259627668054},
    {0.625, 0.8266785731844679}, {0.6875, 0.9642999510605157}, {0.71875, 1.0409331770814316},
    {0.75, 1.1239300966523995}, {0.78125, 1.2144441041932315}, {0.8125, 1.3139736995402647},
    {0.84375, 1.4245155739400885}, {0.875, 1.5488132906176657}, {0.90625, 1.690783551888053},
    {0.9375, 1.8562979903656263}, {0.96875, 2.0547489290894645}, {1.0, 2.302585092994046}};

/* The same to opacity 1. */
static const double ramp_to_1[][2] = {
    {0.0, 0.0}, {0.0625, 0.0645385171639282}, {0.125, 0.1335313841095734}, {0.1875, 0.20763935102332656},
    {0.25, 0.2876820525835662}, {0.3125, 0.3746934223483907}, {0.375, 0.47000359348294934},
    {0.4375, 0.5753640985443947}, {0.5, 0.6931471209553023}, {0.53125, 0.757685634145588},
    {0.5625, 0.8266784965499276}, {0.59375, 0.9007864582237127}, {0.625, 0.9808291536706566},
    {0.65625, 1.067840516210677}, {0.6875, 1.163150678675471}, {0.71875, 1.2685111731405376},
    {0.75, 1.3862941823059722}, {0.78125, 1.5198255408707046}, {0.8125, 1.673976175284911},
    {0.84375, 1.8562976685005963}, {0.875, 2.0794411244474094}, {0.890625, 2.2129724489523688},
    {0.90625, 2.36712303795355}, {0.921875, 2.5494444675910106}, {0.9375, 2.772587828170509},
    {0.953125, 3.0602695827311863}, {0.96875, 3.4657340550574456}, {0.9765625, 3.7534154917277256},
    {0.984375, 4.158879328274101}, {0.9921875, 4.852022694158381}, {0.99609375, 5.545162245410651},
    {0.998046875, 6.238294167529862}, {0.9990234375, 6.931410831906781}, {1.0, 16.635532333438686}};

static void check_nodes(const VolTf *tf, VolTfList list, const double (*want)[2], size_t count, double divide)
{
    VolTfExtinctionNode *nodes;
    size_t got;
    VolError err;
    CHECK(vol_tf_extinction_nodes(tf, list, &nodes, &got, &err) == VOL_OK);
    CHECK(got == count);
    for (size_t i = 0; i < got && i < count; i++) {
        CHECK(nodes[i].v == want[i][0]);
        CHECK_NEAR(nodes[i].extinction[0] * divide, want[i][1], 1e-14, 0);
        CHECK(nodes[i].extinction[1] == nodes[i].extinction[0]);
        CHECK_NEAR(nodes[i].color[0], 1 - want[i][0], 0, 0);
        CHECK_NEAR(nodes[i].color[1], 0.5 * want[i][0], 0, 0);
    }
    free(nodes);
}

static void test_inserted_nodes(void)
{
    static const char form[] = HEAD ", \"%s\": [[0, 0, [1, 0, 0.25]], [1, %s, [0, 0.5, 1]]]%s}";
    VolTf tf;
    VolError err;
    for (int k = 0; k < 2; k++) {
        const double(*want)[2] = k ? ramp_to_1 : ramp_to_09;
        size_t count = k ? sizeof ramp_to_1 / sizeof *ramp_to_1 : sizeof ramp_to_09 / sizeof *ramp_to_09;
        char text[300];
        snprintf(text, sizeof text, form, "scatter", k ? "1" : "0.9", "");
        CHECK(tf_parse(text, &tf, &err) == VOL_OK);
        check_nodes(&tf, VOL_TF_SCATTER, want, count, 1);
        tf.particle_step = 0.03125; /* insertion does not see the step */
        check_nodes(&tf, VOL_TF_SCATTER, want, count, 0.03125);
        vol_tf_free(&tf);
        snprintf(text, sizeof text, form, "surface", k ? "1" : "0.9", ", \"scalar_step\": 4, \"particle_step\": 100");
        CHECK(tf_parse(text, &tf, &err) == VOL_OK);
        check_nodes(&tf, VOL_TF_SURFACE, want, count, 4);
        vol_tf_free(&tf);
    }
}

static void test_extinction_inserts_none(void)
{
    VolTf tf;
    VolError err;
    CHECK(tf_parse(HEAD ", \"interpolate\": \"extinction\", \"scatter\": [[0, 0], [1, 1]]}", &tf, &err) == VOL_OK);
    VolTfExtinctionNode *nodes;
    size_t count;
    CHECK(vol_tf_extinction_nodes(&tf, VOL_TF_SCATTER, &nodes, &count, &err) == VOL_OK);
    CHECK(count == 2 && nodes[0].extinction[0] == 0);
    CHECK_NEAR(nodes[1].extinction[0], 24 * log(2), 1e-15, 0);
    free(nodes);
    vol_tf_free(&tf);
}

static void test_emission_inserts_none(void)
{
    VolTfCompiled c = compiled(HEAD ", \"particle_step\": 0.5, "
                               "\"emit\": [[0, 1, [1, 0, 0.5]], [1, 2, [0, 0.25, 1]]]}");
    CHECK(c.knot_count == 2 && c.has_emit && !c.has_scatter && !c.coloured);
    const VolTfInterval *interval = &c.intervals[1];
    CHECK(interval->emit[0].a == 2 && interval->emit[0].b == -2); /* strength x colour / step is what is linear */
    CHECK(interval->emit[1].a == 0 && interval->emit[1].b == 1);
    CHECK(c.max_emit == 4 && c.max_color == 0);
    vol_tf_compiled_free(&c);
}

/* ---- The criterion, against sampling ---- */

typedef struct Random {
    uint64_t state;
} Random;

static double uniform(Random *random)
{
    random->state = random->state * 6364136223846793005u + 1442695040888963407u;
    return (double)(random->state >> 11) * 0x1p-53;
}

static size_t pick(Random *random, size_t n)
{
    return (size_t)(uniform(random) * (double)n);
}

/* Often exactly 0 or 1, now and then close to them. */
static double fraction(Random *random)
{
    double x = uniform(random);
    switch (pick(random, 6)) {
    case 0: return 0;
    case 1: return 1;
    case 2: return x * x * x * x * 1e-2;
    case 3: return 1 - x * x * x * x * 1e-2;
    default: return x;
    }
}

/* With jumps; every few nodes colours are grey. */
static VolTfNodes random_nodes(Random *random, size_t most, bool white)
{
    VolTfNodes list = {malloc((most + 1) * sizeof(VolTfNode)), pick(random, most + 1)};
    double v = -2 + uniform(random);
    for (size_t i = 0; i < list.count; i++) {
        bool jump = i >= 1 && (i < 2 || list.nodes[i - 2].v < v) && pick(random, 4) == 0;
        if (!jump)
            v += pick(random, 2) ? 0.25 * (double)(1 + pick(random, 4)) : 1e-3 + uniform(random);
        list.nodes[i] = (VolTfNode){v, fraction(random), {fraction(random), fraction(random), fraction(random)}};
        if (white)
            list.nodes[i].color[0] = list.nodes[i].color[1] = list.nodes[i].color[2] = fraction(random);
    }
    return list;
}

static double clamped(double opacity)
{
    return fmin(opacity, OPAQUE);
}

/* A channel's opacity at a node as the user wrote it. */
static double opacity_of(VolTfList list, const VolTfNode *node, int c)
{
    return list == VOL_TF_ABSORB      ? clamped(node->amount * (1 - node->color[c]))
           : list == VOL_TF_TRANSPORT ? 1 - fmax(node->color[c], 0x1p-24)
                                      : clamped(node->amount);
}

static double depth_of(VolTfList list, const VolTfNode *node, int c)
{
    return list == VOL_TF_TRANSPORT ? -log(fmax(node->color[c], 0x1p-24)) : -log1p(-opacity_of(list, node, c));
}

/* Largest difference between the opacity of linear extinction and linear opacity, by sampling. */
static double sampled_difference(double a0, double a1)
{
    enum { N = 4000 };
    double x0 = -log1p(-a0), x1 = -log1p(-a1), most = 0;
    for (int i = 0; i <= N; i++) {
        double u = (double)i / N;
        most = fmax(most, fabs(-expm1(-(x0 + (x1 - x0) * u)) - (a0 + (a1 - a0) * u)));
    }
    return most;
}

static double sampled_interval(VolTfList list, const VolTfNode *a, const VolTfNode *b)
{
    double most = 0;
    for (int c = 0; c < 3; c++)
        most = fmax(most, sampled_difference(opacity_of(list, a, c), opacity_of(list, b, c)));
    return most;
}

/* What the compiled list must contain from node a (left out) to node b, by the definition with sampled
 * differences. Sampling sees at most the true maximum, and misses it by less than 1e-6 of it: leave differences
 * within that alone. */
static void check_interval(VolTfList list, VolTfNode a, VolTfNode b, double step, const VolTfExtinctionNode *got,
                           size_t count, size_t *next)
{
    double difference = a.v < b.v ? sampled_interval(list, &a, &b) : 0;
    if (fabs(difference - 1e-3) < 1e-8)
        return;
    if (difference > 1e-3) {
        VolTfNode m = {(a.v + b.v) / 2, (a.amount + b.amount) / 2, {0}};
        for (int c = 0; c < 3; c++)
            m.color[c] = (a.color[c] + b.color[c]) / 2;
        check_interval(list, a, m, step, got, count, next);
        check_interval(list, m, b, step, got, count, next);
        return;
    }
    if (*next >= count) {
        FAIL("node at %g is missing", b.v);
        return;
    }
    const VolTfExtinctionNode *node = &got[(*next)++];
    CHECK(node->v == b.v);
    for (int c = 0; c < 3; c++) {
        CHECK_NEAR(node->extinction[c], depth_of(list, &b, c) / step, 1e-12, 1e-15);
        CHECK_NEAR(node->color[c], b.color[c], 1e-15, 0);
    }
}

static void check_list(VolTfList list, const VolTfNodes *nodes, const VolTf *tf, double step)
{
    VolTfExtinctionNode *got;
    size_t count, next = 0;
    VolError err;
    CHECK(vol_tf_extinction_nodes(tf, list, &got, &count, &err) == VOL_OK);
    VolTfNode last = {0};
    for (size_t i = 0; i < nodes->count; i++) {
        VolTfNode node = nodes->nodes[i];
        if (list == VOL_TF_SCATTER || list == VOL_TF_SURFACE)
            node.amount = clamped(node.amount);
        check_interval(list, i ? last : node, node, step, got, count, &next);
        last = node;
    }
    CHECK(next == count);
    free(got);
}

/* Every interval that is left meets the criterion, and every one that was halved had violated it. */
static void test_criterion_by_sampling(void)
{
    Random random = {20240607};
    printf("# seed %llu\n", (unsigned long long)random.state);
    for (int round = 0; round < 60; round++) {
        VolTf tf = {.interpolate = VOL_INTERPOLATE_OPACITY, .particle_step = 0.25 + uniform(&random),
                    .scalar_step = 0.25 + uniform(&random)};
        tf.scatter = random_nodes(&random, 6, false);
        tf.surface = random_nodes(&random, 6, false);
        tf.absorb = random_nodes(&random, 6, pick(&random, 3) == 0);
        tf.transport = random_nodes(&random, 6, false);
        check_list(VOL_TF_SCATTER, &tf.scatter, &tf, tf.particle_step);
        check_list(VOL_TF_SURFACE, &tf.surface, &tf, tf.scalar_step);
        check_list(VOL_TF_ABSORB, &tf.absorb, &tf, tf.particle_step);
        check_list(VOL_TF_TRANSPORT, &tf.transport, &tf, tf.particle_step);
        vol_tf_free(&tf);
    }
}

/* ---- Meanings ---- */

static void test_constant(void)
{
    VolTfCompiled c = compiled(HEAD ", \"particle_step\": 0.5, \"scatter\": [[7, 0.3, [0.8, 0.4, 0.2]]]}");
    CHECK(c.knot_count == 1 && c.node_min == 7 && c.node_max == 7);
    for (double v = -1e30; v < 2e30; v += 1e30) {
        const VolTfInterval *interval = &c.intervals[vol_tf_interval(&c, v)];
        CHECK_NEAR(at(interval->scatter, interval, v), -log1p(-0.3) / 0.5, 1e-15, 0);
        CHECK(at(interval->scatter_color[1], interval, v) == 0.4);
    }
    CHECK(c.max_color == 0.8 && c.has_scatter && !c.has_surface && !c.coloured);
    vol_tf_compiled_free(&c);
}

static void test_nothing(void)
{
    VolTfCompiled c = compiled(HEAD ", \"scatter\": []}");
    CHECK(c.knot_count == 0 && c.isosurface_count == 0 && vol_tf_interval(&c, 3) == 0);
    CHECK(c.intervals[0].v0 == -INFINITY && c.intervals[0].v1 == INFINITY && isfinite(c.intervals[0].v_ref));
    CHECK(c.intervals[0].surfaceness.a == 1);
    CHECK(!vol_tf_range_visible(&c, -INFINITY, INFINITY));
    CHECK(c.node_min == INFINITY && c.node_max == -INFINITY);
    vol_tf_compiled_free(&c);
}

static void test_ends_and_jump(void)
{
    VolTfCompiled c = compiled(HEAD ", \"interpolate\": \"extinction\", \"scatter\": [[0, 0.2, [1, 0, 0]],"
                                    "[0.375, 0.4, [1, 0, 0]], [0.375, 0.7, [0, 0, 1]], [1, 0.6, [0, 0, 0.5]]]}");
    CHECK(c.knot_count == 3 && c.knots[1] == 0.375);
    CHECK_NEAR(scatter_at(&c, -9), -log(0.8), 1e-15, 0);
    CHECK_NEAR(scatter_at(&c, 0), -log(0.8), 1e-15, 0);
    CHECK_NEAR(scatter_at(&c, nextafter(0.375, 0)), -log(0.6), 1e-14, 0);
    CHECK_NEAR(scatter_at(&c, 0.375), -log(0.3), 1e-15, 0); /* at the jump the second holds */
    CHECK_NEAR(scatter_at(&c, 0.6875), -(log(0.3) + log(0.4)) / 2, 1e-15, 0);
    CHECK_NEAR(scatter_at(&c, 1), -log(0.4), 1e-15, 0);
    CHECK_NEAR(scatter_at(&c, 1e6), -log(0.4), 1e-15, 0);
    CHECK(at(c.intervals[1].scatter_color[0], &c.intervals[1], 0.37) == 1 && c.intervals[2].scatter_color[2].a == 1);
    vol_tf_compiled_free(&c);
}

static void test_interval_lookup(void)
{
    VolTfCompiled c = compiled(HEAD ", \"scatter\": [[0, 0.1], [2, 0.1]], "
                               "\"absorb\": [[-1, 0.1], [2, 0.1], [5, 0.1]]}");
    static const double knots[] = {-1, 0, 2, 5};
    CHECK(c.knot_count == 4);
    for (size_t i = 0; i < 4; i++) {
        CHECK(c.knots[i] == knots[i]);
        CHECK(vol_tf_interval(&c, knots[i]) == i + 1);
        CHECK(vol_tf_interval(&c, nextafter(knots[i], -INFINITY)) == i);
        CHECK(vol_tf_interval(&c, nextafter(knots[i], INFINITY)) == i + 1);
        CHECK(c.intervals[i].v1 == knots[i] && c.intervals[i + 1].v0 == knots[i]);
        CHECK(c.intervals[i + 1].v_ref == knots[i]);
    }
    CHECK(vol_tf_interval(&c, -INFINITY) == 0 && vol_tf_interval(&c, INFINITY) == 4);
    CHECK(c.intervals[0].v_ref == -1);
    vol_tf_compiled_free(&c);
}

static void test_absorption(void)
{
    VolTfCompiled c = compiled(HEAD ", \"particle_step\": 2, "
                               "\"absorb\": [[0, 0.8, [1, 0.5, 0]], [1, 0.8, [1, 0.5, 0]]]}");
    CHECK(c.coloured && c.has_absorb && c.max_color == 0);
    CHECK(c.intervals[1].absorb[0].a == 0);
    CHECK_NEAR(c.intervals[1].absorb[1].a, -log(0.6) / 2, 1e-15, 0);
    CHECK_NEAR(c.intervals[1].absorb[2].a, -log(0.2) / 2, 1e-15, 0);
    vol_tf_compiled_free(&c);
    c = compiled(HEAD ", \"absorb\": [[0, 0.4, [0, 0, 0]], [1, 1, [0.5, 0.5, 0.5]]]}");
    CHECK(!c.coloured && c.has_absorb);
    CHECK_NEAR(c.intervals[c.knot_count].absorb[2].a, log(2), 1e-15, 0);
    vol_tf_compiled_free(&c);
    c = compiled(HEAD ", \"absorb\": [[0, 0, [1, 0, 0]], [1, 0.5, [1, 1, 1]]]}"); /* takes nothing away */
    CHECK(!c.coloured && !c.has_absorb);
    vol_tf_compiled_free(&c);
}

static void test_transport(void)
{
    VolTfCompiled c = compiled(HEAD ", \"particle_step\": 0.5, \"transport\": [[0, [0.9, 1, 0]]], "
                               "\"scatter\": [[0, 0.4]]}");
    const VolTfInterval *interval = &c.intervals[1];
    CHECK_NEAR(interval->transport[0].a, -log(0.9) / 0.5, 1e-15, 0);
    CHECK(interval->transport[1].a == 0);
    CHECK_NEAR(interval->transport[2].a, 48 * log(2), 1e-15, 0); /* 0 as 2^-24 */
    vol_tf_compiled_free(&c);
    c = compiled(HEAD ", \"scatter\": [[0, 0.4]], "
                 "\"absorb\": [[0, 0.5, [1, 0.5, 0.25]]]}"); /* the direct, colourless */
    double grey = -(log(0.75) + log(0.625)) / 3;
    for (int k = 0; k < 3; k++)
        CHECK_NEAR(c.intervals[0].transport[k].a, -log(0.6) + grey, 1e-15, 0);
    vol_tf_compiled_free(&c);
}

static void test_isosurfaces(void)
{
    VolTfCompiled c = compiled(
        HEAD ", \"surface\": [[0, 0, [1, 0, 0]], [1, 0, [0, 0, 1]], [1, 0, [0, 1, 0]], [2, 0, [0, 1, 0.5]]],"
             "\"isosurfaces\": [{\"value\": 1, \"opacity\": 0.5}, {\"value\": 0.25, \"opacity\": 1},"
             "{\"value\": 1, \"opacity\": 0.25, \"color\": [3, 2, 1]}, {\"value\": 7, \"opacity\": 1e-9},"
             "{\"value\": -3, \"opacity\": 0}, {\"value\": -2, \"opacity\": 0.5}]}");
    static const double values[] = {-2, 0.25, 1, 1, 7}; /* none of opacity 0 */
    CHECK(c.isosurface_count == 5);
    for (size_t i = 0; i < 5 && i < c.isosurface_count; i++)
        CHECK(c.isosurfaces[i].value == values[i]);
    CHECK(c.isosurfaces[0].color[0] == 1 && c.isosurfaces[0].color[2] == 0);      /* constant below the first node */
    CHECK(c.isosurfaces[1].color[0] == 0.75 && c.isosurfaces[1].color[2] == 0.25);
    CHECK(c.isosurfaces[1].optical_depth == INFINITY && c.isosurfaces[1].opacity == 1); /* exactly opaque */
    CHECK(c.isosurfaces[2].color[1] == 1 && c.isosurfaces[2].color[2] == 0);      /* at a jump the second; list order */
    CHECK(c.isosurfaces[3].color[0] == 3 && c.isosurfaces[3].opacity == 0.25);
    CHECK_NEAR(c.isosurfaces[3].optical_depth, -log(0.75), 1e-15, 0);
    CHECK_NEAR(c.isosurfaces[4].optical_depth, 1.0000000005e-9, 1e-15, 0);
    CHECK(c.node_min == -3 && c.node_max == 7 && c.max_color == 3 && !c.has_surface);
    vol_tf_compiled_free(&c);
    c = compiled(HEAD ", \"isosurfaces\": [{\"value\": 1, \"opacity\": 0.5}]}");
    CHECK(c.isosurfaces[0].color[0] == 1 && c.isosurfaces[0].color[1] == 1 && c.isosurfaces[0].color[2] == 1);
    vol_tf_compiled_free(&c);
}

static void test_classic(void)
{
    VolTfCompiled c = compiled(HEAD ", \"model\": \"classic\", "
                               "\"surface\": [[0, 0.5], [50, 0.5]], \"scatter\": [[1, 0.5]]}");
    CHECK_TEXT(tf_said, "warning: transfer function: key 'surface' is ignored, the model is classic\n");
    CHECK(!c.has_surface && c.knot_count == 1 && c.node_max == 1 && c.model == VOL_MODEL_CLASSIC);
    CHECK(c.intervals[1].surfaceness.a == 1 && c.intervals[1].surfaceness.b == 0);
    vol_tf_compiled_free(&c);
    c = compiled(HEAD ", \"model\": \"classic\", \"surfaceness\": [[0, 0.25], [4, 0.75]], "
                 "\"scatter\": [[1, 0.5]]}");
    CHECK_TEXT(tf_said, "");
    CHECK(at(c.intervals[1].surfaceness, &c.intervals[1], 0) == 0.25);
    CHECK(at(c.intervals[2].surfaceness, &c.intervals[2], 2) == 0.5);
    CHECK(at(c.intervals[3].surfaceness, &c.intervals[3], 9) == 0.75);
    vol_tf_compiled_free(&c);
}

static void test_opacity_one(void)
{
    VolTfCompiled c = compiled(HEAD ", \"scatter\": [[0, 1]], \"surface\": [[0, 1], [256, 1]]}");
    CHECK_NEAR(scatter_at(&c, 5), 24 * log(2), 1e-15, 0);
    CHECK_NEAR(c.intervals[1].surface.a, 24 * log(2), 1e-15, 0);
    vol_tf_compiled_free(&c);
}

static void check_refused(const char *text, const char *want)
{
    VolTf tf;
    VolTfCompiled c;
    VolError err = {{0}};
    CHECK(tf_parse(text, &tf, &err) == VOL_OK);
    CHECK(vol_tf_compile(&tf, NULL, &c, &err) == VOL_BAD_INPUT);
    CHECK_TEXT(err.text, want);
    vol_tf_free(&tf);
}

static void test_refuses_what_is_not_finite(void)
{
    check_refused(HEAD ", \"particle_step\": 1e-308, \"scatter\": [[3, 1]]}",
                  "transfer function: what lies at value 3 is not finite for a particle_step of 1e-308");
    check_refused(HEAD ", \"particle_step\": 1e-300, \"emit\": [[3, 1e17, [0, 1e18, 0]]]}",
                  "transfer function: what lies at value 3 is not finite for a particle_step of 1e-300");
}

/* Far apart, or so close that a slope overflows: every coefficient stays finite. */
static void test_extreme_values(void)
{
    VolTfCompiled c = compiled(HEAD ", "
                               "\"scatter\": [[-1e300, 0], [0, 0.1], [5e-324, 0.9], [1e-310, 1], [1e300, 0]]}");
    for (size_t i = 0; i <= c.knot_count; i++) {
        const VolTfInterval *interval = &c.intervals[i];
        CHECK(isfinite(interval->scatter.a) && isfinite(interval->scatter.b) && isfinite(interval->v_ref));
        CHECK(interval->scatter.a >= 0);
    }
    CHECK_NEAR(scatter_at(&c, 5e-324), log(10), 1e-15, 0);
    vol_tf_compiled_free(&c);
}

/* ---- Random functions against a slow reading of the definition ---- */

/* The curve of a converted list at v, channel c. */
static double curve_at(const VolTfExtinctionNode *nodes, size_t count, double v, int c)
{
    size_t after = 0;
    while (after < count && nodes[after].v <= v)
        after++;
    if (after == 0 || after == count)
        return nodes[after ? count - 1 : 0].extinction[c];
    const VolTfExtinctionNode *p = &nodes[after - 1], *q = &nodes[after];
    return p->extinction[c] + (q->extinction[c] - p->extinction[c]) * ((v - p->v) / (q->v - p->v));
}

static VolTf random_tf(Random *random)
{
    VolTf tf = {.interpolate = pick(random, 2) ? VOL_INTERPOLATE_OPACITY : VOL_INTERPOLATE_EXTINCTION,
                .particle_step = 0.25 + uniform(random), .scalar_step = 0.25 + uniform(random)};
    VolTfNodes *lists[] = {&tf.surface, &tf.scatter, &tf.absorb, &tf.emit, &tf.transport};
    for (size_t i = 0; i < 5; i++)
        if (pick(random, 2)) {
            *lists[i] = random_nodes(random, 5, false);
            if (pick(random, 2)) /* stretches of nothing */
                for (size_t k = 0; k < lists[i]->count; k++)
                    lists[i]->nodes[k].amount *= pick(random, 3) == 0;
        }
    tf.isosurface_count = pick(random, 3);
    tf.isosurfaces = calloc(tf.isosurface_count + 1, sizeof *tf.isosurfaces);
    for (size_t i = 0; i < tf.isosurface_count; i++)
        tf.isosurfaces[i] = (VolTfIsosurface){.value = -2 + 5 * uniform(random),
                                              .opacity = pick(random, 3) ? 0.5 : 0};
    return tf;
}

static void check_values(const VolTf *tf, const VolTfCompiled *c, double v)
{
    const VolTfInterval *interval = &c->intervals[vol_tf_interval(c, v)];
    for (int list = VOL_TF_SURFACE; list <= VOL_TF_TRANSPORT; list++) {
        VolTfExtinctionNode *nodes;
        size_t count;
        VolError err;
        CHECK(vol_tf_extinction_nodes(tf, (VolTfList)list, &nodes, &count, &err) == VOL_OK);
        for (int k = 0; k < 3 && (count || list != VOL_TF_TRANSPORT); k++) {
            VolLinear line = list == VOL_TF_SURFACE   ? interval->surface
                             : list == VOL_TF_SCATTER ? interval->scatter
                             : list == VOL_TF_ABSORB  ? interval->absorb[k]
                             : list == VOL_TF_EMIT    ? interval->emit[k]
                                                      : interval->transport[k];
            CHECK_NEAR(at(line, interval, v), count ? curve_at(nodes, count, v, k) : 0, 1e-11, 1e-11);
        }
        free(nodes);
    }
}

/* Particles at a value. */
static bool particles_by_hand(const VolTfCompiled *c, double v)
{
    const VolTfInterval *interval = &c->intervals[vol_tf_interval(c, v)];
    bool any = at(interval->scatter, interval, v) > 0;
    for (int k = 0; k < 3; k++)
        any |= at(interval->absorb[k], interval, v) > 0 || at(interval->emit[k], interval, v) > 0;
    return any;
}

static bool visible_by_hand(const VolTfCompiled *c, double lo, double hi)
{
    for (size_t i = 0; i < c->isosurface_count; i++)
        if (c->isosurfaces[i].value >= lo && c->isosurfaces[i].value <= hi)
            return true;
    if (particles_by_hand(c, lo) || particles_by_hand(c, hi))
        return true;
    for (size_t i = 0; i <= c->knot_count; i++) {
        double v0 = fmax(lo, c->intervals[i].v0), v1 = fmin(hi, c->intervals[i].v1), middle = v0 / 2 + v1 / 2;
        if (v0 < v1 && (particles_by_hand(c, middle) ||
                        at(c->intervals[i].surface, &c->intervals[i], middle) > 0))
            return true;
    }
    return false;
}

/* A knot, an isosurface, or anything. */
static double some_value(Random *random, const VolTfCompiled *c)
{
    if (c->knot_count && pick(random, 2))
        return c->knots[pick(random, c->knot_count)];
    if (c->isosurface_count && pick(random, 2))
        return c->isosurfaces[pick(random, c->isosurface_count)].value;
    return -3 + 8 * uniform(random);
}

static void test_random_functions(void)
{
    Random random = {77};
    printf("# seed %llu\n", (unsigned long long)random.state);
    int visible = 0, hidden = 0;
    for (int round = 0; round < 400; round++) {
        VolTf tf = random_tf(&random);
        VolTfCompiled c;
        VolError err = {{0}};
        CHECK(vol_tf_compile(&tf, NULL, &c, &err) == VOL_OK);
        for (int k = 0; k < 8; k++)
            check_values(&tf, &c, some_value(&random, &c));
        for (int k = 0; k < 100; k++) {
            double a = some_value(&random, &c), b = pick(&random, 4) ? some_value(&random, &c) : a;
            double lo = fmin(a, b), hi = fmax(a, b);
            bool got = vol_tf_range_visible(&c, lo, hi), want = visible_by_hand(&c, lo, hi);
            *(want ? &visible : &hidden) += 1;
            if (got != want)
                FAIL("round %d: [%.17g, %.17g] got %d, want %d", round, lo, hi, got, want);
        }
        vol_tf_compiled_free(&c);
        vol_tf_free(&tf);
    }
    CHECK(visible > 2000 && hidden > 2000); /* both answers were asked for */
}

/* What most bricks of most volumes are: air at the very value where a ramp begins. */
static void test_range_at_the_foot_of_a_ramp(void)
{
    VolTfCompiled c = compiled(HEAD ", \"scatter\": [[0, 0], [1, 0.5]], \"surface\": [[-2, 0.5], [-1, 0]]}");
    CHECK(!vol_tf_range_visible(&c, 0, 0));
    CHECK(!vol_tf_range_visible(&c, -1, 0));
    CHECK(vol_tf_range_visible(&c, 0, nextafter(0, 1)));
    CHECK(vol_tf_range_visible(&c, nextafter(-1, -2), 0));
    CHECK(!vol_tf_range_visible(&c, -2, -2)); /* a plateau crosses no soft surface */
    CHECK(!vol_tf_range_visible(&c, 1, 0) && !vol_tf_range_visible(&c, (double)NAN, 1));
    vol_tf_compiled_free(&c);
}

static VolTfNodes zigzag(size_t count, double offset)
{
    VolTfNodes list = {malloc(count * sizeof(VolTfNode)), count};
    for (size_t i = 0; i < count; i++)
        list.nodes[i] = (VolTfNode){(double)i + offset, 0.3 + 0.02 * (double)(i % 2), {1, 1, 1}};
    return list;
}

/* Ten thousand nodes in every list; the bound is generous, a quadratic algorithm would take seconds. */
static void test_many_nodes(void)
{
    enum { N = 10000 };
    VolTf tf = {.particle_step = 1, .scalar_step = 1};
    tf.scatter = zigzag(N, 0);
    tf.surface = zigzag(N, 0.25);
    tf.absorb = zigzag(N, 0.5);
    tf.emit = zigzag(N, 0.75);
    VolTfCompiled c;
    VolError err;
    clock_t begin = clock();
    CHECK(vol_tf_compile(&tf, NULL, &c, &err) == VOL_OK);
    double seconds = (double)(clock() - begin) / CLOCKS_PER_SEC;
    printf("# %zu knots in %.1f ms\n", c.knot_count, 1e3 * seconds);
    CHECK(c.knot_count == 4 * N);
    CHECK(seconds < 1);
    vol_tf_compiled_free(&c);
    vol_tf_free(&tf);
}

int main(void)
{
    RUN(test_inserted_nodes);
    RUN(test_extinction_inserts_none);
    RUN(test_emission_inserts_none);
    RUN(test_criterion_by_sampling);
    RUN(test_constant);
    RUN(test_nothing);
    RUN(test_ends_and_jump);
    RUN(test_interval_lookup);
    RUN(test_absorption);
    RUN(test_transport);
    RUN(test_isosurfaces);
    RUN(test_classic);
    RUN(test_opacity_one);
    RUN(test_refuses_what_is_not_finite);
    RUN(test_extreme_values);
    RUN(test_random_functions);
    RUN(test_range_at_the_foot_of_a_ramp);
    RUN(test_many_nodes);
    return test_end();
}
