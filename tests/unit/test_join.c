#include <stdlib.h>

#include "join/join.h"
#include "tests/unit/test.h"

static VolError err;

/* A crop of the frame (0,0)-(9,7); every pixel tells its place. */
static VolImage crop(int x0, int y0, int x1, int y1)
{
    VolImage image = {0};
    VolPart *part;
    VolBox2 frame = {0, 0, 9, 7};
    for (int p = 0; p < 2; p++) {
        CHECK(!vol_image_add_part(&image, p ? "depth" : "beauty", (VolBox2){x0, y0, x1, y1}, frame, &part, &err));
        for (int c = 0; c < 2; c++) {
            VolChannel *channel;
            CHECK(!vol_part_add_channel(part, c ? "R" : "Z", c ? VOL_PIXEL_HALF : VOL_PIXEL_FLOAT, &channel, &err));
            float *at = channel->data;
            for (int y = y0; y <= y1; y++)
                for (int x = x0; x <= x1; x++)
                    *at++ = (float)(100 * p + 1000 * c + 10 * y + x);
        }
        CHECK(!vol_part_set_text(part, "vol:argsHash", "0123", &err));
        CHECK(!vol_part_set_text(part, "Software", "vol-render 0.1.0", &err));
    }
    return image;
}

static VolStatus join(const VolImage *crops, size_t count, VolImage *out)
{
    static const char *const names[] = {"a.exr", "b.exr", "c.exr", "d.exr"};
    return vol_join_images(crops, names, count, out, &err);
}

static void free_all(VolImage *images, size_t count)
{
    for (size_t i = 0; i < count; i++)
        vol_image_free(&images[i]);
}

/* In whatever order: the bytes of the whole frame. */
static void test_whole(void)
{
    VolImage crops[4] = {crop(4, 3, 9, 7), crop(0, 0, 9, 0), crop(0, 1, 3, 7), crop(4, 1, 9, 2)};
    VolImage whole = crop(0, 0, 9, 7), joined;
    CHECK(!join(crops, 4, &joined));
    VolBytes want, got;
    CHECK(!vol_exr_write(&whole, VOL_EXR_ZIP, 1, &want, NULL, &err));
    CHECK(!vol_exr_write(&joined, VOL_EXR_ZIP, 1, &got, NULL, &err));
    CHECK(want.size == got.size && memcmp(want.data, got.data, want.size) == 0);
    vol_bytes_free(&want);
    vol_bytes_free(&got);
    vol_image_free(&joined);
    CHECK(!join(&whole, 1, &joined));
    vol_image_free(&joined);
    vol_image_free(&whole);
    free_all(crops, 4);
}

static void test_holes(void)
{
    VolImage crops[4] = {crop(0, 0, 3, 7), crop(4, 0, 5, 2), crop(8, 0, 9, 7), crop(4, 5, 7, 7)}, joined;
    CHECK(join(crops, 4, &joined) == VOL_NO);
    CHECK(strstr(err.text, "a hole at (6,0)-(7,4)"));
    CHECK(joined.parts == NULL);
    CHECK(join(crops, 1, &joined) == VOL_NO);
    CHECK(strstr(err.text, "a hole at (4,0)-(9,7)"));
    free_all(crops, 4);
}

/* Whatever a display window claims, the hole is found at once and no memory taken for the frame. */
static void test_huge_frame(void)
{
    VolImage crops[3] = {crop(0, 0, 9, 3), crop(0, 4, 2, 7), crop(5, 6, 9, 7)}, joined;
    for (size_t i = 0; i < 3; i++)
        for (size_t p = 0; p < 2; p++)
            crops[i].parts[p].display_window = (VolBox2){INT32_MIN, INT32_MIN, INT32_MAX, INT32_MAX};
    CHECK(join(crops, 3, &joined) == VOL_NO);
    CHECK(strstr(err.text, "a hole at (-2147483648,-2147483648)-(2147483647,-1)"));
    for (size_t i = 0; i < 3; i++)
        for (size_t p = 0; p < 2; p++)
            crops[i].parts[p].display_window = (VolBox2){0, 0, 9, INT32_MAX};
    CHECK(join(crops, 1, &joined) == VOL_NO);
    CHECK(strstr(err.text, "a hole at (0,4)-(9,2147483647)"));
    CHECK(join(crops, 3, &joined) == VOL_NO);
    CHECK(strstr(err.text, "a hole at (3,4)-(9,5)"));
    free_all(crops, 3);
}

