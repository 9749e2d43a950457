/* Where light is solved, what reaches these places along rays of their own, and the hashes that tell whether it would again.
 *
 *     test_shadow [--seed N]    random scenes N+1, N+2, ... (default 0; a failure names its seed) */
#include "base/fmath.h"
#include "light/shadow.h"
#include "tests/unit/random_scene.h"
#include "tests/unit/test.h"
#include "tf/attenuation.h"
#include "volume/content_hash.h"

enum { SCENES = 60 };

static uint64_t first_seed;
static VolError err;

/* ---- The lattice ---- */

static bool cell_is_seen(const VolScene *scene, const int32_t at[3])
{
    const VolGrid *grid = scene->volume.grid;
    double lo = INFINITY, hi = -INFINITY;
    for (int n = 0; n < 8; n++) {
        double v = vol_grid_voxel(grid, at[0] + (n >> 2), at[1] + (n >> 1 & 1), at[2] + (n & 1));
        if (!isfinite(v))
            return false;
        lo = fmin(lo, v);
        hi = fmax(hi, v);
    }
    return vol_tf_range_visible(scene->tf, lo, hi);
}

/* Cells that overlap `base` + (p - 2 .. p + 2) h, in the volume's index space. */
static bool is_wanted(const VolScene *scene, const int32_t p[3], const double base[3], const double h[3])
{
    const VolGrid *grid = scene->volume.grid;
    int32_t lo[3], hi[3], at[3];
    for (int a = 0; a < 3; a++) {
        lo[a] = (int32_t)fmax(floor(base[a] + (p[a] - 2) * h[a]), grid->cell_min[a]);
        hi[a] = (int32_t)fmin(ceil(base[a] + (p[a] + 2) * h[a]) - 1, grid->cell_max[a]);
    }
    for (at[0] = lo[0]; at[0] <= hi[0]; at[0]++)
        for (at[1] = lo[1]; at[1] <= hi[1]; at[1]++)
            for (at[2] = lo[2]; at[2] <= hi[2]; at[2]++)
                if (cell_is_seen(scene, at))
                    return true;
    return false;
}

static bool lattice_has(const VolLightLattice *lattice, const int32_t p[3])
{
    for (size_t i = 0; i < lattice->leaf_count; i++) {
        const VolLightLeaf *leaf = &lattice->leaves[i];
        const int32_t at[3] = {p[0] - leaf->origin[0], p[1] - leaf->origin[1], p[2] - leaf->origin[2]};
        if (((at[0] | at[1] | at[2]) & ~7) == 0)
            return vol_light_leaf_has(leaf, at[0] * 64 + at[1] * 8 + at[2]);
    }
    return false;
}

static void check_lattice(const VolScene *scene, int64_t resolution, uint64_t seed)
{
    const VolGrid *grid = scene->volume.grid;
    const VolLight sun = {.kind = VOL_LIGHT_SUN, .direction = {1, 0, 0}};
    VolLightLattice l, again;
    double base[3] = {0}, h[3] = {1, 1, 1};
    uint64_t points = 0;
    CHECK(!vol_light_lattice_new(scene, &sun, resolution, 1, &l, &err));
    CHECK(!vol_light_lattice_new(scene, &sun, resolution, 3, &again, &err));
    CHECK(l.leaf_count == again.leaf_count && !memcmp(l.leaves, again.leaves, l.leaf_count * sizeof *l.leaves));
    for (int a = 0; a < 3 && resolution; a++) {
        base[a] = grid->domain_min[a];
        h[a] = (grid->domain_max[a] - grid->domain_min[a]) / (l.hi[a] - l.lo[a]);
    }
    int32_t p[3];
    for (p[0] = l.lo[0] - 1; p[0] <= l.hi[0] + 1; p[0]++)
        for (p[1] = l.lo[1] - 1; p[1] <= l.hi[1] + 1; p[1]++)
            for (p[2] = l.lo[2] - 1; p[2] <= l.hi[2] + 1; p[2]++) {
                bool inside = true;
                for (int a = 0; a < 3; a++)
                    inside = inside && p[a] >= l.lo[a] && p[a] <= l.hi[a];
                bool wanted = inside && is_wanted(scene, p, base, h);
                points += wanted;
                if (wanted != lattice_has(&l, p))
                    FAIL("seed %llu, resolution %d: point (%d, %d, %d) is %s", (unsigned long long)seed, (int)resolution,
                         p[0], p[1], p[2], wanted ? "missing" : "too many");
            }
    CHECK(points == l.points);
    vol_light_lattice_free(&l);
    vol_light_lattice_free(&again);
}

