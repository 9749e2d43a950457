/* Tables as EXR: there and back, what is refused, and how fast volumes change. */
#include "test.h"

#include <stdint.h>
#include <stdlib.h>

#include "io/exr.h"
#include "load/tables.h"
#include "tf/write.h"
#include "volume/volume.h"

static const char json[] =
    "{\"pellucid\": \"transfer-function/1\", \"particle_step\": 0.25,\n"
    " \"surface\": [[0, 0.1, [1, 0, 0]], [0.5, 0.5, [0, 1, 0]], [1, 0.2, [0, 0, 1]]],\n"
    " \"scatter\": [[0, 0.5, [0, 0, 1]], [0.5, 0.2, [1, 1, 0]], [1.5, 0.6, [1, 0, 1]]], \"emit\": [[0, 0.1], [1, 0.4]],\n"
    " \"absorb\": [[0, 0.3, [1, 0.5, 0.2]]], \"isosurfaces\": [{\"value\": 0.7, \"opacity\": 1}]}\n";

static const char grey[] = "{\"pellucid\": \"transfer-function/1\", \"scatter\": [[0, 0.5], [1, 0.2]]}";

static VolTables *build(const char *text, VolPreintOptions options)
{
    VolTables *tables = NULL;
    VolError err = {{0}};
    if (options.change == 0)
        options.change = INFINITY;
    if (vol_tables_build(text, "test", options, NULL, &tables, &err))
        FAIL("%s", err.text);
    return tables;
}

static VolImage image_of(const VolTables *tables, unsigned parts)
{
    VolImage image, back;
    VolBytes bytes;
    VolError err = {{0}};
    if (vol_tables_to_image(tables, parts, &image, &err) || vol_exr_write(&image, VOL_EXR_ZIP, 1, &bytes, NULL, &err) ||
        vol_exr_read(&bytes, "test.exr", &back, &err))
        FAIL("%s", err.text);
    vol_bytes_free(&bytes);
    vol_image_free(&image);
    return back;
}

enum { ALL = VOL_TABLES_TF | VOL_TABLES_INTEGRALS | VOL_TABLES_FULL };

static void check_same(const VolTables *a, const VolTables *b)
{
    CHECK_TEXT(b->json, a->json);
    CHECK(a->preint.n == b->preint.n && a->preint.lo == b->preint.lo && a->preint.hi == b->preint.hi);
    CHECK(a->preint.octave_count == b->preint.octave_count);
    for (size_t o = 0; o < a->preint.octave_count; o++) {
        const VolPreintTable *s = &a->preint.octaves[o], *t = &b->preint.octaves[o];
        CHECK(s->step == t->step && s->band == t->band);
        for (size_t i = 0; i < a->preint.n; i++)
            for (size_t j = 0; j < a->preint.n; j++)
                if (vol_preint_in_band(s, i, j))
                    CHECK(memcmp(vol_preint_entry(&a->preint, s, i, j), vol_preint_entry(&b->preint, t, i, j),
                                 a->preint.floats * sizeof(float)) == 0);
    }
}

static void test_there_and_back(void)
{
    static const VolPreintOptions cases[] = {{.n = 20, .octaves = 3, .threads = 1},
                                             {.n = 33, .octaves = 2, .step = 0.1, .lo = -0.1, .hi = 0.9, .threads = 2},
                                             {.n = 40, .octaves = 2, .change = 0.1, .threads = 1}};
    for (int k = 0; k < 6; k++) {
        VolTables *tables = build(k < 3 ? json : grey, cases[k % 3]), *back = NULL;
        VolImage image = image_of(tables, ALL);
        VolError err = {{0}};
        if (vol_tables_from_image(&image, "test.exr", NULL, &back, &err))
            FAIL("%s", err.text);
        else
            check_same(tables, back);
        vol_image_free(&image);
        vol_tables_free(back);
        vol_tables_free(tables);
    }
}

/* Value at (x, y) of a channel that must be there. */
static double pixel(const VolImage *image, const char *part, const char *channel, size_t x, size_t y)
{
    for (size_t p = 0; p < image->part_count; p++)
        if (strcmp(image->parts[p].name, part) == 0) {
            const VolChannel *found = vol_part_channel(&image->parts[p], channel);
            if (found)
                return (double)found->data[y * vol_box2_width(image->parts[p].data_window) + x];
        }
    FAIL("no channel %s in part %s", channel, part);
    return NAN;
}

