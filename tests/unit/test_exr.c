#include <stdint.h>
#include <stdlib.h>
#include <sys/resource.h>

#include "io/exr.h"
#include "tests/unit/exr_samples.h"
#include "tests/unit/test.h"

static VolError err;

static VolImage new_image(VolBox2 data, VolBox2 display)
{
    VolImage image = {0};
    VolPart *part;
    if (vol_image_add_part(&image, NULL, data, display, &part, &err))
        FAIL("%s", err.text);
    return image;
}

/* A channel of values that tell where they are. */
static void add_channel(VolPart *part, const char *name, VolPixel store, float scale)
{
    VolChannel *channel;
    if (vol_part_add_channel(part, name, store, &channel, &err)) {
        FAIL("%s", err.text);
        return;
    }
    size_t n = vol_box2_width(part->data_window) * vol_box2_height(part->data_window);
    for (size_t i = 0; i < n; i++)
        channel->data[i] = (float)i * scale;
}

static bool same_pixels(const VolPart *a, const VolPart *b)
{
    size_t n = vol_box2_width(a->data_window) * vol_box2_height(a->data_window);
    if (a->channel_count != b->channel_count || memcmp(&a->data_window, &b->data_window, sizeof a->data_window) != 0 ||
        memcmp(&a->display_window, &b->display_window, sizeof a->display_window) != 0)
        return false;
    for (size_t c = 0; c < a->channel_count; c++)
        if (strcmp(a->channels[c].name, b->channels[c].name) != 0 || a->channels[c].store != b->channels[c].store ||
            memcmp(a->channels[c].data, b->channels[c].data, n * sizeof(float)) != 0)
            return false;
    return true;
}

/* Two parts, every kind of channel and attribute, through the given compression and back. */
static VolImage sample_image(void)
{
    VolImage image = {0};
    double numbers[16];
    for (int i = 0; i < 16; i++)
        numbers[i] = i / 4.0 - 1;
    for (int p = 0; p < 2; p++) {
        VolPart *part;
        CHECK(!vol_image_add_part(&image, p ? "second" : "first", (VolBox2){-3, 5 + p, 13, 40}, (VolBox2){-10, 0, 99, 79},
                                  &part, &err));
        add_channel(part, "Z", VOL_PIXEL_FLOAT, 0.1F);
        add_channel(part, "B", VOL_PIXEL_HALF, 0.25F);
        add_channel(part, "id", VOL_PIXEL_UINT, 3);
        part->pixel_aspect = 2;
        part->screen_width = 3;
        part->screen_center[1] = 0.5;
        CHECK(!vol_part_set_text(part, "vol:history", "vol-gen field\nvol-render -t a.json", &err));
        CHECK(!vol_part_set_text(part, "empty", "", &err));
        CHECK(!vol_part_set_text(part, "a name that is longer than thirty-one letters", "x", &err));
        CHECK(!vol_part_set_numbers(part, "worldToCamera", VOL_ATTR_M44F, numbers, &err));
        CHECK(!vol_part_set_numbers(part, "chromaticities", VOL_ATTR_CHROMATICITIES, numbers, &err));
        CHECK(!vol_part_set_numbers(part, "point", VOL_ATTR_V3F, numbers, &err));
        CHECK(!vol_part_set_numbers(part, "count", VOL_ATTR_INT, (double[]){-7}, &err));
        CHECK(!vol_part_set_numbers(part, "step", VOL_ATTR_DOUBLE, (double[]){0.1}, &err));
        CHECK(!vol_part_set_numbers(part, "angle", VOL_ATTR_FLOAT, (double[]){0.5}, &err));
    }
    return image;
}

static void check_attrs(const VolPart *a, const VolPart *b)
{
    CHECK(a->attr_count == b->attr_count);
    for (size_t i = 0; i < a->attr_count && i < b->attr_count; i++) {
        CHECK_TEXT(b->attrs[i].name, a->attrs[i].name);
        CHECK(a->attrs[i].type == b->attrs[i].type);
        if (a->attrs[i].type == VOL_ATTR_TEXT)
            CHECK_TEXT(b->attrs[i].text, a->attrs[i].text);
        else
            CHECK(memcmp(a->attrs[i].number, b->attrs[i].number, sizeof a->attrs[i].number) == 0);
    }
}