static void points_lie_around_all_that_is_seen(void)
{
    for (uint64_t seed = first_seed + 1; seed <= first_seed + SCENES; seed++) {
        Random r = {seed};
        RandomScene s;
        random_scene(&r, 0, &s);
        check_lattice(&s.scene, 0, seed);
        check_lattice(&s.scene, 2 + random_below(&r, 30), seed);
        random_scene_free(&s);
    }
}

static void the_outermost_points_lie_on_the_domain(void)
{
    for (uint64_t seed = first_seed + 1; seed <= first_seed + SCENES; seed++) {
        Random r = {seed};
        RandomScene s;
        VolLightLattice l;
        const VolLight sun = {.kind = VOL_LIGHT_SUN, .direction = {1, 0, 0}};
        random_scene(&r, 0, &s);
        CHECK(!vol_light_lattice_new(&s.scene, &sun, 17, 1, &l, &err));
        for (int n = 0; n < 8; n++) {
            VolVec3 at = vol_apply(&l.index_to_world, vol_vec3((n & 1 ? l.hi : l.lo)[0], (n & 2 ? l.hi : l.lo)[1],
                                                               (n & 4 ? l.hi : l.lo)[2]));
            CHECK_NEAR(vol_length(vol_sub(at, vol_volume_corner(&s.scene.volume, n))), 0, 0, 1e-12);
        }
        vol_light_lattice_free(&l);
        random_scene_free(&s);
    }
}

/* ---- Boxes ---- */

static const char *const fog = "{\"pellucid\": \"transfer-function/1\", \"interpolate\": \"extinction\","
                               "\"scatter\": [[0, 0.3]]}";

typedef struct Box {
    RandomScene s;
    VolTf tf;
    VolTfCompiled compiled;
} Box;

/* Voxels 0..n-1 along each axis; their values are x where `ramp`, else 0.5. */
static void box_begin(Box *box, const char *text, int n, bool ramp, bool tiles)
{
    VolGridSource source = {.box = true, .box_max = {n - 1, n - 1, n - 1},
                            .index_to_world = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}};
    VolGridBuilder *builder;
    VolGrid *grid;
    memset(box, 0, sizeof *box);
    if (vol_grid_begin(&source, &builder, &err))
        abort();
    for (int32_t x = 0; x < n; x += 8)
        for (int32_t y = 0; y < n; y += 8)
            for (int32_t z = 0; z < n; z += 8) {
                float values[512];
                uint64_t active[8];
                const int32_t origin[3] = {x, y, z};
                memset(active, 0xff, sizeof active);
                for (int i = 0; i < 512; i++)
                    values[i] = ramp ? (float)(x + i / 64) : 0.5f;
                if (tiles ? vol_grid_tile(builder, origin, 8, 0.5, true, &err)
                          : vol_grid_leaf(builder, origin, values, NULL, active, &err))
                    abort();
            }
    VolBytes bytes = {(unsigned char *)(uintptr_t)text, strlen(text)};
    if (vol_grid_finish(builder, &grid, &err) || vol_tf_parse(&bytes, "look", &box->tf, NULL, &err))
        abort();
    vol_tf_settle_step(&box->tf, 0, 1);
    if (vol_tf_compile(&box->tf, NULL, &box->compiled, &err))
        abort();
    box->s.grid = grid;
    box->s.scene = (VolScene){.volume = vol_volume_of_grid(grid), .tf = &box->compiled, .skip = true, .step = 1,
                              .termination_opacity = vol_shadow_termination(1)};
}

