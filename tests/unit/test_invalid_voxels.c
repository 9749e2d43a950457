/* Holes that lie exactly between bricks: with long steps, samples on both sides of one are neighbours, and what changes
 * from one to the other is seen although no brick has anything in it.  Leaving bricks out must not change that.
 *
 *     test_invalid_voxels [--seed N]    random scenes N+1, N+2, ... (default 0; a failure names its seed) */
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "tests/unit/random_scene.h"
#include "tests/unit/test.h"

enum { SCENES = 60, RAYS = 40, BRICKS = 3, VOXELS = BRICKS * VOL_BRICK_CELLS + 1 };

static uint64_t first_seed;

typedef struct BrickValues {
    float v[BRICKS][BRICKS][BRICKS]; /* NAN: nothing there */
} BrickValues;

static BrickValues random_bricks(Random *r, bool visible)
{
    static const float values[] = {NAN, 0.25f, 0.75f, 0.25f, 0.75f, 0.5f};
    BrickValues out;
    for (int n = 0; n < BRICKS * BRICKS * BRICKS; n++)
        out.v[n / 9][n / 3 % 3][n % 3] = values[random_below(r, visible ? 6 : 5)];
    return out;
}

/* The value that all bricks around a voxel agree about; NAN: they do not. */
static float agreed_value(const BrickValues *bricks, const int voxel[3])
{
    float found = 0;
    for (int n = 0; n < 8; n++) {
        int at[3];
        bool beside = false;
        for (int a = 0; a < 3; a++) {
            int below = n >> a & 1;
            beside = beside || (below && voxel[a] % VOL_BRICK_CELLS);
            at[a] = voxel[a] / VOL_BRICK_CELLS - below;
            beside = beside || at[a] < 0 || at[a] >= BRICKS;
        }
        if (beside)
            continue;
        float v = bricks->v[at[0]][at[1]][at[2]];
        if (isnan(v) || (found > 0 && v != found))
            return NAN;
        found = v;
    }
    return found;
}

static void place_leaf(VolGridBuilder *builder, const BrickValues *bricks, const int32_t origin[3])
{
    float values[512];
    uint64_t active[8] = {0};
    for (int n = 0; n < 512; n++) {
        const int voxel[3] = {origin[0] + (n >> 6), origin[1] + (n >> 3 & 7), origin[2] + (n & 7)};
        bool inside = voxel[0] < VOXELS && voxel[1] < VOXELS && voxel[2] < VOXELS;
        values[n] = inside ? agreed_value(bricks, voxel) : 0;
        active[n >> 6] |= (uint64_t)inside << (n & 63);
    }
    if (vol_grid_leaf(builder, origin, values, NULL, active, NULL))
        abort();
}

/* Index space stretched and sheared a little. */
static VolGrid *grid_of_bricks(Random *r, bool visible)
{
    VolGridSource source = {.box = true, .box_max = {VOXELS - 1, VOXELS - 1, VOXELS - 1}};
    VolGridBuilder *builder;
    VolGrid *grid;
    BrickValues bricks = random_bricks(r, visible);
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            source.index_to_world.m[i][j] = i == j ? random_in(r, 0.8, 1.25) : random_in(r, -0.1, 0.1);
    if (vol_grid_begin(&source, &builder, NULL))
        abort();
    for (int n = 0; n < (BRICKS + 1) * (BRICKS + 1) * (BRICKS + 1); n++)
        place_leaf(builder, &bricks, (int32_t[]){n / 16 * 8, n / 4 % 4 * 8, n % 4 * 8});
    if (vol_grid_finish(builder, &grid, NULL))
        abort();
    return grid;
}

