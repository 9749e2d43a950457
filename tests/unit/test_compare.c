/* The comparator is what guards every other test: so it is tested for saying no. */
#include <stdlib.h>

#include "compare/compare.h"
#include "tests/unit/test.h"

static VolError err;
static const VolTolerance exact;

/* ---- Images ---- */

static VolImage image_of(int width, int height, float value)
{
    VolImage image = {0};
    VolPart *part;
    VolChannel *channel;
    VolBox2 box = {0, 0, width - 1, height - 1};
    CHECK(!vol_image_add_part(&image, NULL, box, box, &part, &err));
    CHECK(!vol_part_add_channel(part, "Y", VOL_PIXEL_FLOAT, &channel, &err));
    for (int i = 0; i < width * height; i++)
        channel->data[i] = value;
    return image;
}

static float *pixels(VolImage *image) { return image->parts[0].channels[0].data; }

/* Whether they differ, and whether the report has this text. */
static bool differ(const VolImage *a, const VolImage *b, VolTolerance tolerance, const char *text)
{
    VolReport report = {0};
    CHECK(!vol_compare_images(a, b, &tolerance, &report, NULL, &err));
    bool different = report.different;
    CHECK(!vol_bytes_append(&report.text, &report.capacity, "", 1, &err));
    if (text && !strstr((char *)report.text.data, text))
        FAIL("no '%s' in '%s'", text, (char *)report.text.data);
    CHECK(different == (report.text.size > 1));
    vol_report_free(&report);
    return different;
}

static void test_equal(void)
{
    VolImage a = image_of(4, 3, 0.5F), b = image_of(4, 3, 0.5F);
    CHECK(!differ(&a, &b, exact, NULL));
    pixels(&a)[0] = 0.0F;
    pixels(&b)[0] = -0.0F;
    CHECK(!differ(&a, &b, exact, NULL));
    pixels(&b)[7] = nextafterf(0.5F, 1);
    CHECK(differ(&a, &b, exact, "channel 'Y': max 5.96046448e-08 at 3,1 (0.5 and 0.50000006)"));
    CHECK(differ(&a, &b, exact, "1 of 12 values differ"));
    vol_image_free(&a);
    vol_image_free(&b);
}

/* Whole numbers that no float tells apart. */
static void test_whole_numbers(void)
{
    VolImage images[2];
    for (int i = 0; i < 2; i++) {
        images[i] = image_of(1, 1, 16777216);
        VolChannel *channel = &images[i].parts[0].channels[0];
        channel->store = VOL_PIXEL_UINT;
        channel->whole = malloc(sizeof *channel->whole);
        channel->whole[0] = 16777216 + (uint32_t)i;
    }
    CHECK(differ(&images[0], &images[1], exact, "channel 'Y': max 1 at 0,0 (16777216 and 16777217)"));
    CHECK(!differ(&images[1], &images[1], exact, NULL));
    vol_image_free(&images[0]);
    vol_image_free(&images[1]);
}

/* Neither NaN nor infinities are the same as anything, whatever the bounds. */
static void test_not_finite(void)
{
    const float bad[] = {NAN, -NAN, INFINITY, -INFINITY};
    const VolTolerance tolerances[] = {{0}, {.max_given = true, .max = 1e30}, {.rms_given = true, .rms = 1e30},
                                       {.rel_given = true, .rel = 1e30},
                                       {.max_given = true, .max = INFINITY, .rel_given = true, .rel = INFINITY,
                                        .rms_given = true, .rms = INFINITY}};
    for (int i = 0; i < 4; i++)
        for (int t = 0; t < 5; t++) {
            VolImage a = image_of(4, 4, bad[i]), b = image_of(4, 4, bad[i]), c = image_of(4, 4, 0.5F);
            CHECK(differ(&a, &a, tolerances[t], "16 not finite, the first at 0,0"));
            CHECK(differ(&a, &b, tolerances[t], NULL));
            CHECK(differ(&a, &c, tolerances[t], NULL));
            CHECK(differ(&c, &a, tolerances[t], NULL));
            vol_image_free(&b);
            b = image_of(4, 4, 0.5F);
            pixels(&b)[9] = bad[i];
            CHECK(differ(&b, &c, tolerances[t], "1 not finite, the first at 1,2"));
            CHECK(!differ(&c, &c, tolerances[t], NULL));
            vol_image_free(&a);
            vol_image_free(&b);
            vol_image_free(&c);
        }
}

