/* How fast the marching estimators converge to the exact one.  Inside one trilinear cell the field on a slanting ray is a
 * cubic, smooth from end to end, so that the orders of the rules themselves show; the largest of many cells' errors is
 * fitted over three octaves of the step. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "tests/unit/random_scene.h"
#include "tests/unit/test.h"

enum { CELLS = 12, OCTAVES = 4 };

typedef struct OneCell {
    VolGrid *grid;
    VolTf tf;
    VolTfCompiled compiled;
    VolTfIntegrals integrals;
    VolScene scene;
    VolPrepared prepared;
} OneCell;

static VolGrid *cell_grid(Random *r)
{
    static const VolAffine identity = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, 0}}};
    VolGridSource source = {.index_to_world = identity, .box = true, .box_max = {1, 1, 1}, .as_double = true};
    VolGridBuilder *builder;
    VolGrid *grid;
    double values[512] = {0};
    uint64_t active[8];
    memset(active, 0xff, sizeof active);
    for (int n = 0; n < 8; n++)
        values[(n >> 2) * 64 + (n >> 1 & 1) * 8 + (n & 1)] = random_in(r, 0.05, 0.95);
    const int32_t origin[3] = {0, 0, 0};
    if (vol_grid_begin(&source, &builder, NULL) || vol_grid_leaf(builder, origin, NULL, values, active, NULL) ||
        vol_grid_finish(builder, &grid, NULL))
        abort();
    return grid;
}

/* The transfer function is linear over all values that occur: smooth, too. */
static void make_cell(Random *r, const char *lists, OneCell *cell)
{
    char text[1024];
    snprintf(text, sizeof text, "{\"pellucid\": \"transfer-function/1\", \"interpolate\": \"extinction\", \"model\": "
                                "\"unshaded\", \"scalar_step\": 0.2, %s}", lists);
    VolBytes bytes = {(unsigned char *)text, strlen(text)};
    memset(cell, 0, sizeof *cell);
    cell->grid = cell_grid(r);
    if (vol_tf_parse(&bytes, "test", &cell->tf, NULL, NULL) || vol_tf_compile(&cell->tf, NULL, &cell->compiled, NULL) ||
        vol_tf_integrals_new(&cell->compiled, &cell->integrals, NULL))
        abort();
    cell->scene = (VolScene){.volume = vol_volume_of_grid(cell->grid), .tf = &cell->compiled,
                             .integrals = &cell->integrals, .precise = true, .skip = true};
    if (vol_scene_prepare(&cell->scene, &cell->prepared, NULL))
        abort();
}

static void free_cell(OneCell *cell)
{
    vol_prepared_free(&cell->prepared);
    vol_tf_integrals_free(&cell->integrals);
    vol_tf_compiled_free(&cell->compiled);
    vol_tf_free(&cell->tf);
    vol_grid_free(cell->grid);
}

/* The tables belong to what is prepared. */
static void traced(OneCell *cell, const VolRay *ray, VolRadiance *out)
{
    vol_prepared_free(&cell->prepared);
    if (vol_scene_prepare(&cell->scene, &cell->prepared, NULL))
        abort();
    trace_rays(&cell->prepared, ray, 1, out);
}

static double error_of(OneCell *cell, const VolRay *ray, VolEstimator estimator, int steps)
{
    VolRadiance exact, got;
    cell->scene.estimator = VOL_ESTIMATE_EXACT;
    traced(cell, ray, &exact);
    cell->scene.estimator = estimator;
    cell->scene.step = (ray->t1 - ray->t0) / steps;
    VolPreint tables = {0};
    VolPreintOptions options = {.lo = 0, .hi = 1, .n = 2048, .step = cell->scene.step, .octaves = 1, .threads = 2,
                                .change = 2.0 / steps}; /* enough for all but the steepest */
    if (estimator == VOL_ESTIMATE_FULL && vol_preint_build(&cell->compiled, &options, &tables, NULL))
        abort();
    cell->scene.preint = &tables;
    traced(cell, ray, &got);
    vol_preint_free(&tables);
    cell->scene.preint = NULL; /* they end here */
    return fmax(fabs(exact.color[0] - got.color[0]), fabs(exp(-exact.optical_depth[0]) - exp(-got.optical_depth[0])));
}