static void box_end(Box *box)
{
    vol_grid_free(box->s.grid);
    vol_tf_compiled_free(&box->compiled);
    vol_tf_free(&box->tf);
}

typedef struct Solved {
    VolLightLattice lattice;
    float *T;
} Solved;

static void solve(const VolScene *scene, const VolLight *light, double absorption, int threads, Solved *out)
{
    VolPrepared prepared;
    VolShadowCounts counts = {0};
    if (vol_light_lattice_new(scene, light, 0, threads, &out->lattice, &err) || vol_scene_prepare(scene, &prepared, &err))
        abort();
    out->T = malloc(out->lattice.leaf_count * VOL_LIGHT_LEAF_POINTS * 3 * sizeof *out->T);
    const VolShadow shadow = {&prepared, light, &out->lattice, NULL, absorption, threads, out->T};
    CHECK(!vol_shadow_rays(&shadow, &counts, &err));
    CHECK(counts.rays + counts.missed == out->lattice.points);
    vol_prepared_free(&prepared);
}

static void solved_free(Solved *solved)
{
    vol_light_lattice_free(&solved->lattice);
    free(solved->T);
}

static double T_at(const Solved *solved, int32_t x, int32_t y, int32_t z)
{
    for (size_t i = 0; i < solved->lattice.leaf_count; i++) {
        const int32_t *o = solved->lattice.leaves[i].origin;
        if (((x - o[0]) | (y - o[1]) | (z - o[2])) >= 0 && ((x - o[0]) | (y - o[1]) | (z - o[2])) < 8)
            return (double)solved->T[i * VOL_LIGHT_LEAF_POINTS + (size_t)((x - o[0]) * 64 + (y - o[1]) * 8 + z - o[2])];
    }
    return NAN;
}

enum { N = 16 };

/* Optical depth per unit of length. */
static double extinction(void) { return -vol_log(0.7); }

static void fog_darkens_with_the_way(void)
{
    const VolLight sun = {.kind = VOL_LIGHT_SUN, .direction = {0.6, 0, -0.8}};
    for (int S = 0; S < 4; S++) {
        Box box;
        Solved solved;
        box_begin(&box, fog, N, false, false);
        box.s.scene.termination_opacity = vol_shadow_termination(0.5 * S);
        solve(&box.s.scene, &sun, 0.5 * S, 1, &solved);
        for (int x = 0; x < N; x++)
            for (int z = 0; z < N; z++) {
                double way = fmin(x / 0.6, (N - 1 - z) / 0.8);
                CHECK_NEAR(T_at(&solved, x, 5, z), vol_exp(-0.5 * S * extinction() * way), 1e-5, 1e-7);
            }
        solved_free(&solved);
        box_end(&box);
    }
}

static void a_sun_along_an_axis_is_exact(void)
{
    const VolLight sun = {.kind = VOL_LIGHT_SUN, .direction = {0, -1, 0}};
    Box box;
    Solved solved;
    box_begin(&box, fog, N, false, false);
    solve(&box.s.scene, &sun, 1, 2, &solved);
    for (int y = 0; y < N; y++)
        CHECK_NEAR(T_at(&solved, 3, y, 0), vol_exp(-extinction() * (N - 1 - y)), 1e-6, 0);
    solved_free(&solved);
    box_end(&box);
}

static void a_light_inside_shines_around_it(void)
{
    const VolLight point = {.kind = VOL_LIGHT_POINT, .position = {4, 5, 6}};
    Box box;
    Solved solved;
    box_begin(&box, fog, N, false, false);
    solve(&box.s.scene, &point, 1, 1, &solved);
    CHECK(T_at(&solved, 4, 5, 6) == 1);
    for (int x = 0; x < N; x++)
        CHECK_NEAR(T_at(&solved, x, 9, 6), vol_exp(-extinction() * sqrt((x - 4) * (x - 4) + 16)), 1e-5, 0);
    solved_free(&solved);
    box_end(&box);
}