static double integral(const VolImage *image, const char *channel, size_t i)
{
    char residual[32];
    snprintf(residual, sizeof residual, "%s.lo", channel);
    return pixel(image, "integrals", channel, i, 0) + pixel(image, "integrals", residual, i, 0);
}

static void test_layout(void)
{
    VolTables *tables = build(json, (VolPreintOptions){.n = 17, .octaves = 2, .threads = 1});
    VolImage image = image_of(tables, ALL);
    VolTfSample s;
    VolTfIntegral sum;
    VolPreintSegment seg;
    CHECK(image.part_count == 4 && strcmp(image.parts[3].name, "full@2") == 0);
    CHECK(tables->preint.octaves[0].step == 0.25); /* the particle_step */
    for (size_t i = 0; i < 17; i++) {
        double v = 1.5 * (double)i / 16;
        vol_tf_sample(&tables->compiled, v, &s);
        CHECK_NEAR(pixel(&image, "tf", "mu_s", i, 0), s.surface, 1e-7, 0);
        CHECK_NEAR(pixel(&image, "tf", "c_s.G", i, 0), s.surface_color[1], 1e-7, 0);
        CHECK_NEAR(pixel(&image, "tf", "mu_p.B", i, 0), s.particle[2], 1e-7, 0);
        CHECK_NEAR(pixel(&image, "tf", "q_p.R", i, 0), s.source[0], 1e-7, 0);
        vol_tf_integrals_between(&tables->preint.integrals, 0, v, &sum);
        CHECK_NEAR(integral(&image, "M_s", i), sum.surface, 0x1p-47, 0);
        CHECK_NEAR(integral(&image, "C_p.R", i), sum.source[0], 0x1p-47, 0);
        CHECK_NEAR(integral(&image, "M_p.G", i), sum.particle[1], 0x1p-47, 0);
        CHECK_NEAR(integral(&image, "V", i), sum.value, 0x1p-47, 0);
    }
    vol_preint_segment(&tables->compiled, 1.5 * 3 / 16, 1.5 * 11 / 16, 0.5, &seg); /* v0 along x, v1 along y */
    CHECK_NEAR(pixel(&image, "full@2", "fw_a.R", 3, 11), seg.fw_a[0], 0, 1e-5);
    CHECK_NEAR(pixel(&image, "full@2", "bw_c.G", 3, 11), seg.bw_c[1], 0, 1e-5);
    CHECK_NEAR(pixel(&image, "full@2", "p_c.B", 3, 11), seg.p_c[2], 0, 1e-5);
    vol_image_free(&image);
    vol_tables_free(tables);

    tables = build(grey, (VolPreintOptions){.n = 9, .octaves = 1, .threads = 1, .change = 0.01});
    image = image_of(tables, ALL);
    CHECK(pixel(&image, "full", "fw_a", 0, 8) == -1); /* beyond the band */
    CHECK(pixel(&image, "full", "p_a", 3, 4) >= 0);
    CHECK(isfinite(pixel(&image, "tf", "mu_p", 0, 0)) && isfinite(pixel(&image, "integrals", "M_p.lo", 0, 0)));
    vol_image_free(&image);
    vol_tables_free(tables);
}

/* ---- Refusals ---- */

static void refuse(const VolImage *image, const char *why)
{
    VolTables *back = NULL;
    VolError err = {{0}};
    CHECK(vol_tables_from_image(image, "t.exr", NULL, &back, &err) == VOL_BAD_INPUT);
    CHECK(!back);
    if (!strstr(err.text, why) || !strstr(err.text, "t.exr"))
        FAIL("'%s' does not say '%s'", err.text, why);
}

static VolPart *part_of(VolImage *image, const char *name)
{
    for (size_t i = 0; i < image->part_count; i++)
        if (strcmp(image->parts[i].name, name) == 0)
            return &image->parts[i];
    return NULL;
}