static void check_order(const char *lists, VolEstimator estimator, const char *name)
{
    double rms[OCTAVES] = {0};
    Random r = {11};
    for (int c = 0; c < CELLS; c++) {
        OneCell cell;
        make_cell(&r, lists, &cell);
        VolVec3 from = {random_in(&r, 0, 0.3), random_in(&r, 0, 0.3), 0};
        VolVec3 to = {random_in(&r, 0.7, 1), random_in(&r, 0.7, 1), 1};
        VolVec3 d = vol_sub(to, from);
        VolRay ray = {from, vol_scale(d, 1 / vol_length(d)), 0, vol_length(d)};
        for (int o = 0; o < OCTAVES; o++) {
            double e = error_of(&cell, &ray, estimator, 16 << o);
            rms[o] += e * e;
        }
        free_cell(&cell);
    }
    double order = 0.5 * log2(rms[0] / rms[OCTAVES - 1]) / (OCTAVES - 1);
    printf("# %s: rms %.3g to %.3g, order %.3f\n", name, sqrt(rms[0] / CELLS), sqrt(rms[OCTAVES - 1] / CELLS), order);
    CHECK_NEAR(order, 2, 0, 0.1);
}

#define SCATTER "\"scatter\": [[0, 0, [1, 0.5, 0]], [1, 0.9, [0.2, 0.5, 1]]], \"emit\": [[0, 0.2], [1, 0]]"
#define SURFACE "\"surface\": [[0, 0.1, [1, 0.5, 0]], [1, 0.4, [0.2, 0.5, 1]]]"

static void direct_is_second_order(void)
{
    check_order(SCATTER, VOL_ESTIMATE_DIRECT, "direct, particles");
    check_order(SURFACE, VOL_ESTIMATE_DIRECT, "direct, surfaces");
    check_order(SCATTER ", " SURFACE, VOL_ESTIMATE_DIRECT, "direct, both");
}

static void integrals_are_second_order(void)
{
    check_order(SCATTER, VOL_ESTIMATE_INTEGRALS, "integrals, particles");
    check_order(SCATTER ", " SURFACE, VOL_ESTIMATE_INTEGRALS, "integrals, both");
}

static void full_is_second_order(void)
{
    check_order(SCATTER, VOL_ESTIMATE_FULL, "full, particles");
    check_order(SCATTER ", " SURFACE, VOL_ESTIMATE_FULL, "full, both");
}

#define DELTAS "\"isosurfaces\": [{\"value\": 0.41, \"opacity\": 0.5}, {\"value\": 0.63, \"opacity\": 0.3}]"

/* The tables' own error: a fixed step, more and more nodes, against segments integrated by definition.  Isosurfaces cut the
 * segments and are in no table, so that they do not lower the order. */
static void tables_are_second_order_with_isosurfaces(void)
{
    double rms[OCTAVES] = {0};
    Random r = {5};
    for (int c = 0; c < 4 * CELLS; c++) {
        OneCell cell;
        make_cell(&r, SCATTER ", " SURFACE ", " DELTAS, &cell);
        VolVec3 d = {random_in(&r, 0.4, 0.8), random_in(&r, 0.4, 0.8), 1};
        VolRay ray = {{0.1, 0.2, 0}, vol_scale(d, 1 / vol_length(d)), 0, vol_length(d)};
        cell.scene.estimator = VOL_ESTIMATE_FULL;
        cell.scene.step = ray.t1 / 12;
        VolPreint none = {.integrals = cell.integrals, .hi = 1, .n = 2, .channels = 1};
        VolRadiance want, got;
        cell.scene.preint = &none;
        traced(&cell, &ray, &want);
        for (int o = 0; o < OCTAVES; o++) {
            VolPreint tables;
            VolPreintOptions options = {.lo = 0, .hi = 1, .n = ((size_t)64 << o) + 1, .step = cell.scene.step, .octaves = 1,
                                        .threads = 2, .change = INFINITY};
            if (vol_preint_build(&cell.compiled, &options, &tables, NULL))
                abort();
            cell.scene.preint = &tables;
            traced(&cell, &ray, &got);
            vol_preint_free(&tables);
            double e = got.color[0] - want.color[0];
            rms[o] += e * e;
        }
        free_cell(&cell);
    }
    double order = 0.5 * log2(rms[0] / rms[OCTAVES - 1]) / (OCTAVES - 1);
    double first = sqrt(rms[0] / (4 * CELLS)), last = sqrt(rms[OCTAVES - 1] / (4 * CELLS));
    printf("# tables: rms %.3g to %.3g, order %.3f\n", first, last, order);
    CHECK(order > 1.9);
}

int main(void)
{
    RUN(direct_is_second_order);
    RUN(integrals_are_second_order);
    RUN(full_is_second_order);
    RUN(tables_are_second_order_with_isosurfaces);
    return test_end();
}