static void test_round_trip(void)
{
    VolImage image = sample_image(), again;
    for (int compression = VOL_EXR_NONE; compression <= VOL_EXR_PIZ; compression++) {
        VolBytes bytes, bytes2;
        CHECK(!vol_exr_write(&image, (VolExrCompression)compression, 1, &bytes, NULL, &err));
        if (vol_exr_read(&bytes, "x", &again, &err)) {
            FAIL("%s", err.text);
            return;
        }
        CHECK(again.part_count == 2);
        for (size_t p = 0; p < 2; p++) {
            CHECK_TEXT(again.parts[p].name, image.parts[p].name);
            CHECK(same_pixels(&image.parts[p], &again.parts[p]));
            CHECK(again.parts[p].pixel_aspect == 2 && again.parts[p].screen_width == 3);
            CHECK(again.parts[p].screen_center[0] == 0 && again.parts[p].screen_center[1] == 0.5);
            check_attrs(&image.parts[p], &again.parts[p]);
        }
        CHECK(!vol_exr_write(&again, (VolExrCompression)compression, 1, &bytes2, NULL, &err));
        CHECK(bytes.size == bytes2.size && memcmp(bytes.data, bytes2.data, bytes.size) == 0);
        vol_bytes_free(&bytes);
        vol_bytes_free(&bytes2);
        vol_image_free(&again);
    }
    vol_image_free(&image);
}

static void test_threads_write_the_same_bytes(void)
{
    VolImage image = new_image((VolBox2){0, -7, 99, 400}, (VolBox2){0, 0, 99, 99});
    VolChannel *channel;
    CHECK(!vol_part_add_channel(&image.parts[0], "half", VOL_PIXEL_HALF, &channel, &err));
    for (int i = 0; i < 100 * 408; i++)
        channel->data[i] = i % 7 ? (float)(i * 31 % 977) : 1e6F;
    for (int compression = VOL_EXR_NONE; compression <= VOL_EXR_PIZ; compression++) {
        VolBytes one, many;
        uint64_t clamped = 0;
        CHECK(!vol_exr_write(&image, (VolExrCompression)compression, 1, &one, &clamped, &err));
        for (int threads = 2; threads <= 8; threads += 3) {
            uint64_t clamped_too = 0;
            CHECK(!vol_exr_write(&image, (VolExrCompression)compression, threads, &many, &clamped_too, &err));
            CHECK(one.size == many.size && memcmp(one.data, many.data, one.size) == 0);
            CHECK(clamped == (100 * 408 + 6) / 7 && clamped_too == clamped);
            vol_bytes_free(&many);
        }
        vol_bytes_free(&one);
    }
    vol_image_free(&image);
}

static void test_special_values(void)
{
    VolImage image = new_image((VolBox2){0, 0, 3, 0}, (VolBox2){0, 0, 3, 0}), again;
    float values[4] = {NAN, -INFINITY, 1e5F, 1e-40F};
    uint64_t clamped = 5;
    for (int c = 0; c < 2; c++) {
        VolChannel *channel;
        CHECK(!vol_part_add_channel(&image.parts[0], c ? "half" : "float", c ? VOL_PIXEL_HALF : VOL_PIXEL_FLOAT, &channel,
                                    &err));
        memcpy(channel->data, values, sizeof values);
    }
    VolBytes bytes;
    CHECK(!vol_exr_write(&image, VOL_EXR_ZIP, 1, &bytes, &clamped, &err));
    CHECK(clamped == 7);
    CHECK(!vol_exr_read(&bytes, "x", &again, &err));
    const float *f = again.parts[0].channels[0].data, *h = again.parts[0].channels[1].data;
    CHECK(memcmp(f, values, sizeof values) == 0);
    CHECK(isnan(h[0]) && h[1] == -65504 && h[2] == 65504 && h[3] == 0);
    vol_bytes_free(&bytes);
    vol_image_free(&again);
    vol_image_free(&image);
}