static void test_refusals(void)
{
    VolTables *tables = build(json, (VolPreintOptions){.n = 8, .octaves = 2, .threads = 1});
    VolError err;
    double one = 1, two = 2, nine = 9;
#define SPOIL(how, why) \
    do { \
        VolImage image = image_of(tables, ALL); \
        VolPart *tf = part_of(&image, "tf"), *full = part_of(&image, "full"), *octave = part_of(&image, "full@2"); \
        CHECK(tf && full && octave); \
        how; \
        refuse(&image, why); \
        vol_image_free(&image); \
    } while (0)
    SPOIL(vol_part_set_numbers(full, "vol:tfVersion", VOL_ATTR_INT, &two, &err), "version 2");
    SPOIL(vol_part_set_text(full, "vol:tfRange", "1,0", &err), "range '1,0'");
    SPOIL(vol_part_set_text(full, "vol:tfRange", "nan,1", &err), "range 'nan,1'");
    SPOIL(vol_part_set_text(full, "vol:tfRange", "0,1", &err), "another 8 from 0 to 1.5");
    SPOIL(vol_part_set_text(full, "vol:tfHash", "00", &err), "another transfer function");
    SPOIL(vol_part_set_numbers(full, "vol:tfScalarStep", VOL_ATTR_DOUBLE, &one, &err), "another transfer function");
    SPOIL(vol_part_set_numbers(octave, "vol:tfStep", VOL_ATTR_DOUBLE, &one, &err), "not that of its octave");
    SPOIL(vol_part_set_numbers(full, "vol:tfBand", VOL_ATTR_INT, &nine, &err), "band of 9");
    SPOIL(vol_part_set_text(tf, "vol:transferFunction", "{}", &err), "pellucid");
    SPOIL(vol_part_set_text(tf, "vol:transferFunction", grey, &err), "another transfer function");
    SPOIL(full->data_window.y1--, "not square");
    SPOIL(tf->data_window.x1--, "has 8 nodes");
    SPOIL(vol_part_channel(full, "bw_c.G")->data[9] = NAN, "bw_c.G of entry (1, 1) is nan");
    SPOIL(vol_part_channel(full, "p_a.B")->data[3] = 1.5f, "not an opacity");
    SPOIL(vol_part_channel(tf, "mu_s")->data[2] = INFINITY, "not finite");
    SPOIL(vol_part_channel(full, "fw_a.G")->name[0] = 'X', "no channel 'fw_a.G'");
    SPOIL(vol_part_channel(part_of(&image, "integrals"), "V.lo")->name[0] = 'X', "no channel 'V.lo'");
    SPOIL(tf->name[0] = full->name[0] = octave->name[0] = 'X'; part_of(&image, "integrals")->name[0] = 'X',
          "none of the parts");
#undef SPOIL
    VolImage image = image_of(tables, VOL_TABLES_FULL);
    for (size_t i = 0; i < image.parts[0].attr_count; i++)
        if (strcmp(image.parts[0].attrs[i].name, "vol:transferFunction") == 0)
            image.parts[0].attrs[i].name[0] = 'X';
    refuse(&image, "no transfer function in the header");
    vol_image_free(&image);
    vol_tables_free(tables);
}

static void test_loading_any_kind(void)
{
    VolTables *tables = build(json, (VolPreintOptions){.n = 8, .octaves = 1, .threads = 1}), *back = NULL;
    VolImage image;
    VolBytes bytes;
    VolTf tf;
    VolError err = {{0}};
    VolTfUnits units;
    CHECK(vol_tables_to_image(tables, VOL_TABLES_FULL, &image, &err) == VOL_OK);
    CHECK(vol_exr_write(&image, VOL_EXR_NONE, 1, &bytes, NULL, &err) == VOL_OK);
    CHECK(vol_load_transfer_function(&bytes, "t.exr", NULL, NULL, &tf, &units, &back, &err) == VOL_OK);
    CHECK(back && back->preint.octave_count == 1 && !units.relative && tf.particle_step == 0.25);
    vol_tf_free(&tf);
    vol_tables_free(back);
    bytes.size /= 2;
    CHECK(vol_load_transfer_function(&bytes, "t.exr", NULL, NULL, &tf, &units, &back, &err) == VOL_BAD_INPUT);
    CHECK(!back);
    bytes.size *= 2;
    vol_bytes_free(&bytes);
    vol_image_free(&image);
    vol_tables_free(tables);
    VolBytes text = {(unsigned char *)(uintptr_t)json, sizeof json - 1};
    CHECK(vol_load_transfer_function(&text, "t.json", NULL, NULL, &tf, &units, &back, &err) == VOL_OK && !back);
    vol_tf_free(&tf);
}

