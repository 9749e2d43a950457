/* Light of all sources as one field: what is added up, and that it spreads by the symbol in any voxels. */
#include "base/fmath.h"
#include "light/pde.h"
#include "light/strength.h"
#include "tests/unit/random_scene.h"
#include "tests/unit/test.h"

static const double pi = 3.14159265358979323846;

enum { NX = 7, NY = 9, NZ = 12, COUNT = NX * NY * NZ };

/* Edges of 1, 0.5 and 2, turned. */
static const VolAffine turned = {{{0.8, 0.6, 0}, {-0.3, 0.4, 0}, {0, 0, -2}, {3, -1, 0.5}}};

/* A cosine mode of each channel, 0 and above; `light` shifts it. */
static VolStatus mode_row(void *user, size_t light, int32_t x, int32_t y, int thread, float *const t[3], VolError *err)
{
    (void)user, (void)thread, (void)err;
    for (int32_t z = 0; z < NZ; z++)
        for (int c = 0; c < 3; c++)
            t[c][z] = (float)(0.5 + 0.5 * vol_cos(pi * c * (x + 0.5) / NX) * vol_cos(pi * 2 * (y + 0.5) / NY) *
                                        vol_cos(pi * (double)(light + 1) * (z + 0.5) / NZ));
    return VOL_OK;
}

static VolStatus zero_or_half(void *user, size_t light, int32_t x, int32_t y, int thread, float *const t[3], VolError *err)
{
    (void)user, (void)light, (void)x, (void)y, (void)thread, (void)err;
    for (int32_t z = 0; z < NZ; z++)
        t[0][z] = t[1][z] = t[2][z] = z < 3 ? 0 : 0.5f;
    return VOL_OK;
}

static VolLight light_of(const char *spec)
{
    VolLight light;
    if (vol_light_parse(spec, &light, NULL))
        abort();
    return light;
}

static float totals[2][3][COUNT];

static VolPde pde_of(const VolLight *lights, size_t count, int which)
{
    return (VolPde){.index_to_world = turned, .n = {NX, NY, NZ}, .lights = lights, .light_count = count, .nearest = 0.25,
                    .absorption = 1, .transmittance = mode_row, .threads = 1,
                    .total = {totals[which][0], totals[which][1], totals[which][2]}};
}

static void solve(const VolPde *pde)
{
    VolError err;
    if (vol_pde_solve(pde, NULL, &err) != VOL_OK)
        FAIL("%s", err.text);
}

/* Whatever edges voxels have: s is D t over their square. */
static void test_symbol(void)
{
    const double edge[3] = {1, 0.5, 2}, spread[3] = {0.5, 3, 40};
    VolLight sun = light_of("sun:0,0,-1:1,2,3");
    VolPde pde = pde_of(&sun, 1, 0);
    memcpy(pde.spread, spread, sizeof spread);
    solve(&pde);
    for (int v = 0; v < COUNT; v++) {
        int x = v / NZ / NY, y = v / NZ % NY, z = v % NZ;
        for (int c = 0; c < 3; c++) {
            const int mode[3] = {c, 2, 1}, n[3] = {NX, NY, NZ};
            double below = 1, wave = vol_cos(pi * c * (x + 0.5) / NX) * vol_cos(pi * 2 * (y + 0.5) / NY) *
                                     vol_cos(pi * (z + 0.5) / NZ);
            for (int a = 0; a < 3; a++) {
                double sine = vol_sin(pi * mode[a] / 2 / n[a]);
                below += 4 * spread[c] / (edge[a] * edge[a]) * sine * sine;
            }
            CHECK_NEAR((double)totals[0][c][v], sun.rgb[c] * (0.5 + 0.5 * wave / below), 0, 2e-5 * sun.rgb[c]);
        }
    }
}