static void test_bounds(void)
{
    VolImage a = image_of(10, 10, 1), b = image_of(10, 10, 1);
    pixels(&b)[0] = 1.25F; /* max 0.25, rel 0.2, rms 0.025 */
    CHECK(!differ(&a, &b, (VolTolerance){.max_given = true, .max = 0.25}, NULL));
    CHECK(differ(&a, &b, (VolTolerance){.max_given = true, .max = 0.2499}, "1 of 100 values beyond the bounds"));
    CHECK(!differ(&a, &b, (VolTolerance){.rel_given = true, .rel = 0.2}, NULL));
    CHECK(differ(&a, &b, (VolTolerance){.rel_given = true, .rel = 0.1999}, NULL));
    CHECK(!differ(&a, &b, (VolTolerance){.rms_given = true, .rms = 0.025}, NULL));
    CHECK(differ(&a, &b, (VolTolerance){.rms_given = true, .rms = 0.0249}, NULL));
    /* either of max and rel is enough; rms must hold besides */
    CHECK(!differ(&a, &b, (VolTolerance){.max_given = true, .max = 0.01, .rel_given = true, .rel = 0.2}, NULL));
    CHECK(!differ(&a, &b, (VolTolerance){.max_given = true, .max = 0.25, .rel_given = true, .rel = 0.01}, NULL));
    CHECK(differ(&a, &b, (VolTolerance){.max_given = true, .max = 1, .rms_given = true, .rms = 0.01}, "rms 0.025"));
    CHECK(differ(&a, &b, (VolTolerance){.max_given = true, .max = 0.1, .rms_given = true, .rms = 1}, NULL));
    pixels(&b)[0] = -1;
    CHECK(!differ(&a, &b, (VolTolerance){.max_given = true, .max = 2}, NULL));
    CHECK(differ(&a, &b, (VolTolerance){.rel_given = true, .rel = 1.99}, NULL));
    CHECK(differ(&a, &b, (VolTolerance){.max_given = true, .max = 0}, NULL));
    vol_image_free(&a);
    vol_image_free(&b);
}

static void test_image_structure(void)
{
    VolImage a = image_of(4, 4, 1), b = image_of(4, 4, 1), c = image_of(4, 5, 1);
    VolChannel *channel;
    VolTolerance loose = {.max_given = true, .max = 1e9};
    CHECK(differ(&a, &c, loose, "data window: (0,0)-(3,3) and (0,0)-(3,4)"));
    CHECK(!vol_part_add_channel(&b.parts[0], "A", VOL_PIXEL_FLOAT, &channel, &err));
    CHECK(differ(&a, &b, loose, "channel 'A': only in the second"));
    CHECK(differ(&b, &a, loose, "channel 'A': only in the first"));
    vol_image_free(&b);
    b = image_of(4, 4, 1);
    b.parts[0].display_window.x1 = 9;
    CHECK(differ(&a, &b, loose, "display window: (0,0)-(3,3) and (0,0)-(9,3)"));
    b.parts[0].display_window.x1 = 3;
    CHECK(!vol_part_set_text(&b.parts[0], "vol:history", "another", &err));
    CHECK(!differ(&a, &b, exact, NULL)); /* headers are not compared */
    VolPart *part;
    CHECK(!vol_image_add_part(&b, "extra", (VolBox2){0, 0, 1, 1}, (VolBox2){0, 0, 1, 1}, &part, &err));
    CHECK(differ(&a, &b, loose, "part 'extra': only in the second"));
    vol_image_free(&a);
    vol_image_free(&b);
    vol_image_free(&c);
}

static void test_difference_image(void)
{
    VolImage a = image_of(2, 2, 1), b = image_of(2, 2, 1), difference;
    VolReport report = {0};
    pixels(&b)[1] = 0.25F;
    pixels(&b)[2] = NAN;
    CHECK(!vol_compare_images(&a, &b, &exact, &report, &difference, &err));
    CHECK(difference.part_count == 1);
    const float *d = pixels(&difference);
    CHECK(d[0] == 0 && d[1] == 0.75F && isnan(d[2]) && d[3] == 0);
    vol_image_free(&a);
    vol_image_free(&b);
    vol_image_free(&difference);
    vol_report_free(&report);
}

/* ---- Grids ---- */