/* Voxel 5 has the value itself: it is behind the isosurface as seen from below, before it from above. */
static void a_voxel_at_an_isosurface_is_behind_it(void)
{
    static const char text[] = "{\"pellucid\": \"transfer-function/1\","
                               "\"isosurfaces\": [{\"value\": 5, \"opacity\": 0.75}]}";
    const VolLight up = {.kind = VOL_LIGHT_SUN, .direction = {1, 0, 0}};
    const VolLight down = {.kind = VOL_LIGHT_SUN, .direction = {-1, 0, 0}};
    Box box;
    Solved solved;
    box_begin(&box, text, N, true, false);
    solve(&box.s.scene, &up, 1, 1, &solved);
    CHECK_NEAR(T_at(&solved, 4, 3, 3), 1, 0, 0);
    CHECK_NEAR(T_at(&solved, 5, 3, 3), 0.25, 1e-7, 0);
    CHECK_NEAR(T_at(&solved, 6, 3, 3), 0.25, 1e-7, 0);
    solved_free(&solved);
    solve(&box.s.scene, &down, 1, 1, &solved);
    CHECK_NEAR(T_at(&solved, 4, 3, 3), 0.25, 1e-7, 0);
    CHECK_NEAR(T_at(&solved, 5, 3, 3), 1, 0, 0);
    solved_free(&solved);
    solve(&box.s.scene, &down, 0, 1, &solved);
    CHECK(T_at(&solved, 4, 3, 3) == 1);
    solved_free(&solved);
    box_end(&box);
}

/* Whatever rounding makes of the places of voxels in the world. */
static void the_rule_holds_in_any_transform(void)
{
    static const char text[] = "{\"pellucid\": \"transfer-function/1\","
                               "\"isosurfaces\": [{\"value\": 5, \"opacity\": 0.75}]}";
    int wrong = 0;
    for (uint64_t seed = first_seed + 1; seed <= first_seed + 40; seed++) {
        Random r = {seed};
        Box box;
        Solved solved;
        box_begin(&box, text, N, true, false);
        VolGrid *grid = box.s.grid;
        for (int i = 0; i < 4; i++)
            for (int j = 0; j < 3; j++)
                grid->index_to_world.m[i][j] = (i == j ? 0.37 : 0) + random_in(&r, -0.1, 0.1) * (i == 3 ? 100 : 1);
        CHECK(vol_affine_invert(&grid->index_to_world, &grid->world_to_index));
        const double along = random_below(&r, 2) ? 1 : -1, y0 = random_in(&r, -0.2, 0.2), z0 = random_in(&r, -0.2, 0.2);
        VolVec3 way = vol_apply_linear(&grid->index_to_world, vol_vec3(along, y0, z0));
        const VolLight sun = {.kind = VOL_LIGHT_SUN, .direction = vol_scale(way, 1 / vol_length(way))};
        bool up = vol_apply_linear(&grid->world_to_index, sun.direction).x > 0;
        solve(&box.s.scene, &sun, 1, 1, &solved);
        for (int y = 4; y < 12; y++)
            for (int z = 4; z < 12; z++)
                wrong += !(fabs(T_at(&solved, 5, y, z) - (up ? 0.25 : 1)) < 1e-6);
        solved_free(&solved);
        box_end(&box);
    }
    if (wrong)
        FAIL("%d of %d voxels", wrong, 40 * 64);
}

static void what_is_opaque_stays_so(void)
{
    static const char text[] = "{\"pellucid\": \"transfer-function/1\", \"isosurfaces\": [{\"value\": 5, \"opacity\": 1}]}";
    const VolLight up = {.kind = VOL_LIGHT_SUN, .direction = {1, 0, 0}};
    Box box;
    Solved solved;
    box_begin(&box, text, N, true, false);
    solve(&box.s.scene, &up, 0, 1, &solved);
    CHECK(T_at(&solved, 4, 3, 3) == 1 && T_at(&solved, 5, 3, 3) == 0 && T_at(&solved, 6, 3, 3) == 0);
    solved_free(&solved);
    box_end(&box);
}