static VolStatus read_sample(const unsigned char *data, size_t size, VolImage *out)
{
    unsigned char *copy = malloc(size); /* so that a read past the end is seen */
    memcpy(copy, data, size);
    VolStatus status = vol_exr_read(&(VolBytes){copy, size}, "sample", out, &err);
    free(copy);
    return status;
}

static void check_pattern(const unsigned char *data, size_t size)
{
    VolImage image;
    if (read_sample(data, size, &image)) {
        FAIL("%s", err.text);
        return;
    }
    const VolPart *part = &image.parts[0];
    CHECK(memcmp(&part->data_window, &(VolBox2){-2, 3, 21, 22}, sizeof(VolBox2)) == 0);
    CHECK(memcmp(&part->display_window, &(VolBox2){0, 0, 29, 31}, sizeof(VolBox2)) == 0);
    CHECK(part->channel_count == 3);
    const VolChannel *r = vol_part_channel(part, "R"), *g = vol_part_channel(part, "G"), *n = vol_part_channel(part, "N");
    CHECK(r->store == VOL_PIXEL_FLOAT && g->store == VOL_PIXEL_HALF && n->store == VOL_PIXEL_UINT);
    for (int i = 0; i < 24 * 20; i++) {
        int x = i % 24 / 6, y = i / 24 / 5;
        CHECK(r->data[i] == 0.25F * (float)x + (float)y);
        CHECK(g->data[i] == 0.5F * (float)(x - y));
        CHECK(n->data[i] == (float)(100 * y + x));
    }
    CHECK(part->attr_count == 2);
    CHECK_TEXT(vol_part_attr(part, "comments")->text, "sample");
    CHECK(vol_part_attr(part, "rate")->type == VOL_ATTR_OTHER);
    vol_image_free(&image);
}

static void test_other_writers(void)
{
    check_pattern(sample_tiles, sizeof sample_tiles);
    check_pattern(sample_mipmap, sizeof sample_mipmap);
    check_pattern(sample_pxr24, sizeof sample_pxr24);
    check_pattern(sample_upward, sizeof sample_upward);
}

static void check_flat(const unsigned char *data, size_t size)
{
    VolImage image;
    if (read_sample(data, size, &image)) {
        FAIL("%s", err.text);
        return;
    }
    for (int i = 0; i < 24 * 20; i++)
        CHECK(image.parts[0].channels[0].data[i] == 0.5F);
    vol_image_free(&image);
}

static void test_other_compressions(void)
{
    check_flat(sample_rle, sizeof sample_rle);
    check_flat(sample_b44a, sizeof sample_b44a);
    VolImage image; /* DWA: not in every version of the library; then it must say so */
    if (read_sample(sample_dwaa, sizeof sample_dwaa, &image) == VOL_OK) {
        CHECK_NEAR((double)image.parts[0].channels[0].data[100], 0.5, 0, 1e-2);
        vol_image_free(&image);
    } else {
        CHECK(strstr(err.text, "dwaa-compressed, which this build's OpenEXRCore cannot decode"));
    }
}

static void test_refused(void)
{
    VolImage image;
    CHECK(read_sample(sample_deep, sizeof sample_deep, &image) == VOL_BAD_INPUT);
    CHECK(strstr(err.text, "part 0 is deep"));
    CHECK(read_sample(sample_subsampled, sizeof sample_subsampled, &image) == VOL_BAD_INPUT);
    CHECK(strstr(err.text, "channel 'RY' of part 0 is subsampled (2x2)"));
    CHECK(read_sample((const unsigned char *)"hello, world", 12, &image) == VOL_BAD_INPUT);
    CHECK_TEXT(err.text, "not an EXR image 'sample' (12 bytes)");
    CHECK(vol_exr_read(&(VolBytes){0}, "x", &image, &err) == VOL_BAD_INPUT);
    CHECK(image.part_count == 0 && image.parts == NULL);
    VolBytes bytes;
    image = (VolImage){0};
    CHECK(vol_exr_write(&image, VOL_EXR_ZIP, 1, &bytes, NULL, &err) == VOL_BAD_INPUT);
    image = new_image((VolBox2){0, 0, 1, 1}, (VolBox2){0, 0, 1, 1});
    CHECK(vol_exr_write(&image, VOL_EXR_ZIP, 1, &bytes, NULL, &err) == VOL_BAD_INPUT);
    CHECK_TEXT(err.text, "cannot write EXR: part 0 has no channels");
    CHECK(bytes.data == NULL);
    vol_image_free(&image);
}

