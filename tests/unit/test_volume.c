/* What a volume tells of itself, against the grid that it is made of. */
#include <math.h>
#include <stdlib.h>

#include "volume/volume.h"
#include "tests/unit/random_scene.h"
#include "tests/unit/test.h"

enum { GRIDS = 100 };

static void corners_are_those_of_the_domain(void)
{
    for (uint64_t seed = 1; seed <= GRIDS; seed++) {
        Random r = {seed};
        RandomScene s = {0};
        VolVolume volume = vol_volume_of_grid(random_grid(&r, 0, &s));
        double lo[3], hi[3], longest = 0;
        int32_t first[3], last[3];
        vol_volume_domain(&volume, lo, hi);
        vol_volume_voxels(&volume, first, last);
        for (int n = 0; n < 8; n++) {
            VolVec3 corner = vol_volume_corner(&volume, n), index = vol_apply(vol_volume_to_index(&volume), corner);
            const double at[3] = {index.x, index.y, index.z};
            for (int a = 0; a < 3; a++) {
                CHECK_NEAR(at[a], n >> a & 1 ? hi[a] : lo[a], 1e-12, 1e-9);
                CHECK(lo[a] <= first[a] && hi[a] >= last[a]);
            }
            longest = fmax(longest, vol_length(vol_sub(vol_volume_corner(&volume, 7 - n), corner)));
        }
        CHECK(vol_volume_longest_way(&volume) <= longest * (1 + 1e-12));
        CHECK(vol_volume_voxel(&volume) == vol_affine_voxel(vol_volume_to_world(&volume)));
        CHECK(!vol_volume_is_empty(&volume));
        vol_volume_free(&volume);
        CHECK(volume.kind == VOL_VOLUME_NONE);
        vol_volume_free(&volume); /* of none */
    }
}

/* Nothing in a part lies outside its range, and together they make the volume's. */
static void ranges_of_parts_make_the_whole(void)
{
    for (uint64_t seed = 1; seed <= GRIDS; seed++) {
        Random r = {seed};
        RandomScene s = {0};
        VolVolume volume = vol_volume_of_grid(random_grid(&r, 0, &s));
        double least = INFINITY, most = -INFINITY, lo, hi;
        bool any = vol_volume_range(&volume, &lo, &hi);
        size_t parts = vol_volume_counts(&volume).parts;
        for (size_t n = volume.grid->domain == VOL_DOMAIN_BOX; n < parts; n++) { /* part 0: the background */
            double a, b;
            vol_volume_part_range(&volume, n, &a, &b);
            least = fmin(least, a);
            most = fmax(most, b);
        }
        CHECK(any == (least <= most) && (!any || (lo == least && hi == most)));
        vol_volume_free(&volume);
    }
}

/* Of doubles: a leaf, a tile beside it, and one that ends in both. */
static void parts_of_doubles_show_their_values(void)
{
    const VolGridSource source = {.index_to_world = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}, .box_max = {23, 7, 7},
                                  .as_double = true, .background = 0.1};
    VolGridBuilder *builder;
    VolGrid *grid;
    double values[512];
    uint64_t active[8];
    size_t seen[VOL_BRICK_VALUES + 1] = {0};
    memset(active, 255, sizeof active);
    for (int n = 0; n < 512; n++)
        values[n] = n;
    if (vol_grid_begin(&source, &builder, NULL) ||
        vol_grid_leaf(builder, (int32_t[3]){0, 0, 0}, NULL, values, active, NULL) ||
        vol_grid_tile(builder, (int32_t[3]){8, 0, 0}, 8, 1000, true, NULL) ||
        vol_grid_tile(builder, (int32_t[3]){16, 0, 0}, 8, 2000, true, NULL) || vol_grid_finish(builder, &grid, NULL))
        abort();
    VolVolume volume = vol_volume_of_grid(grid);
    CHECK(vol_volume_is_double(&volume));
    for (size_t part = 0; part < vol_volume_counts(&volume).parts; part++) {
        size_t count;
        double lo, hi;
        const double *v = vol_volume_part_values(&volume, part, &count);
        vol_volume_part_range(&volume, part, &lo, &hi);
        seen[count]++;
        for (size_t n = 0; n < count; n++)
            CHECK(v[n] >= lo && v[n] <= hi);
    }
    CHECK(seen[1] && seen[8] && seen[VOL_BRICK_VALUES] >= 1);
    vol_volume_free(&volume);
}

int main(void)
{
    RUN(corners_are_those_of_the_domain);
    RUN(ranges_of_parts_make_the_whole);
    RUN(parts_of_doubles_show_their_values);
    return test_end();
}