static void clip_planes_light_the_cut_face(void)
{
    const VolLight sun = {.kind = VOL_LIGHT_SUN, .direction = {1, 0, 0}};
    const VolClip clip = {{1, 0, 0}, 6.5};
    Box box;
    Solved solved;
    box_begin(&box, fog, N, false, false);
    box.s.scene.clips = &clip;
    box.s.scene.clip_count = 1;
    solve(&box.s.scene, &sun, 1, 1, &solved);
    for (int x = 0; x < N; x++)
        CHECK_NEAR(T_at(&solved, x, 3, 3), vol_exp(-extinction() * fmax(x - 6.5, 0)), 1e-6, 0);
    solved_free(&solved);
    box_end(&box);
}

/* Every corner of a cell that the cone enters is there; nothing far from it. */
static void a_spot_is_solved_where_it_shines(void)
{
    VolLight spot;
    Box box;
    VolLightLattice l;
    size_t beyond = 0;
    CHECK(!vol_light_parse("spot:-3,7,7,1,0.1,0,30", &spot, &err));
    box_begin(&box, fog, N, false, false);
    CHECK(!vol_light_lattice_new(&box.s.scene, &spot, 0, 1, &l, &err));
    for (int n = 0; n < 15 * 15 * 15 * 64; n++) {
        int cell = n / 64, part = n % 64;
        int32_t c[3] = {cell / 225, cell / 15 % 15, cell % 15};
        VolVec3 at = {c[0] + (part / 16) / 3.0, c[1] + (part / 4 % 4) / 3.0, c[2] + (part % 4) / 3.0};
        VolVec3 way = vol_sub(at, spot.position);
        if (vol_dot(way, spot.direction) < spot.cos_edge * vol_length(way))
            continue;
        for (int corner = 0; corner < 8; corner++)
            if (!lattice_has(&l, (const int32_t[3]){c[0] + (corner >> 2), c[1] + (corner >> 1 & 1),
                                                    c[2] + (corner & 1)}))
                FAIL("cell (%d, %d, %d)", c[0], c[1], c[2]);
    }
    for (int n = 0; n < N * N * N; n++)
        beyond += !lattice_has(&l, (const int32_t[3]){n / 256, n / 16 % 16, n % 16});
    CHECK(beyond > N * N * N / 4 && l.points == (uint64_t)(N * N * N - beyond));
    vol_light_lattice_free(&l);
    box_end(&box);
}

/* ---- Masks ---- */

/* Layer x of the box is of this kind where first <= x <= last; 1 elsewhere. */
static VolGrid *layers_of(int kind, int first, int last, double shift)
{
    VolGridSource source = {.box = true, .box_max = {N - 1, N - 1, N - 1},
                            .index_to_world = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {shift, 0, 0}}}};
    VolGridBuilder *builder;
    VolGrid *grid;
    if (vol_grid_begin(&source, &builder, &err))
        abort();
    for (int leaf = 0; leaf < 8; leaf++) {
        float values[512];
        uint64_t active[8];
        const int32_t origin[3] = {8 * (leaf >> 2), 8 * (leaf >> 1 & 1), 8 * (leaf & 1)};
        memset(active, 0xff, sizeof active);
        for (int i = 0; i < 512; i++)
            values[i] = origin[0] + i / 64 >= first && origin[0] + i / 64 <= last ? (float)kind : 1;
        if (vol_grid_leaf(builder, origin, values, NULL, active, &err))
            abort();
    }
    if (vol_grid_finish(builder, &grid, &err))
        abort();
    return grid;
}

static void solve_masked(Box *box, VolGrid *layers, const VolLight *light, int64_t resolution, Solved *out)
{
    VolLightMask mask;
    VolPrepared prepared;
    VolShadowCounts counts = {0};
    CHECK(!vol_light_mask_new(&box->s.scene, layers, 1, &mask, &err));
    VolScene scene = box->s.scene;
    if (mask.volume.kind)
        scene.volume = mask.volume;
    if (vol_light_lattice_new(&scene, light, resolution, 1, &out->lattice, &err) ||
        vol_scene_prepare(&scene, &prepared, &err))
        abort();
    out->T = malloc(out->lattice.leaf_count * VOL_LIGHT_LEAF_POINTS * sizeof *out->T);
    const VolShadow shadow = {&prepared, light, &out->lattice, &mask, 1, 1, out->T};
    CHECK(!vol_shadow_rays(&shadow, &counts, &err));
    vol_prepared_free(&prepared);
    vol_light_mask_free(&mask);
    vol_grid_free(layers);
}