/* What is written reads back to the same text. */
static void test_writing_json(void)
{
    static const char *const texts[] = {
        json, grey,
        "{\"pellucid\": \"transfer-function/1\", \"interpolate\": \"extinction\", \"scalar_step\": 0.1, "
        "\"model\": \"classic\", "
        "\"surfaceness\": {\"gradient\": [1, 2.5]}, \"transport\": [[0, [0.1, 0.2, 0.3]]], "
        "\"phase\": {\"table\": [[-1, [1, 2, 3]], [1, [0, 0.5, 1]]]}, \"shading\": {\"ambient\": 0.3}}",
        "{\"pellucid\": \"transfer-function/1\", \"surfaceness\": [[0, 0.5], [1, 1]], \"model\": \"unshaded\", "
        "\"phase\": {\"hg\": -0.3}, "
        "\"isosurfaces\": [{\"value\": 1, \"opacity\": 0.1, \"color\": [1, 0, 0.3333333333333333]}]}"};
    for (int k = 0; k < 4; k++) {
        VolBytes bytes = {(unsigned char *)(uintptr_t)texts[k], strlen(texts[k])};
        VolTf tf, again;
        VolError err = {{0}};
        char *first = NULL, *second = NULL;
        CHECK(vol_tf_parse(&bytes, "a", &tf, NULL, &err) == VOL_OK && vol_tf_write(&tf, &first, &err) == VOL_OK);
        bytes = (VolBytes){(unsigned char *)first, strlen(first)};
        if (vol_tf_parse(&bytes, "b", &again, NULL, &err) || vol_tf_write(&again, &second, &err))
            FAIL("%s", err.text);
        CHECK_TEXT(second, first);
        CHECK(tf.particle_step == again.particle_step && tf.scalar_step == again.scalar_step && tf.model == again.model);
        CHECK(tf.interpolate == again.interpolate && tf.phase_hg == again.phase_hg && tf.ambient == again.ambient);
        CHECK(tf.surface.count == again.surface.count && tf.transport.count == again.transport.count);
        CHECK(tf.surfaceness_gradient[1] == again.surfaceness_gradient[1] && tf.isosurface_count == again.isosurface_count);
        if (tf.isosurface_count)
            CHECK(tf.isosurfaces[0].color_given == again.isosurfaces[0].color_given &&
                  tf.isosurfaces[0].color[2] == again.isosurfaces[0].color[2]);
        free(first);
        free(second);
        vol_tf_free(&tf);
        vol_tf_free(&again);
    }
}

/* ---- Change ---- */

/* v = x + 10 y - 3 z on a box of 12^3, voxels of 0.5 x 0.5 x 2; more than one brick. */
static void test_change_of_a_ramp(void)
{
    VolGridSource source = {.index_to_world = {{{0.5, 0, 0}, {0, 0.5, 0}, {0, 0, 2}, {7, 8, 9}}}, .box = true,
                            .box_max = {11, 11, 11}, .active_voxels = 12 * 12 * 12};
    VolGridBuilder *builder;
    VolGrid *grid;
    VolError err;
    CHECK(vol_grid_begin(&source, &builder, &err) == VOL_OK);
    for (int b = 0; b < 8; b++) {
        int32_t origin[3] = {b & 1 ? 8 : 0, b & 2 ? 8 : 0, b & 4 ? 8 : 0};
        float values[512];
        uint64_t active[8];
        memset(active, 255, sizeof active);
        for (int i = 0; i < 512; i++)
            values[i] = (float)(origin[0] + i / 64) + 10 * (float)(origin[1] + i / 8 % 8) - 3 * (float)(origin[2] + i % 8);
        CHECK(vol_grid_leaf(builder, origin, values, NULL, active, &err) == VOL_OK);
    }
    CHECK(vol_grid_finish(builder, &grid, &err) == VOL_OK);
    VolVolume volume = vol_volume_of_grid(grid);
    CHECK_NEAR(vol_volume_change(&volume, 0.1), 0.1 * (1 / 0.5 + 10 / 0.5 + 3 / 2.0), 1e-6, 0);
    CHECK_NEAR(vol_volume_change(&volume, 1e9), 11 * (1 + 10 + 3), 1e-6, 0); /* all there is */
    vol_volume_free(&volume);
}

int main(void)
{
    RUN(test_there_and_back);
    RUN(test_layout);
    RUN(test_refusals);
    RUN(test_loading_any_kind);
    RUN(test_writing_json);
    RUN(test_change_of_a_ramp);
    return test_end();
}
