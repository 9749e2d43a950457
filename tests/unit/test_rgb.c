/* RGB grids against scalar ones of their channels, and against the VDB that they come from. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "load/grids.h"
#include "volume/grid_internal.h"
#include "tests/unit/random_fields.h"
#include "tests/unit/vdb_help.h"

static VolStatus see_leaf(void *user, const int32_t origin[3], const float *floats, const double *doubles,
                          const uint64_t active[8], VolError *e)
{
    (void)user, (void)origin, (void)floats, (void)doubles, (void)active, (void)e;
    return VOL_OK;
}

static bool same(double a, double b) { return a == b || (isnan(a) && isnan(b)); }

/* ---- Against scalar grids ---- */

static void check_voxel(const RandomFields *f, const int32_t v[3])
{
    double rgb[3];
    vol_grid_voxel_rgb(f->rgb, v[0], v[1], v[2], rgb);
    for (int c = 0; c < 3; c++) {
        double want = vol_grid_voxel(f->channel[c], v[0], v[1], v[2]);
        if (!same(rgb[c], want))
            FAIL("voxel %d %d %d, channel %d: %g, want %g", v[0], v[1], v[2], c, rgb[c], want);
    }
}

/* The brick that holds a cell of the domain repeats all of the cell's corners, and knows their range. */
static void check_cell(const VolGrid *grid, const int32_t cell[3])
{
    const VolBrick *brick = &grid->bricks[vol_grid_brick_at(grid, cell[0], cell[1], cell[2])];
    for (int n = 0; n < 8; n++) {
        const int32_t v[3] = {cell[0] + (n >> 2), cell[1] + (n >> 1 & 1), cell[2] + (n & 1)};
        double rgb[3];
        vol_grid_voxel_rgb(grid, v[0], v[1], v[2], rgb);
        for (int c = 0; c < 3; c++) {
            double held = vol_grid_held(grid, brick, c, v[0] - (cell[0] & ~7), v[1] - (cell[1] & ~7), v[2] - (cell[2] & ~7));
            if (!same(held, rgb[c]))
                FAIL("voxel %d %d %d, channel %d: the brick holds %g for %g", v[0], v[1], v[2], c, held, rgb[c]);
            if (isfinite(held) ? held < brick->lo || held > brick->hi : !brick->invalid)
                FAIL("voxel %d %d %d, channel %d: %g outside %g to %g", v[0], v[1], v[2], c, held, brick->lo, brick->hi);
        }
    }
}

static void channels_are_scalar_grids(void)
{
    for (uint64_t seed = 1; seed <= 200; seed++) {
        Random r = {seed};
        RandomFields f;
        uint64_t bad = 0;
        random_fields(&r, seed % 2, &f);
        const VolGrid *grid = f.rgb;
        for (int32_t x = f.lo[0] - 2; x <= f.hi[0] + 2; x++)
            for (int32_t y = f.lo[1] - 2; y <= f.hi[1] + 2; y++)
                for (int32_t z = f.lo[2] - 2; z <= f.hi[2] + 2; z++) {
                    const int32_t v[3] = {x, y, z};
                    bool cell = true, voxel = true;
                    double rgb[3];
                    check_voxel(&f, v);
                    for (int a = 0; a < 3; a++) {
                        cell = cell && v[a] >= grid->cell_min[a] && v[a] <= grid->cell_max[a];
                        voxel = voxel && v[a] >= f.lo[a] && v[a] <= f.hi[a];
                    }
                    if (cell)
                        check_cell(grid, v);
                    vol_grid_voxel_rgb(grid, x, y, z, rgb);
                    bad += voxel && !(isfinite(rgb[0]) && isfinite(rgb[1]) && isfinite(rgb[2]));
                }
        CHECK(grid->bad_voxels == bad);
        fields_free(&f);
    }
}

/* A tile of a root, with tiles of nodes on and beside it and leaves where all of these meet. */
static void large_tiles_stay_single_values(void)
{
    enum { ROOT = 4096, NODE = 128 };
    const VolGridSource source = {.index_to_world = unit, .box_max = {ROOT + NODE - 1, ROOT + NODE - 1, ROOT - 1},
                                  .background_rgb = {0.25, 1, 0}};
    FieldBuilders to;
    RandomFields f = {.hi = {ROOT + NODE - 1, ROOT + NODE - 1, ROOT - 1}};
    Random r = {1};
    double color[3];
    fields_begin(&source, &to);
    random_color(&r, color);
    fields_tile(&to, (int32_t[3]){0, 0, 0}, ROOT, color, true);
    for (int n = 0; n < 4; n++) {
        random_color(&r, color);
        fields_tile(&to, (int32_t[3]){ROOT, n * NODE, 0}, NODE, color, true);
        random_leaf(&r, &f, (int32_t[3]){ROOT - 8 * (n & 1), ROOT - 8 * (n >> 1), NODE}, true, &to);
    }
    fields_finish(&to, &f);
    for (int n = 0; n < 4000; n++) {
        const int32_t near[4][3] = {{ROOT, ROOT, NODE}, {ROOT, NODE, NODE}, {ROOT, 2 * NODE, 0}, {2000, 2000, 2000}};
        int32_t v[3];
        for (int a = 0; a < 3; a++)
            v[a] = near[n % 4][a] + random_below(&r, 20) - 10;
        check_voxel(&f, v);
        if (v[2] >= 0)
            check_cell(f.rgb, v);
    }
    CHECK(f.rgb->stored_bricks < 100);
    fields_free(&f);
}

