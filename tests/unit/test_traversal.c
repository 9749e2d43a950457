/* Estimators know of a field no more than the contract of trace/traversal.h: a box of one value that shares nothing with
 * grids is rendered by all of them, and looks as a grid of that value does, and as such a box must. */
#define BOX_VALUE ((real)0.5)
#define VOL_TRAVERSAL "tests/unit/box_traversal.h"
#include "trace/direct_tmpl.h"
#include "trace/exact_tmpl.h"
#include "trace/segments_tmpl.h"

#include "tests/unit/random_scene.h"
#include "tests/unit/test.h"

enum { RAYS = VOL_PACKET, SIDE = 8 };

static VolGrid *grid_of_one_value(void)
{
    static const VolAffine identity = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, 0}}};
    VolGridSource source = {.index_to_world = identity, .box = true, .box_max = {SIDE - 1, SIDE - 1, SIDE - 1}};
    VolGridBuilder *builder;
    VolGrid *grid;
    float values[SIDE * SIDE * SIDE];
    uint64_t active[8];
    const int32_t origin[3] = {0, 0, 0};
    memset(active, 0xff, sizeof active);
    for (int n = 0; n < SIDE * SIDE * SIDE; n++)
        values[n] = (float)BOX_VALUE;
    if (vol_grid_begin(&source, &builder, NULL) || vol_grid_leaf(builder, origin, values, NULL, active, NULL) ||
        vol_grid_finish(builder, &grid, NULL))
        abort();
    return grid;
}

/* At BOX_VALUE: what scatters and absorbs, of `extinction` altogether, and emission. */
static void make_scene(const char *model, RandomScene *s, double *extinction)
{
    char text[600];
    snprintf(text, sizeof text,
             "{\"pellucid\": \"transfer-function/1\", \"interpolate\": \"extinction\", \"model\": \"%s\", "
             "\"scatter\": [[0, 0], [1, 0.5, [1, 0.5, 0.25]]], \"absorb\": [[0, 0.1], [1, 0.3]], "
             "\"surface\": [[0.6, 0], [0.7, 0.5]], \"emit\": [[0, 0], [1, 0.4, [0.3, 1, 0.2]]], "
             "\"isosurfaces\": [{\"value\": 0.75, \"opacity\": 0.5}]}",
             model);
    memset(s, 0, sizeof *s);
    s->grid = grid_of_one_value();
    for (int a = 0; a < 3; a++)
        s->hi[a] = SIDE - 1;
    scene_look(s, text, &(VolPreintOptions){.hi = 1, .n = 33, .step = 0.3, .octaves = 1, .change = INFINITY, .threads = 1});
    s->lights[0] = vol_light_head();
    s->scene = (VolScene){.volume = vol_volume_of_grid(s->grid), .tf = &s->compiled, .lights = s->lights, .light_count = 1,
                          .skip = true, .preint = &s->tables, .integrals = &s->integrals, .step = 0.3, .cpu = VOL_CPU_SCALAR,
                          .layers = 1u << VOL_LAYER_Z | 1u << VOL_LAYER_SCATTER};
    const VolTfInterval *in = &s->compiled.intervals[vol_tf_interval(&s->compiled, (double)BOX_VALUE)];
    double x = (double)BOX_VALUE - in->v_ref;
    *extinction = in->scatter.a + in->absorb[0].a + (in->scatter.b + in->absorb[0].b) * x;
}

static void trace_box(const VolTraceCall *call)
{
    VolEstimator estimator = call->prepared->scene->estimator;
    (estimator == VOL_ESTIMATE_EXACT ? trace_exact : estimator == VOL_ESTIMATE_DIRECT ? trace_direct : trace_segments)(call);
}

static void check_ray(const VolRay *ray, double extinction, const VolRadiance *box, const VolRadiance *grid, int estimator)
{
    double optical_depth = extinction * (ray->t1 - ray->t0);
    CHECK_NEAR(box->optical_depth[0], optical_depth, 2e-6, 1e-6);
    for (int c = 0; c < 3; c++) {
        double error = fabs(box->color[c] - grid->color[c]);
        error = fmax(error, fabs(box->sum[VOL_SUM_SCATTER][c] - grid->sum[VOL_SUM_SCATTER][c]));
        if (!(error < 2e-6))
            FAIL("estimator %d channel %d: the box is %.9g, the grid %.9g", estimator, c, box->color[c], grid->color[c]);
    }
    if (isfinite(grid->depth) || isfinite(box->depth))
        CHECK_NEAR(box->depth, grid->depth, 1e-4, 1e-4);
}

static void box_looks_like_a_grid(const char *model)
{
    RandomScene s;
    Random r = {1};
    double extinction;
    make_scene(model, &s, &extinction);
    for (int e = VOL_ESTIMATE_EXACT; e <= VOL_ESTIMATE_DIRECT; e++) {
        VolRay rays[RAYS];
        VolRadiance box[RAYS], grid[RAYS];
        VolScratch scratch;
        s.scene.estimator = (VolEstimator)e;
        if (vol_scene_prepare(&s.scene, &s.prepared, NULL) || vol_scratch_new(&s.prepared, &scratch, NULL))
            abort();
        VolTraceCall call = {.prepared = &s.prepared, .scratch = &scratch, .rays = rays, .out = box};
        call.count = random_packet(&r, &s, RAYS, rays);
        CHECK(call.count > RAYS / 4);
        trace_box(&call);
        trace_rays(&s.prepared, rays, call.count, grid);
        for (size_t i = 0; i < call.count; i++)
            check_ray(&rays[i], extinction, &box[i], &grid[i], e);
        vol_scratch_free(&scratch);
        vol_prepared_free(&s.prepared);
    }
    random_scene_free(&s);
}

static void an_unshaded_box_looks_like_a_grid(void) { box_looks_like_a_grid("unshaded"); }
static void a_hybrid_box_looks_like_a_grid(void) { box_looks_like_a_grid("hybrid"); }
static void a_classic_box_looks_like_a_grid(void) { box_looks_like_a_grid("classic"); }

int main(void)
{
    RUN(an_unshaded_box_looks_like_a_grid);
    RUN(a_hybrid_box_looks_like_a_grid);
    RUN(a_classic_box_looks_like_a_grid);
    return test_end();
}