/* Layers 5..8 are blank: cells from 4 to 9 are empty, and 6 and 7 too far from others to be solved for. */
static void blanks_attenuate_nothing(void)
{
    const VolLight sun = {.kind = VOL_LIGHT_SUN, .direction = {1, 0, 0}};
    Box box;
    Solved solved;
    box_begin(&box, fog, N, false, false);
    solve_masked(&box, layers_of(VOL_MASK_BLANK, 5, 8, 0), &sun, 0, &solved);
    for (int x = 0; x < N; x++)
        CHECK_NEAR(T_at(&solved, x, 3, 3),
                   x == 6 || x == 7 ? 1 : vol_exp(-extinction() * (fmin(x, 4) + fmax(x - 9, 0))), 1e-6, 0);
    solved_free(&solved);
    box_end(&box);
}

static void nothing_passes_occluders(void)
{
    const VolLight suns[] = {{.kind = VOL_LIGHT_SUN, .direction = {1, 0, 0}},
                             {.kind = VOL_LIGHT_SUN, .direction = {-1, 0, 0}}};
    for (int first = 0; first < N; first += 5)
        for (int n = 0; n < 2; n++) {
            Box box;
            Solved solved;
            box_begin(&box, fog, N, false, false);
            solve_masked(&box, layers_of(VOL_MASK_OCCLUDER, first, first, 0), &suns[n], 0, &solved);
            for (int x = 0; x < N; x++) {
                bool dark = n ? x <= first : x >= first;
                CHECK_NEAR(T_at(&solved, x, 3, 3), dark ? 0 : vol_exp(-extinction() * (n ? N - 1 - x : x)), 1e-6, 0);
            }
            solved_free(&solved);
            box_end(&box);
        }
}

static void a_mask_of_another_place_is_refused(void)
{
    Box box;
    VolLightMask mask;
    VolGrid *layers = layers_of(VOL_MASK_BLANK, 5, 8, 0.5);
    box_begin(&box, fog, N, false, false);
    CHECK(vol_light_mask_new(&box.s.scene, layers, 1, &mask, &err) == VOL_BAD_INPUT);
    vol_light_mask_free(&mask);
    vol_grid_free(layers);
    box_end(&box);
}

/* ---- Same input, same bytes ---- */

static void solve_with(RandomScene *s, VolCpu cpu, int threads, Solved *out)
{
    VolScene scene = s->scene;
    const VolLight point = {.kind = VOL_LIGHT_POINT, .position = {0.3, -2, 1}};
    scene.cpu = cpu;
    scene.layers = 0;
    scene.termination_opacity = vol_shadow_termination(1);
    solve(&scene, &point, 1, threads, out);
}

static void threads_and_levels_give_the_same_bytes(void)
{
    static const char *const names[] = {"avx2", "avx512", "neon"};
    for (uint64_t seed = first_seed + 1; seed <= first_seed + 20; seed++) {
        Random r = {seed};
        RandomScene s;
        Solved first, other;
        random_scene(&r, 0, &s);
        size_t values = 0;
        solve_with(&s, VOL_CPU_SCALAR, 1, &first);
        values = first.lattice.leaf_count * VOL_LIGHT_LEAF_POINTS * (size_t)vol_shadow_channels(&s.scene);
        for (int n = 0; n < 4; n++) {
            VolCpu cpu = VOL_CPU_SCALAR;
            if (n < 3 && vol_cpu_choose(names[n], &cpu, NULL))
                continue;
            solve_with(&s, cpu, n + 1, &other);
            if (memcmp(first.T, other.T, values * sizeof *first.T) != 0)
                FAIL("seed %llu, %s", (unsigned long long)seed, n < 3 ? names[n] : "threads");
            solved_free(&other);
        }
        solved_free(&first);
        random_scene_free(&s);
    }
}