/* ---- From VDB ---- */

static int warnings;
static char last_warning[300];

static void hear(void *user, VolSeverity severity, const char *line)
{
    (void)user;
    warnings += severity == VOL_WARNING;
    snprintf(last_warning, sizeof last_warning, "%s", line);
}

/* A light of two leaves and a tile, one voxel of which is bad, and a scalar grid. */
static VolBytes lit_file(void)
{
    static const char *const names[] = {"light.0.indirect", "density"};
    VolVdbWriter *writer = new_writer(VOL_COMPRESS_ZIP);
    float values[3 * 512];
    uint64_t active[8];
    memset(active, 255, sizeof active);
    for (int n = 0; n < 3 * 512; n++)
        values[n] = (float)n / 512;
    values[30] = NAN;
    for (int g = 0; g < 2; g++) {
        const VolVdbNewGrid grid = {.name = names[g], .store = g ? VOL_STORE_FLOAT : VOL_STORE_VEC3S, .index_to_world = unit,
                                    .background = {g, 0.5, 0.25}};
        OK(vol_vdb_begin_grid(writer, &grid, &err));
        OK(vol_vdb_put_leaf(writer, (int32_t[3]){0, 0, 0}, values, active, &err));
        OK(vol_vdb_put_leaf(writer, (int32_t[3]){-8, 0, 0}, values, active, &err));
        OK(vol_vdb_put_tile(writer, (int32_t[3]){128, 0, 0}, 128, (double[3]){1, 2, 3}, true, &err));
        OK(vol_vdb_end_grid(writer, &err));
    }
    return finish(writer);
}

static void light_is_loaded_beside_the_volume(void)
{
    const VolLog log = {hear, NULL};
    VolBytes bytes = lit_file();
    for (int threads = 1; threads <= 4; threads += 3) {
        VolVdb *vdb = open_copy(&bytes);
        VolGrid *light = NULL, *again = NULL;
        VolVolume volume = {VOL_VOLUME_NONE};
        double rgb[3];
        warnings = 0;
        OK(vol_load_field(vdb, "light.0.indirect", threads, &log, &light, &err));
        CHECK(warnings == 1);
        CHECK(strstr(last_warning, "grid 'light.0.indirect': 2 voxels are NaN or infinite"));
        CHECK(light->is_rgb && light->active_voxels == 2 * 512 + 128 * 128 * 128 && light->stored_bricks < 100);
        vol_grid_voxel_rgb(light, 1, 2, 3, rgb);
        for (int c = 0; c < 3; c++)
            CHECK(rgb[c] == (double)(float)(3 * 83 + c) / 512);
        vol_grid_voxel_rgb(light, 200, 99, 5, rgb);
        CHECK(rgb[0] == 1 && rgb[1] == 2 && rgb[2] == 3);
        vol_grid_voxel_rgb(light, 64, 0, 0, rgb);
        CHECK(rgb[0] == 0 && rgb[1] == 0.5 && rgb[2] == 0.25);
        OK(vol_load_field(vdb, "density", threads, NULL, &again, &err)); /* scalar ones too */
        CHECK(!again->is_rgb && vol_grid_voxel(again, 1, 2, 3) == 83.0 / 512);
        OK(vol_load_volume(vdb, NULL, false, threads, NULL, &volume, &err));
        CHECK(volume.kind == VOL_VOLUME_GRID && vol_grid_voxel(volume.grid, 1, 2, 3) == 83.0 / 512);
        vol_volume_free(&volume);
        vol_grid_free(light);
        vol_grid_free(again);
        vol_vdb_close(vdb);
    }
    vol_bytes_free(&bytes);
}

static void other_kinds_are_refused(void)
{
    VolBytes bytes = lit_file();
    VolVdb *vdb = open_copy(&bytes);
    VolVolume volume;
    VolGrid *field;
    CHECK(vol_load_volume(vdb, "light.0.indirect", false, 1, NULL, &volume, &err) == VOL_BAD_INPUT);
    CHECK_TEXT(err.text, "grid 'light.0.indirect': it is of type Tree_vec3s_5_4_3, not a grid of scalars");
    CHECK(vol_load_field(vdb, "light.1.direct", 1, NULL, &field, &err) == VOL_BAD_INPUT);
    CHECK(strstr(err.text, "no grid 'light.1.direct'") && !field);
    vol_vdb_close(vdb);
    for (size_t i = 0; i + 16 < bytes.size; i++)
        if (memcmp(bytes.data + i, "Tree_vec3s_5_4_3", 16) == 0)
            bytes.data[i + 9] = 'i';
    vdb = open_copy(&bytes);
    CHECK(vol_load_field(vdb, "light.0.indirect", 1, NULL, &field, &err) == VOL_BAD_INPUT);
    CHECK_TEXT(err.text, "grid 'light.0.indirect': it is of type Tree_vec3i_5_4_3, not a grid of scalars or of vec3s");
    vol_vdb_close(vdb);
    vol_bytes_free(&bytes);
    const VolGridSource flat = {.is_rgb = true, .box_max = {1, 1, 1}};
    VolGridBuilder *builder;
    CHECK(vol_grid_begin(&flat, &builder, &err) == VOL_BAD_INPUT);
    CHECK(strstr(err.text, "singular"));
}

int main(void)
{
    RUN(channels_are_scalar_grids);
    RUN(large_tiles_stay_single_values);
    RUN(light_is_loaded_beside_the_volume);
    RUN(other_kinds_are_refused);
    return test_end();
}