/* Every prefix of a file is damage, whatever its layout. */
static void check_cuts(const unsigned char *data, size_t size)
{
    for (size_t cut = 0; cut < size; cut++) {
        VolImage image;
        VolStatus status = read_sample(data, cut, &image);
        if (status != VOL_BAD_INPUT)
            FAIL("cut at byte %zu of %zu: status %d", cut, size, status);
        CHECK(status == VOL_OK || image.parts == NULL);
        if (status == VOL_OK)
            vol_image_free(&image);
    }
}

static void test_cut(void)
{
    VolImage image = sample_image();
    VolBytes bytes;
    CHECK(!vol_exr_write(&image, VOL_EXR_ZIP, 1, &bytes, NULL, &err));
    check_cuts(bytes.data, bytes.size);
    vol_bytes_free(&bytes);
    vol_image_free(&image);
    check_cuts(sample_tiles, sizeof sample_tiles);
    check_cuts(sample_pxr24, sizeof sample_pxr24);
}

/* Any byte changed: read or refused, but nothing worse. */
static void test_flipped(void)
{
    static const unsigned char *const samples[] = {sample_tiles, sample_pxr24, sample_upward, sample_rle, sample_mipmap};
    static const size_t sizes[] = {sizeof sample_tiles, sizeof sample_pxr24, sizeof sample_upward, sizeof sample_rle,
                                   sizeof sample_mipmap};
    unsigned seen = 0;
    for (size_t s = 0; s < 5; s++) {
        unsigned char *copy = malloc(sizes[s]);
        for (size_t i = 8; i < sizes[s]; i++)
            for (int k = 0; k < 3; k++) {
                memcpy(copy, samples[s], sizes[s]);
                copy[i] = (unsigned char)(k == 0 ? copy[i] ^ 0x80 : k == 1 ? 0xff : copy[i] + 1);
                VolImage image;
                VolStatus status = read_sample(copy, sizes[s], &image);
                CHECK(status == VOL_OK || status == VOL_BAD_INPUT);
                seen |= 1U << status;
                if (status == VOL_OK)
                    vol_image_free(&image);
            }
        free(copy);
    }
    CHECK(seen == ((1U << VOL_OK) | (1U << VOL_BAD_INPUT)));
}

static unsigned char *find_bytes(unsigned char *in, size_t size, const void *what, size_t length)
{
    for (size_t i = 0; i + length <= size; i++)
        if (memcmp(in + i, what, length) == 0)
            return in + i;
    return NULL;
}

/* A header that claims 2^26 x 2^26 pixels, or one line of 10^8: refused before memory is taken. */
static void test_bombs(void)
{
    VolImage image = new_image((VolBox2){0, 0, 7, 0}, (VolBox2){0, 0, 7, 0}), again;
    add_channel(&image.parts[0], "Y", VOL_PIXEL_FLOAT, 1);
    VolBytes bytes;
    CHECK(!vol_exr_write(&image, VOL_EXR_ZIP, 1, &bytes, NULL, &err));
    struct rusage before, after;
    getrusage(RUSAGE_SELF, &before);
    const int32_t claims[3][4] = {{0, 0, 67108863, 67108863}, {0, 0, 99999999, 0}, {0, 0, 99999, 99999}};
    for (int i = 0; i < 3; i++) {
        static const char name[] = "dataWindow\0box2i\0\x10\0\0"; /* and a NUL */
        unsigned char *copy = malloc(bytes.size), *at;
        memcpy(copy, bytes.data, bytes.size);
        at = find_bytes(copy, bytes.size, name, sizeof name);
        CHECK(at != NULL);
        if (at)
            memcpy(at + sizeof name, claims[i], sizeof claims[i]);
        VolBytes bomb = {copy, bytes.size};
        CHECK(vol_exr_read(&bomb, "bomb", &again, &err) == VOL_BAD_INPUT);
        CHECK(strstr(err.text, "damaged EXR 'bomb'"));
        free(copy);
    }
    getrusage(RUSAGE_SELF, &after);
    CHECK(after.ru_maxrss - before.ru_maxrss < 64 * 1024); /* KB */
    vol_bytes_free(&bytes);
    vol_image_free(&image);
}