/* Frames cut into strips, columns and tiles at random: whole, or with a tile missing whose corner is named. */
static void test_random_cuts(void)
{
    unsigned seed = 1;
    for (int round = 0; round < 200; round++) {
        VolImage crops[16], joined;
        int xs[5] = {0, 0, 0, 0, 10}, ys[5] = {0, 0, 0, 0, 8};
        size_t count = 0, missing = (size_t)round % 17;
        for (int i = 1; i < 4; i++) {
            xs[i] = xs[i - 1] + (int)((seed = seed * 1664525U + 1013904223U) >> 16) % (10 - xs[i - 1]);
            ys[i] = ys[i - 1] + (int)((seed = seed * 1664525U + 1013904223U) >> 16) % (8 - ys[i - 1]);
        }
        char hole[40] = "";
        for (int j = 0, n = 0; j < 4; j++)
            for (int i = 0; i < 4; i++, n++) {
                if (xs[i] == xs[i + 1] || ys[j] == ys[j + 1])
                    continue;
                if ((size_t)n == missing)
                    snprintf(hole, sizeof hole, "(%d,%d)-(%d,%d)", xs[i], ys[j], xs[i + 1] - 1, ys[j + 1] - 1);
                else
                    crops[count++] = crop(xs[i], ys[j], xs[i + 1] - 1, ys[j + 1] - 1);
            }
        VolStatus status = count ? vol_join_images(crops, (const char *[16]){"x"}, count, &joined, &err) : VOL_NO;
        CHECK(status == (hole[0] || !count ? VOL_NO : VOL_OK));
        CHECK(!count || !hole[0] || strstr(err.text, hole));
        if (status == VOL_OK)
            vol_image_free(&joined);
        free_all(crops, count);
    }
}

/* Numbers of objects, say, are not rounded to floats. */
static void test_whole_numbers(void)
{
    VolImage made = {0}, halves[2], joined, again;
    VolPart *part;
    VolChannel *channel;
    VolBytes bytes;
    for (int i = 0; i < 2; i++) {
        made = (VolImage){0};
        CHECK(!vol_image_add_part(&made, NULL, (VolBox2){i, 0, i, 1}, (VolBox2){0, 0, 1, 1}, &part, &err));
        CHECK(!vol_part_add_channel(part, "id", VOL_PIXEL_UINT, &channel, &err));
        channel->whole = calloc(2, sizeof *channel->whole);
        channel->whole[0] = 16777217 + (uint32_t)i;
        channel->whole[1] = 4294967295U - (uint32_t)i;
        CHECK(!vol_exr_write(&made, VOL_EXR_ZIP, 1, &bytes, NULL, &err));
        CHECK(!vol_exr_read(&bytes, "x", &halves[i], &err));
        vol_bytes_free(&bytes);
        vol_image_free(&made);
    }
    CHECK(!join(halves, 2, &joined));
    CHECK(!vol_exr_write(&joined, VOL_EXR_ZIP, 1, &bytes, NULL, &err));
    CHECK(!vol_exr_read(&bytes, "x", &again, &err));
    static const double want[4] = {16777217, 16777218, 4294967295.0, 4294967294.0};
    for (size_t i = 0; i < 4; i++)
        CHECK(vol_channel_value(&again.parts[0].channels[0], i) == want[i]);
    vol_bytes_free(&bytes);
    free_all(halves, 2);
    vol_image_free(&joined);
    vol_image_free(&again);
}

static void test_overlap(void)
{
    VolImage crops[2] = {crop(0, 0, 5, 7), crop(4, 2, 9, 7)}, joined;
    CHECK(join(crops, 2, &joined) == VOL_BAD_INPUT);
    CHECK_TEXT(err.text, "cannot join 'b.exr': overlap with 'a.exr' at (4,2)-(5,7)");
    free_all(crops, 2);
}

/* Joins two halves of which the second was made other than the first. */
static void check_stranger(VolImage *second, const char *why)
{
    VolImage crops[2] = {crop(0, 0, 4, 7), *second}, joined;
    CHECK(join(crops, 2, &joined) == VOL_BAD_INPUT);
    if (!strstr(err.text, "cannot join 'b.exr'") || !strstr(err.text, why))
        FAIL("no '%s' in '%s'", why, err.text);
    free_all(crops, 2);
    *second = crop(5, 0, 9, 7);
}

static void test_strangers(void)
{
    VolImage second = crop(5, 0, 9, 7);
    VolPart *part = &second.parts[1];
    VolChannel *channel;
    part->display_window.x1 = 10;
    check_stranger(&second, "its display window differs from that of 'a.exr'");
    CHECK(!vol_part_set_text(&second.parts[1], "vol:argsHash", "4567", &err));
    check_stranger(&second, "its attribute vol:argsHash differs");
    CHECK(!vol_part_set_text(&second.parts[0], "extra", "1", &err));
    check_stranger(&second, "its attribute extra differs");
    CHECK(!vol_part_add_channel(&second.parts[0], "A", VOL_PIXEL_FLOAT, &channel, &err));
    check_stranger(&second, "its set of channels differs");
    second.parts[0].channels[0].store = VOL_PIXEL_FLOAT;
    check_stranger(&second, "its set of channels differs");
    second.parts[0].name[0] = 'x';
    check_stranger(&second, "its list of parts differs");
    second.parts[0].data_window.x1 = 10;
    check_stranger(&second, "its data window reaches beyond its display window");
    vol_image_free(&second);
}

int main(void)
{
    RUN(test_whole);
    RUN(test_holes);
    RUN(test_huge_frame);
    RUN(test_random_cuts);
    RUN(test_whole_numbers);
    RUN(test_overlap);
    RUN(test_strangers);
    return test_end();
}