/* Nothing at the values of the bricks, something between them; where `visible` at those of some. */
static void scene_of_bricks(Random *r, bool visible, double step, RandomScene *s)
{
    static const char *const lists[] = {
        "\"isosurfaces\": [{\"value\": 0.5, \"opacity\": 0.3}, {\"value\": 0.6, \"opacity\": 0.2}]",
        "\"scatter\": [[0.4, 0], [0.5, 0.3], [0.6, 0]], \"emit\": [[0.3, 0], [0.4, 0.2, [1, 0.5, 0.2]], [0.5, 0]]",
        "\"surface\": [[0.4, 0], [0.5, 0.6], [0.6, 0]], \"scatter\": [[0.45, 0], [0.5, 0.2], [0.55, 0]], "
        "\"isosurfaces\": [{\"value\": 0.3, \"opacity\": 0.3}]"};
    char text[500];
    snprintf(text, sizeof text, "{\"pellucid\": \"transfer-function/1\", \"model\": \"%s\", %s}",
             random_below(r, 2) ? "hybrid" : "unshaded", lists[random_below(r, 3)]);
    memset(s, 0, sizeof *s);
    s->grid = grid_of_bricks(r, visible);
    for (int a = 0; a < 3; a++)
        s->hi[a] = VOXELS - 1;
    scene_look(s, text, &(VolPreintOptions){.hi = 1, .n = 32, .step = step, .octaves = 1, .change = INFINITY, .threads = 1});
    s->lights[0] = vol_light_head();
    s->scene = (VolScene){.volume = vol_volume_of_grid(s->grid), .tf = &s->compiled, .lights = s->lights, .light_count = 1,
                          .skip = true, .preint = &s->tables, .integrals = &s->integrals, .step = step};
}

/* How many rays see something; with and without leaving out the same. */
static int compare_skipping(RandomScene *s, Random *r, uint64_t seed)
{
    VolScene plain = s->scene;
    VolPrepared prepared_plain;
    int seen = 0;
    plain.skip = false;
    if (vol_scene_prepare(&s->scene, &s->prepared, NULL) || vol_scene_prepare(&plain, &prepared_plain, NULL))
        abort();
    for (int i = 0; i < RAYS; i++) {
        VolRay ray = random_ray(r, s);
        VolRadiance a, b;
        if (!vol_ray_clip(&s->scene, &ray))
            continue;
        trace_rays(&s->prepared, &ray, 1, &a);
        trace_rays(&prepared_plain, &ray, 1, &b);
        seen += b.optical_depth[0] > 0;
        if (memcmp(&a, &b, sizeof a) != 0)
            FAIL("seed %d ray %d estimator %d precise %d step %g: tau %.17g with skipping, %.17g without", (int)seed, i,
                 (int)plain.estimator, plain.precise, plain.step, a.optical_depth[0], b.optical_depth[0]);
    }
    vol_prepared_free(&s->prepared);
    vol_prepared_free(&prepared_plain);
    return seen;
}

static void compare_scenes(VolEstimator estimator)
{
    static const double steps[] = {0.4, 1.7, 2.2, 3, 6, 13};
    int seen = 0;
    for (uint64_t seed = first_seed + 1; seed <= first_seed + SCENES; seed++)
        for (int n = 0; n < 6; n++) {
            Random r = {seed};
            RandomScene s;
            bool visible = seed % 3 == 0;
            scene_of_bricks(&r, visible, steps[n], &s);
            s.scene.estimator = estimator;
            s.scene.precise = seed % 2;
            int through = compare_skipping(&s, &r, seed);
            seen += visible ? 0 : through;
            random_scene_free(&s);
        }
    printf("# estimator %d: %d rays see something where no brick is visible\n", (int)estimator, seen);
    /* Cell by cell nothing is; the others step over the holes. */
    CHECK(estimator == VOL_ESTIMATE_EXACT ? seen == 0 : seen > SCENES);
}

static void exact_is_the_same_with_skipping(void) { compare_scenes(VOL_ESTIMATE_EXACT); }
static void full_is_the_same_with_skipping(void) { compare_scenes(VOL_ESTIMATE_FULL); }
static void integrals_is_the_same_with_skipping(void) { compare_scenes(VOL_ESTIMATE_INTEGRALS); }
static void direct_is_the_same_with_skipping(void) { compare_scenes(VOL_ESTIMATE_DIRECT); }

int main(int argc, char **argv)
{
    first_seed = seed_before_first(argc, argv);
    RUN(exact_is_the_same_with_skipping);
    RUN(full_is_the_same_with_skipping);
    RUN(integrals_is_the_same_with_skipping);
    RUN(direct_is_the_same_with_skipping);
    return test_end();
}