/* Damage in the pixels names the scan line and the byte. */
static void test_named_damage(void)
{
    VolImage image = new_image((VolBox2){0, 0, 31, 47}, (VolBox2){0, 0, 31, 47}), again;
    add_channel(&image.parts[0], "Y", VOL_PIXEL_FLOAT, 1);
    VolBytes bytes;
    CHECK(!vol_exr_write(&image, VOL_EXR_ZIP, 1, &bytes, NULL, &err));
    CHECK(vol_exr_read(&(VolBytes){bytes.data, bytes.size - 10}, "a.exr", &again, &err) == VOL_BAD_INPUT);
    CHECK(strstr(err.text, "damaged EXR 'a.exr': part 0, scan line 32"));
    memset(bytes.data + bytes.size - 40, 0x55, 40);
    CHECK(vol_exr_read(&bytes, "a.exr", &again, &err) == VOL_BAD_INPUT);
    CHECK(strstr(err.text, "damaged EXR 'a.exr': part 0, scan line 32 (byte "));
    vol_bytes_free(&bytes);
    vol_image_free(&image);
}

/* A required attribute that is damaged or missing is no reason to guess. */
static void test_required_attributes(void)
{
    static const struct {
        const char *what;
        size_t size, at; /* of the byte that changes */
        const char *why;
    } faults[] = {{"compression\0compression\0\1\0\0", 29, 28, "header: attribute 'compression' (type 'compression'): "},
                  {"compression\0compression", 24, 3, "part 0 has no attribute compression"},
                  {"dataWindow\0box2i", 17, 0, "part 0 has no attribute dataWindow"},
                  {"displayWindow\0box2i", 20, 0, "part 0 has no attribute displayWindow"},
                  {"displayWindow\0box2i", 20, 18, "attribute 'displayWindow': Invalid type 'box2A'"}};
    VolImage image = new_image((VolBox2){0, 0, 63, 63}, (VolBox2){0, 0, 63, 63}), again;
    add_channel(&image.parts[0], "Y", VOL_PIXEL_FLOAT, 1);
    for (size_t i = 0; i < sizeof faults / sizeof *faults; i++) {
        VolBytes bytes;
        CHECK(!vol_exr_write(&image, VOL_EXR_ZIP, 1, &bytes, NULL, &err));
        unsigned char *at = find_bytes(bytes.data, bytes.size, faults[i].what, faults[i].size - (i == 0));
        CHECK(at != NULL);
        if (at)
            at[faults[i].at] = 'A';
        CHECK(vol_exr_read(&bytes, "x", &again, &err) == VOL_BAD_INPUT);
        if (!strstr(err.text, faults[i].why))
            FAIL("no '%s' in '%s'", faults[i].why, err.text);
        vol_bytes_free(&bytes);
    }
    vol_image_free(&image);
}

static void test_header_only(void)
{
    VolImage image;
    CHECK(!vol_exr_read_header(&(VolBytes){(unsigned char *)(uintptr_t)sample_pxr24, sizeof sample_pxr24}, "x",
                               &image, &err));
    CHECK(image.parts[0].channel_count == 3 && image.parts[0].channels[0].data == NULL);
    vol_image_free(&image);
}

int main(void)
{
    RUN(test_round_trip);
    RUN(test_threads_write_the_same_bytes);
    RUN(test_special_values);
    RUN(test_other_writers);
    RUN(test_other_compressions);
    RUN(test_refused);
    RUN(test_cut);
    RUN(test_flipped);
    RUN(test_bombs);
    RUN(test_named_damage);
    RUN(test_required_attributes);
    RUN(test_header_only);
    return test_end();
}