/* Without diffusion: sums over lights of RGB T and their fall-off; threads change nothing. */
static void test_sum(void)
{
    VolLight lights[3] = {light_of("sun:1,0,0:0.5,1,2"), light_of("point:0,0,0:3,2,1"),
                          light_of("spot:3,-1,9,0,0,-1,50:9,9,9")};
    VolPde pde = pde_of(lights, 3, 0);
    solve(&pde);
    pde = pde_of(lights, 3, 1);
    pde.threads = 3;
    solve(&pde);
    CHECK(memcmp(totals[0], totals[1], sizeof totals[0]) == 0);
    for (int v = 0; v < COUNT; v++) {
        VolVec3 place = vol_apply(&turned, vol_vec3(v / NZ / NY, v / NZ % NY, v % NZ));
        double want[3] = {0};
        for (size_t k = 0; k < 3; k++) {
            float t[3][NZ];
            mode_row(NULL, k, v / NZ / NY, v / NZ % NY, 0, (float *[3]){t[0], t[1], t[2]}, NULL);
            for (int c = 0; c < 3; c++)
                want[c] += lights[k].rgb[c] * vol_light_strength(&lights[k], place, 0.25) * (double)t[c][v % NZ];
        }
        for (int c = 0; c < 3; c++)
            CHECK_NEAR((double)totals[0][c][v], want[c], 1e-5, 1e-7);
    }
}

static void test_strength(void)
{
    VolLight point = light_of("point:1,2,3"), spot = light_of("spot:0,0,0,0,0,1,60");
    VolLight narrow = light_of("spot:0,0,0,0,0,1,0.001");
    CHECK_NEAR(vol_light_strength(&point, vol_vec3(1, 4, 3), 0.5), 0.25, 1e-15, 0);
    CHECK_NEAR(vol_light_strength(&point, vol_vec3(1, 2, 3.1), 0.5), 4, 1e-15, 0);
    CHECK_NEAR(vol_light_strength(&point, vol_vec3(1, 2, 3), 0.5), 4, 1e-15, 0);
    CHECK_NEAR(vol_light_strength(&spot, vol_vec3(0, 0, 2), 0.5), 0.25, 1e-15, 0);
    CHECK(vol_light_strength(&spot, vol_vec3(2, 0, 2), 0.5) == 0);
    CHECK(vol_light_strength(&spot, vol_vec3(0, 0, -2), 0.5) == 0);
    double middle = vol_spot_profile(&narrow, vol_vec3(vol_tan(0.95 * 0.0005 * pi / 180), 0, 1));
    CHECK(middle > 0.4 && middle < 0.6);
}

static void test_absorption(void)
{
    VolLight sun = light_of("sun:0,0,-1");
    const double s[] = {0, 0.3, 1, 3};
    for (int i = 0; i < 4; i++) {
        VolPde pde = pde_of(&sun, 1, 0);
        pde.transmittance = zero_or_half;
        pde.absorption = s[i];
        solve(&pde);
        for (int v = 0; v < COUNT; v++)
            CHECK_NEAR((double)totals[0][1][v], v % NZ < 3 ? 0 : vol_pow(0.5, s[i]), 1e-6, 0);
    }
}

/* Occluders are dark, blanks keep what crosses them, and neither exchanges anything. */
static void test_medium(void)
{
    uint8_t medium[COUNT];
    VolLight sun = light_of("sun:0,0,-1:1,2,3");
    for (int v = 0; v < COUNT; v++) {
        int y = v / NZ % NY;
        medium[v] = y == 4 ? VOL_MEDIUM_OCCLUDER : y == 5 ? VOL_MEDIUM_BLANK : VOL_MEDIUM_INSIDE;
    }
    for (int preview = 0; preview < 2; preview++) {
        VolPde before = pde_of(&sun, 1, 0), after = pde_of(&sun, 1, 1);
        before.medium = after.medium = medium;
        after.preview = preview;
        after.spread[0] = after.spread[1] = after.spread[2] = 3;
        solve(&before);
        solve(&after);
        double sum[2][2] = {{0}};
        for (int v = 0; v < COUNT; v++) {
            if (medium[v] == VOL_MEDIUM_INSIDE)
                for (int which = 0; which < 2; which++)
                    sum[which][v / NZ % NY > 4] += (double)totals[which][2][v];
            else
                CHECK(totals[1][2][v] == totals[0][2][v] && (medium[v] == VOL_MEDIUM_BLANK || totals[0][2][v] == 0));
        }
        for (int side = 0; side < 2; side++)
            CHECK_NEAR(sum[1][side], sum[0][side], 1e-5, 0);
    }
}

