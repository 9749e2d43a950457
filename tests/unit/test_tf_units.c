/* Transfer functions in other units of the field and within limits, fields likewise, and where float is not enough. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "volume/grid.h"
#include "trace/conditioning.h"
#include "tests/unit/random_scene.h"
#include "tests/unit/test.h"
#include "tests/unit/tf_help.h"

static VolTfCompiled compiled(const char *text)
{
    VolTf tf;
    VolTfCompiled c = {0};
    VolError err = {{0}};
    VolStatus status = tf_parse(text, &tf, &err);
    if (!status) {
        status = vol_tf_compile(&tf, &tf_log, &c, &err);
        vol_tf_free(&tf);
    }
    if (status)
        FAIL("%s: %s", text, err.text);
    return c;
}

static double line_at(const VolLinear *line, const VolTfInterval *in, double v)
{
    return line->a + line->b * (v - in->v_ref);
}

static const VolTfInterval *interval_at(const VolTfCompiled *c, double v) { return &c->intervals[vol_tf_interval(c, v)]; }

static double scatter_at(const VolTfCompiled *c, double v)
{
    return line_at(&interval_at(c, v)->scatter, interval_at(c, v), v);
}

static double surface_at(const VolTfCompiled *c, double v)
{
    return line_at(&interval_at(c, v)->surface, interval_at(c, v), v);
}

static double slope(VolLinear line) { return fabs(line.b); }

/* ---- Limits ---- */

static const char ordinary[] = HEAD ", \"particle_step\": 0.01, \"scatter\": [[0, 0], [0.5, 0.9], [1, 0.1]], \"surface\": "
                                    "[[0.2, 0], [0.3, 0.9], [0.4, 0]], \"emit\": [[0, 0], [1, 0.5]]}";

static void what_is_within_limits_stays_as_it_is(void)
{
    VolTfCompiled before = compiled(ordinary), after = compiled(ordinary);
    vol_tf_limit(&after, 0.25);
    for (size_t i = 0; i <= before.knot_count; i++)
        CHECK(memcmp(&before.intervals[i], &after.intervals[i], sizeof before.intervals[i]) == 0);
    CHECK(before.max_emit == after.max_emit);
    vol_tf_compiled_free(&before);
    vol_tf_compiled_free(&after);
}

/* A particle_step of 1e-30 asks for extinction of 1e30: what is left of it is opaque, and of the same colours. */
static void extinction_is_limited_and_proportions_stay(void)
{
    static const double voxels[] = {1e-6, 0.25, 1, 1000};
    const char text[] = HEAD ", \"interpolate\": \"extinction\", \"particle_step\": 1e-30, "
                             "\"scatter\": [[0, 0.5], [1, 0.9]], "
                             "\"absorb\": [[0, 0.9, [1, 0.5, 0.25]], [1, 0.9, [1, 0.5, 0.25]]]}";
    for (size_t n = 0; n < sizeof voxels / sizeof *voxels; n++) {
        VolTfCompiled before = compiled(text), after = compiled(text);
        vol_tf_limit(&after, voxels[n]);
        for (double v = 0; v <= 1; v += 0.25) {
            const VolTfInterval *in = interval_at(&after, v), *was = interval_at(&before, v);
            double scatter = line_at(&in->scatter, in, v), whole = line_at(&was->scatter, was, v);
            for (int c = 0; c < 3; c++) {
                double absorb = line_at(&in->absorb[c], in, v);
                CHECK((scatter + absorb) * voxels[n] <= 1e18 * (1 + 1e-9));
                if (v == 0 || v == 1) /* both ends of the interval; between, the line joins them */
                    CHECK_NEAR(absorb * whole, line_at(&was->absorb[c], was, v) * scatter, 1e-9, 0);
            }
            CHECK(scatter * voxels[n] > 1e15);
        }
        vol_tf_compiled_free(&before);
        vol_tf_compiled_free(&after);
    }
}

/* An interval of 1e-12 that rises to 1e24: floats bear the value but not the slope. */
static void slopes_are_numbers(void)
{
    VolTfCompiled c = compiled(HEAD ", \"interpolate\": \"extinction\", \"particle_step\": 1e-38, \"scalar_step\": 1e-38, "
                                    "\"scatter\": [[0, 0], [1e-12, 0.9], [1, 0.9]], "
                                    "\"surface\": [[0, 0], [1e-12, 0.9], [1, 0]]}");
    vol_tf_limit(&c, 0.5);
    for (size_t i = 0; i <= c.knot_count; i++) {
        CHECK(slope(c.intervals[i].scatter) < 1e37);
        CHECK(slope(c.intervals[i].surface) < 1e37);
    }
    CHECK(scatter_at(&c, 0.5) > 1e16);
    vol_tf_compiled_free(&c);
}