/* The same voxels in a mirrored world, and the light mirrored with it. */
static void mirrored_worlds_have_mirrored_light(void)
{
    for (uint64_t seed = first_seed + 1; seed <= first_seed + 20; seed++) {
        Random r = {seed};
        RandomScene s;
        Solved solved[2];
        VolTfCompiled dark; /* shading would cut rays where its lights say */
        random_scene(&r, 0, &s);
        CHECK(!vol_tf_attenuation_of(s.scene.tf, &dark, &err));
        const double d[3] = {random_in(&r, -1, 1), random_in(&r, -1, 1), random_in(&r, -1, 1)}, h = random_in(&r, 0.1, 2);
        for (int octant = 0; octant < 8; octant++) {
            const double sign[3] = {octant & 1 ? -1 : 1, octant & 2 ? -1 : 1, octant & 4 ? -1 : 1};
            VolVec3 way = {sign[0] * d[0], sign[1] * d[1], sign[2] * d[2]};
            const VolLight sun = {.kind = VOL_LIGHT_SUN, .direction = vol_scale(way, 1 / vol_length(way))};
            s.grid->index_to_world = (VolAffine){{{sign[0] * h, 0, 0}, {0, sign[1] * h, 0}, {0, 0, sign[2] * h}, {0, 0, 0}}};
            CHECK(vol_affine_invert(&s.grid->index_to_world, &s.grid->world_to_index));
            VolScene scene = s.scene;
            scene.tf = &dark;
            scene.clip_count = scene.light_count = 0;
            scene.layers = 0;
            solve(&scene, &sun, 1, 1, &solved[octant > 0]);
            size_t values = solved[0].lattice.leaf_count * VOL_LIGHT_LEAF_POINTS * (size_t)vol_shadow_channels(&scene);
            if (octant && memcmp(solved[0].T, solved[1].T, values * sizeof(float)) != 0)
                FAIL("seed %llu, octant %d", (unsigned long long)seed, octant);
            if (octant)
                solved_free(&solved[1]);
        }
        solved_free(&solved[0]);
        vol_tf_compiled_free(&dark);
        random_scene_free(&s);
    }
}

/* ---- Hashes ---- */

static void volumes_have_one_hash_however_they_are_cut(void)
{
    Box leaves, tiles, other;
    uint64_t a[2], b[2], c[2], d[2];
    box_begin(&leaves, fog, N, false, false);
    box_begin(&tiles, fog, N, false, true);
    box_begin(&other, fog, N, true, false);
    CHECK(!vol_volume_hash(&leaves.s.scene.volume, 1, 1, a, &err) && !vol_volume_hash(&tiles.s.scene.volume, 1, 3, b, &err));
    CHECK(!vol_volume_hash(&other.s.scene.volume, 1, 1, c, &err) && !vol_volume_hash(&leaves.s.scene.volume, 2, 1, d, &err));
    CHECK(a[0] == b[0] && a[1] == b[1]);
    CHECK(a[0] != c[0] && a[0] != d[0]);
    box_end(&leaves);
    box_end(&tiles);
    box_end(&other);
}

static void hash_of(const char *list, uint64_t out[2])
{
    char text[400];
    VolTf tf;
    snprintf(text, sizeof text, "{\"pellucid\": \"transfer-function/1\", %s}", list);
    VolBytes bytes = {(unsigned char *)text, strlen(text)};
    if (vol_tf_parse(&bytes, "look", &tf, NULL, &err))
        abort();
    vol_tf_settle_step(&tf, 0, 1);
    CHECK(!vol_tf_attenuation_hash(&tf, out, &err));
    vol_tf_free(&tf);
}