static void test_sheared(void)
{
    VolLight sun = light_of("sun:0,0,-1");
    VolPde pde = pde_of(&sun, 1, 0);
    VolError err;
    pde.index_to_world.m[0][2] += 0.01;
    CHECK(vol_pde_solve(&pde, NULL, &err) == VOL_USAGE);
    CHECK_TEXT(err.text, "--method pde: the volume's axes are not orthogonal");
}

/* ---- As printed ---- */

/* A box of n^3 voxels of one value. */
static VolGrid *constant_box(int n, double value)
{
    VolGridSource source = {.box = true, .box_max = {n - 1, n - 1, n - 1}, .background = value,
                            .index_to_world = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, 0}}}};
    VolGridBuilder *builder;
    VolGrid *grid;
    if (vol_grid_begin(&source, &builder, NULL) || vol_grid_finish(builder, &grid, NULL))
        abort();
    return grid;
}

/* Along an axis T = (1 + S sigma h)^-k, but for the first and last voxel, half of which lies in the domain; relaxed, all
 * come nearer to each other. */
static void test_as_printed(void)
{
    enum { N = 9 };
    const char *text = "{\"pellucid\": \"transfer-function/1\", \"scatter\": [[0, 0.4]], "
                       "\"absorb\": [[0, 0.5, [1, 0.5, 0]]]}";
    VolBytes bytes = {(unsigned char *)(uintptr_t)text, strlen(text)};
    VolTf tf;
    VolTfCompiled compiled;
    VolLight sun = light_of("sun:0,0,1:1,1,2");
    static float out[3][N * N * N];
    double before[3][2];
    if (vol_tf_parse(&bytes, "test", &tf, NULL, NULL) || vol_tf_compile(&tf, NULL, &compiled, NULL))
        abort();
    VolScene scene = {.volume = vol_volume_of_grid(constant_box(N, 0.5)), .tf = &compiled};
    for (int sweeps = 0; sweeps < 21; sweeps += 20) {
        VolPde pde = {.index_to_world = scene.volume.grid->index_to_world, .n = {N, N, N}, .lights = &sun,
                      .light_count = 1, .absorption = 2, .spread = {1, 1, 1}, .scene = &scene, .sweeps = sweeps,
                      .threads = 2,
                      .total = {out[0], out[1], out[2]}};
        solve(&pde);
        const double left[3] = {0.6, 0.6 * (1 - 0.5 * 0.5), 0.6 * 0.5};
        for (int v = 0; v < N * N * N; v++)
            for (int c = 0; c < 3 && !sweeps; c++) {
                double sigma = -2 * vol_log(left[c]);
                double ends = (1 + sigma / 2) * (v % N == N - 1 ? (1 + sigma / 2) / (1 + sigma) : 1);
                CHECK_NEAR((double)out[c][v], sun.rgb[c] / ends / vol_pow(1 + sigma, v % N), 1e-5, 0);
            }
        for (int c = 0; c < 3; c++) {
            double first = (double)out[c][0], last = (double)out[c][N - 1];
            CHECK(!sweeps || (first < before[c][0] && last > before[c][1] && first > last));
            before[c][0] = first;
            before[c][1] = last;
        }
    }
    vol_grid_free(scene.volume.grid);
    vol_tf_compiled_free(&compiled);
    vol_tf_free(&tf);
}

int main(void)
{
    RUN(test_symbol);
    RUN(test_sum);
    RUN(test_strength);
    RUN(test_absorption);
    RUN(test_medium);
    RUN(test_sheared);
    RUN(test_as_printed);
    return test_end();
}