/* ---- Units ---- */

static void functions_of_scaled_values_are_the_same(void)
{
    static const int exponents[] = {-120, -3, 5, 100};
    for (size_t n = 0; n < sizeof exponents / sizeof *exponents; n++) {
        double s = ldexp(1, exponents[n]);
        VolTfCompiled before = compiled(ordinary), after = compiled(ordinary);
        vol_tf_compiled_rescale(&after, s);
        CHECK(after.node_min == before.node_min * s && after.node_max == before.node_max * s);
        for (double v = -0.25; v <= 1.25; v += 1.0 / 64) {
            CHECK(vol_tf_interval(&after, s * v) == vol_tf_interval(&before, v));
            CHECK(scatter_at(&after, s * v) == scatter_at(&before, v));
            CHECK(surface_at(&after, s * v) * s == surface_at(&before, v)); /* per unit of the field */
        }
        vol_tf_compiled_free(&before);
        vol_tf_compiled_free(&after);
    }
}

static void fields_are_scaled_without_a_trace(void)
{
    for (uint64_t seed = 1; seed <= 20; seed++) {
        Random r = {seed}, same = {seed};
        RandomScene s = {0}, t = {0};
        VolGrid *grid = random_grid(&r, 0, &s), *as_it_was = random_grid(&same, 0, &t);
        double lo, hi, lo_was, hi_was;
        bool any = vol_grid_range(as_it_was, &lo_was, &hi_was);
        vol_grid_rescale(grid, 40);
        CHECK(vol_grid_range(grid, &lo, &hi) == any);
        CHECK(!any || (lo == ldexp(lo_was, 40) && hi == ldexp(hi_was, 40)));
        vol_grid_rescale(grid, -40);
        size_t size = grid->stored_bricks * VOL_BRICK_STRIDE * (grid->is_double ? sizeof(double) : sizeof(float));
        CHECK(memcmp(grid->values, as_it_was->values, size) == 0); /* holes too */
        CHECK(grid->background == as_it_was->background);
        vol_grid_free(grid);
        vol_grid_free(as_it_was);
    }
}

/* ---- Conditioning ---- */

static bool is_ill_conditioned(const char *text)
{
    Random r = {7};
    RandomScene s = {0};
    VolGrid *grid = random_grid(&r, RANDOM_NO_PLATEAUS, &s);
    VolTfCompiled c = compiled(text);
    uint8_t *seen = malloc(grid->brick_count), *bricks;
    memset(seen, VOL_BRICK_SEEN, grid->brick_count);
    VolScene scene = {.volume = vol_volume_of_grid(grid), .tf = &c};
    VolEmptySpace space = {.brick_visible = seen};
    CHECK(vol_conditioning_judge(&scene, &space, false, &bricks, NULL) == VOL_OK);
    bool ill = bricks != NULL;
    free(bricks);
    free(seen);
    vol_tf_compiled_free(&c);
    vol_grid_free(grid);
    return ill;
}

static void what_float_cannot_tell_is_found(void)
{
    CHECK(!is_ill_conditioned(ordinary));
    CHECK(!is_ill_conditioned(HEAD ", \"surface\": [[0.2, 0], [0.25, 0.9], [0.3, 0]]}"));
    /* A ramp of a ten-thousandth; a spike of many intervals of a few units in the last place; values near 1 through nothing
     * but a steep surface. */
    CHECK(is_ill_conditioned(HEAD ", \"particle_step\": 0.001, \"scatter\": [[0.5, 0], [0.5001, 0.9]]}"));
    CHECK(is_ill_conditioned(HEAD ", \"scalar_step\": 0.1, \"surface\": [[0.57931, 0], [0.57932, 1], [0.57933, 0]]}"));
    CHECK(is_ill_conditioned(HEAD ", \"scalar_step\": 0.01, \"surface\": [[-0.08, 1]]}"));
}

int main(void)
{
    RUN(what_is_within_limits_stays_as_it_is);
    RUN(extinction_is_limited_and_proportions_stay);
    RUN(slopes_are_numbers);
    RUN(functions_of_scaled_values_are_the_same);
    RUN(fields_are_scaled_without_a_trace);
    RUN(what_float_cannot_tell_is_found);
    return test_end();
}