static void transfer_functions_that_attenuate_alike_have_one_hash(void)
{
    static const char *const alike[] = {"\"scatter\": [[0, 0.5], [1, 0.7]]", "\"scatter\": [[0, 0.5, [1, 0, 0]], [1, 0.7]]",
                                        "\"scatter\": [[0, 0.5], [1, 0.7]], \"emit\": [[0, 1]]",
                                        "\"scatter\": [[0, 0.5], [1, 0.7]], \"phase\": {\"hg\": 0.5}"};
    static const char *const others[] = {"\"scatter\": [[0, 0.5], [1, 0.8]]", "\"absorb\": [[0, 0.5, [0, 0, 0]], [1, 0.7]]",
                                         "\"scatter\": [[0, 0.5], [1, 0.7]],"
                                         "\"isosurfaces\": [{\"value\": 1, \"opacity\": 0.5}]",
                                         "\"scatter\": [[0, 0.5], [1, 0.7]], \"transport\": [[0, [0.5, 0.5, 0.5]]]"};
    uint64_t first[2], hash[2];
    hash_of(alike[0], first);
    for (size_t i = 1; i < sizeof alike / sizeof *alike; i++) {
        hash_of(alike[i], hash);
        CHECK(hash[0] == first[0] && hash[1] == first[1]);
    }
    for (size_t i = 0; i < sizeof others / sizeof *others; i++) {
        hash_of(others[i], hash);
        CHECK(hash[0] != first[0]);
    }
}

/* What is left of a transfer function attenuates as it does, and sends nothing. */
static void what_attenuates_alone_attenuates_as_all_does(void)
{
    for (uint64_t seed = first_seed + 1; seed <= first_seed + SCENES; seed++) {
        Random r = {seed};
        RandomScene s;
        VolTfCompiled dark;
        VolPrepared bright_scene, dark_scene;
        VolRay rays[VOL_PACKET];
        VolRadiance all[VOL_PACKET], alone[VOL_PACKET];
        random_scene(&r, RANDOM_NO_PLATEAUS, &s);
        s.scene.precise = true;
        s.scene.termination_opacity = 1e-200;
        VolScene scene = s.scene;
        CHECK(!vol_tf_attenuation_of(s.scene.tf, &dark, &err));
        scene.tf = &dark;
        CHECK(!vol_scene_prepare(&s.scene, &bright_scene, &err) && !vol_scene_prepare(&scene, &dark_scene, &err));
        size_t count = random_packet(&r, &s, VOL_PACKET, rays);
        trace_rays(&bright_scene, rays, count, all);
        trace_rays(&dark_scene, rays, count, alone);
        for (size_t i = 0; i < count; i++)
            for (int c = 0; c < 3; c++) {
                CHECK_NEAR(vol_exp(-alone[i].optical_depth[c]), vol_exp(-all[i].optical_depth[c]), 1e-9, 1e-12);
                CHECK(alone[i].color[c] == 0);
            }
        vol_prepared_free(&bright_scene);
        vol_prepared_free(&dark_scene);
        vol_tf_compiled_free(&dark);
        random_scene_free(&s);
    }
}

int main(int argc, char **argv)
{
    first_seed = seed_before_first(argc, argv);
    RUN(points_lie_around_all_that_is_seen);
    RUN(the_outermost_points_lie_on_the_domain);
    RUN(fog_darkens_with_the_way);
    RUN(a_sun_along_an_axis_is_exact);
    RUN(a_light_inside_shines_around_it);
    RUN(a_voxel_at_an_isosurface_is_behind_it);
    RUN(the_rule_holds_in_any_transform);
    RUN(what_is_opaque_stays_so);
    RUN(clip_planes_light_the_cut_face);
    RUN(a_spot_is_solved_where_it_shines);
    RUN(blanks_attenuate_nothing);
    RUN(nothing_passes_occluders);
    RUN(a_mask_of_another_place_is_refused);
    RUN(threads_and_levels_give_the_same_bytes);
    RUN(mirrored_worlds_have_mirrored_light);
    RUN(volumes_have_one_hash_however_they_are_cut);
    RUN(transfer_functions_that_attenuate_alike_have_one_hash);
    RUN(what_attenuates_alone_attenuates_as_all_does);
    return test_end();
}