typedef struct Recipe {
    VolVdbStore store;
    double background;
    double shift;         /* of the transform */
    bool as_tile;         /* the cube at 0,0,0 as a tile, else as a leaf of the same values */
    bool second_leaf;     /* at 128,0,0 */
    bool large_tile;      /* a tile of 128 instead of all that */
    bool inactive_voxel;  /* voxel 0,0,0 is not active */
    double value, odd;    /* of the cube; of its voxel 1,2,3, if not a tile */
    const char *name;
} Recipe;

static VolVdbSide make_grid(Recipe recipe)
{
    VolVdbSide side = {0};
    VolVdbWriter *writer;
    VolBytes bytes;
    VolVdb *vdb;
    VolVdbNewGrid grid = {.name = recipe.name ? recipe.name : "density", .store = recipe.store,
                          .background = {recipe.background, recipe.background, recipe.background},
                          .index_to_world = {{{0.5, 0, 0}, {0, 0.5, 0}, {0, 0, 0.5}, {recipe.shift, 0, 0}}}};
    bool fail = vol_vdb_writer_new(VOL_COMPRESS_NONE, &writer, &err) || vol_vdb_begin_grid(writer, &grid, &err);
    float values[512 * 3];
    size_t components = recipe.store == VOL_STORE_VEC3S ? 3 : 1, odd = 1 * 64 + 2 * 8 + 3;
    uint64_t active[8];
    memset(active, 0xff, sizeof active);
    for (size_t i = 0; i < 512 * components; i++)
        values[i] = (float)recipe.value;
    const int32_t origin[3] = {0, 0, 0}, beyond[3] = {128, 0, 0};
    const double constant[3] = {recipe.value, recipe.value, recipe.value};
    if (!fail && recipe.second_leaf)
        fail = vol_vdb_put_leaf(writer, beyond, values, active, &err);
    values[odd * components] = (float)recipe.odd;
    active[0] &= ~(uint64_t)recipe.inactive_voxel;
    if (!fail && recipe.large_tile)
        fail = vol_vdb_put_tile(writer, origin, 128, constant, true, &err);
    else if (!fail)
        fail = recipe.as_tile ? vol_vdb_put_tile(writer, origin, 8, constant, true, &err)
                              : vol_vdb_put_leaf(writer, origin, values, active, &err);
    fail = fail || vol_vdb_end_grid(writer, &err) || vol_vdb_finish(writer, &bytes, &err);
    if (!fail) {
        side.bytes = bytes.data;
        fail = vol_vdb_open(bytes, "test", &vdb, &err);
        side.vdb = vdb;
    }
    if (fail)
        FAIL("%s", err.text);
    vol_vdb_writer_free(writer);
    return side;
}

static bool grids_differ(Recipe a, Recipe b, VolTolerance tolerance, const char *text)
{
    VolVdbSide side_a = make_grid(a), side_b = make_grid(b);
    VolReport report = {0};
    if (!side_a.vdb || !side_b.vdb)
        return false;
    if (vol_compare_grids(side_a, side_b, &tolerance, &report, &err))
        FAIL("%s", err.text);
    bool different = report.different;
    CHECK(!vol_bytes_append(&report.text, &report.capacity, "", 1, &err));
    if (text && !strstr((char *)report.text.data, text))
        FAIL("no '%s' in '%s'", text, (char *)report.text.data);
    vol_report_free(&report);
    vol_vdb_close((VolVdb *)(uintptr_t)side_a.vdb);
    vol_vdb_close((VolVdb *)(uintptr_t)side_b.vdb);
    return different;
}

static const Recipe plain = {.value = 0.5, .odd = 0.5};

static void test_grid_values(void)
{
    Recipe odd = plain;
    odd.odd = 0.75;
    CHECK(!grids_differ(plain, plain, exact, NULL));
    CHECK(!grids_differ(odd, odd, exact, NULL));
    CHECK(grids_differ(plain, odd, exact, "grid 'density': max 0.25 at 1,2,3 (0.5 and 0.75), rms"));
    CHECK(grids_differ(odd, plain, exact, "1 of 512 values differ"));
    CHECK(!grids_differ(plain, odd, (VolTolerance){.max_given = true, .max = 0.25}, NULL));
    CHECK(!grids_differ(plain, odd, (VolTolerance){.rms_given = true, .rms = 0.25}, NULL));
    odd.odd = (double)NAN;
    CHECK(grids_differ(odd, odd, exact, "1 not finite, the first at 1,2,3"));
    CHECK(grids_differ(odd, odd, (VolTolerance){.max_given = true, .max = 1e30}, NULL));
    Recipe vector = odd;
    vector.store = VOL_STORE_VEC3S;
    vector.odd = 0.5;
    CHECK(!grids_differ(vector, vector, exact, NULL));
    Recipe other = vector;
    other.odd = 1;
    CHECK(grids_differ(vector, other, exact, "1 of 1536 values differ"));
}

/* The same function as leaf or as tile is the same; any change in either shows. */
static void test_grid_topology(void)
{
    Recipe tile = plain, wrong = plain, leaves = plain;
    tile.as_tile = true;
    CHECK(!grids_differ(plain, tile, exact, NULL));
    CHECK(!grids_differ(tile, plain, exact, NULL));
    CHECK(!grids_differ(tile, tile, exact, NULL));
    wrong.odd = 2;
    CHECK(grids_differ(wrong, tile, exact, "max 1.5 at 1,2,3 (2 and 0.5)"));
    CHECK(grids_differ(tile, wrong, exact, "max 1.5 at 1,2,3 (0.5 and 2)"));
    wrong = tile;
    wrong.value = 0.625;
    CHECK(grids_differ(tile, wrong, exact, "max 0.125 at 0,0,0 (0.5 and 0.625), rms 0.125, 512 of 512 values differ"));
    leaves.second_leaf = true;
    CHECK(grids_differ(plain, leaves, exact, "active voxels: 512 and 1024"));
    CHECK(grids_differ(plain, leaves, exact, "max 0.5 at 128,0,0 (0 and 0.5)"));
    CHECK(grids_differ(leaves, tile, exact, "active box: (0,0,0)-(135,7,7) and (0,0,0)-(7,7,7)"));
    CHECK(grids_differ(leaves, tile, exact, "512 voxels active in one alone, the first at 128,0,0"));
}

/* A tile of 128 against a finer tree: every voxel is compared once. */
static void test_grid_large_tiles(void)
{
    Recipe large = plain, small = plain, other = plain;
    large.large_tile = true;
    CHECK(!grids_differ(large, large, exact, NULL));
    for (int tile = 0; tile < 2; tile++) {
        small.as_tile = tile;
        CHECK(grids_differ(large, small, exact, "2096640 of 2097152 values differ"));
        CHECK(grids_differ(large, small, exact, "2096640 voxels active in one alone"));
        CHECK(grids_differ(small, large, exact, "2096640 of 2097152 values differ"));
        other = small;
        other.value = 0.25;
        CHECK(grids_differ(large, other, exact, tile ? "2097152 of 2097152 values" : "2097151 of 2097152 values"));
        CHECK(grids_differ(other, large, exact, tile ? "2097152 of 2097152 values" : "2097151 of 2097152 values"));
    }
    other = large;
    other.value = 0.25;
    CHECK(grids_differ(large, other, exact, "max 0.25 at 0,0,0 (0.5 and 0.25), rms 0.25, 2097152 of 2097152 values differ"));
}

static void test_grid_structure(void)
{
    VolTolerance loose = {.max_given = true, .max = 1e9};
    Recipe other = plain;
    other.background = 1;
    CHECK(grids_differ(plain, other, exact, "background: 0 and 1"));
    other = plain;
    other.shift = 1e-9;
    CHECK(grids_differ(plain, other, loose, "transform: row 3, column 0 is 0 and "));
    other = plain;
    other.store = VOL_STORE_DOUBLE;
    CHECK(grids_differ(plain, other, loose, "type: 'Tree_float_5_4_3' and 'Tree_double_5_4_3'"));
    other = plain;
    other.store = VOL_STORE_HALF; /* only how it is stored */
    CHECK(!grids_differ(plain, other, exact, NULL));
    other = plain;
    other.inactive_voxel = true;
    CHECK(grids_differ(plain, other, loose, "active voxels: 512 and 511"));
    CHECK(grids_differ(other, plain, loose, "1 voxels active in one alone, the first at 0,0,0"));
    other = plain;
    other.name = "heat";
    CHECK(grids_differ(plain, other, loose, "grid 'density': only in the first"));
    CHECK(grids_differ(plain, other, loose, "grid 'heat': only in the second"));
}

int main(void)
{
    RUN(test_equal);
    RUN(test_whole_numbers);
    RUN(test_not_finite);
    RUN(test_bounds);
    RUN(test_image_structure);
    RUN(test_difference_image);
    RUN(test_grid_values);
    RUN(test_grid_topology);
    RUN(test_grid_large_tiles);
    RUN(test_grid_structure);
    return test_end();
}
