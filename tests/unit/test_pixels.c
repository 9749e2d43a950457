#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

#include "io/exr.h"
#include "io/pixels.h"
#include "tests/unit/test.h"

static VolError err;

/* What was said last: "w" for a warning or "n" for a note before it. */
static char said[300];

static void hear(void *user, VolSeverity severity, const char *line)
{
    (void)user;
    snprintf(said, sizeof said, "%c %s", severity == VOL_WARNING ? 'w' : 'n', line);
}

static const VolLog ears = {hear, NULL};

/* A 16 x 16 JPEG, all 128; one RGBA pixel 65535, 32896, 0, 32768 as PNG. */
static const unsigned char sample_jpeg[653] = {
    255,216,255,224,0,16,74,70,73,70,0,1,1,0,0,1,0,1,0,0,255,225,0,22,69,120,105,102,
    0,0,73,73,42,0,8,0,0,0,0,0,0,0,0,0,255,219,0,67,0,1,1,1,1,1,1,1,
    1,1,1,1,1,1,1,1,2,1,1,1,1,1,2,1,1,1,2,2,2,2,2,2,2,2,2,3,
    3,4,3,3,3,3,3,2,2,3,4,3,3,4,4,4,4,4,2,3,5,5,4,4,5,4,4,4,
    4,255,219,0,67,1,1,1,1,1,1,1,2,1,1,2,4,3,2,3,4,4,4,4,4,4,4,4,
    4,4,4,4,4,4,4,4,4,4,4,4,4,4,4,4,4,4,4,4,4,4,4,4,4,4,4,4,
    4,4,4,4,4,4,4,4,4,4,4,4,4,4,255,192,0,17,8,0,16,0,16,3,1,34,0,2,
    17,1,3,17,1,255,196,0,31,0,0,1,5,1,1,1,1,1,1,0,0,0,0,0,0,0,0,1,
    2,3,4,5,6,7,8,9,10,11,255,196,0,181,16,0,2,1,3,3,2,4,3,5,5,4,4,0,
    0,1,125,1,2,3,0,4,17,5,18,33,49,65,6,19,81,97,7,34,113,20,50,129,145,161,8,35,
    66,177,193,21,82,209,240,36,51,98,114,130,9,10,22,23,24,25,26,37,38,39,40,41,42,52,53,54,
    55,56,57,58,67,68,69,70,71,72,73,74,83,84,85,86,87,88,89,90,99,100,101,102,103,104,105,106,
    115,116,117,118,119,120,121,122,131,132,133,134,135,136,137,138,146,147,148,149,150,151,152,153,154,162,163,164,
    165,166,167,168,169,170,178,179,180,181,182,183,184,185,186,194,195,196,197,198,199,200,201,202,210,211,212,213,
    214,215,216,217,218,225,226,227,228,229,230,231,232,233,234,241,242,243,244,245,246,247,248,249,250,255,196,0,
    31,1,0,3,1,1,1,1,1,1,1,1,1,0,0,0,0,0,0,1,2,3,4,5,6,7,8,9,
    10,11,255,196,0,181,17,0,2,1,2,4,4,3,4,7,5,4,4,0,1,2,119,0,1,2,3,17,
    4,5,33,49,6,18,65,81,7,97,113,19,34,50,129,8,20,66,145,161,177,193,9,35,51,82,240,21,
    98,114,209,10,22,36,52,225,37,241,23,24,25,26,38,39,40,41,42,53,54,55,56,57,58,67,68,69,
    70,71,72,73,74,83,84,85,86,87,88,89,90,99,100,101,102,103,104,105,106,115,116,117,118,119,120,121,
    122,130,131,132,133,134,135,136,137,138,146,147,148,149,150,151,152,153,154,162,163,164,165,166,167,168,169,170,
    178,179,180,181,182,183,184,185,186,194,195,196,197,198,199,200,201,202,210,211,212,213,214,215,216,217,218,226,
    227,228,229,230,231,232,233,234,242,243,244,245,246,247,248,249,250,255,218,0,12,3,1,0,2,17,3,17,
    0,63,0,40,162,138,0,255,217};

static const unsigned char sample_png_alpha[95] = {
    137,80,78,71,13,10,26,10,0,0,0,13,73,72,68,82,0,0,0,1,0,0,0,1,16,6,0,0,
    0,79,133,24,202,0,0,0,9,111,70,70,115,0,0,0,0,0,0,0,0,0,218,42,182,206,0,0,
    0,17,73,68,65,84,8,153,99,248,255,191,161,129,129,161,129,1,0,21,122,3,127,220,97,216,206,0,
    0,0,0,73,69,78,68,174,66,96,130};

static VolStatus read_as(const void *data, size_t size, VolPixelsUse use, VolPixels *out)
{
    unsigned char *copy = malloc(size ? size : 1);
    memcpy(copy, data, size);
    VolStatus status = vol_pixels_read(&(VolBytes){copy, size}, "picture", use, &ears, out, &err);
    free(copy);
    return status;
}

static VolStatus read_copy(const void *data, size_t size, bool raw, VolPixels *out)
{
    return read_as(data, size, raw ? VOL_PIXELS_DATA : VOL_PIXELS_COLOR, out);
}

static void check_read(const void *data, size_t size, bool raw, int width, int height, int channels, const double *want)
{
    VolPixels pixels;
    if (read_copy(data, size, raw, &pixels)) {
        FAIL("%s", err.text);
        return;
    }
    CHECK(pixels.width == width && pixels.height == height && pixels.channels == channels);
    if (pixels.width == width && pixels.height == height && pixels.channels == channels)
        for (int i = 0; i < width * height * channels; i++)
            CHECK_NEAR((double)pixels.data[i], want[i], 1e-6, 1e-9);
    vol_pixels_free(&pixels);
}

static void check_cuts(const unsigned char *data, size_t size)
{
    for (size_t cut = 0; cut < size; cut++) {
        VolPixels pixels;
        VolStatus status = read_copy(data, cut, true, &pixels);
        if (status != VOL_BAD_INPUT)
            FAIL("cut at byte %zu of %zu: status %d", cut, size, status);
        if (status == VOL_OK)
            vol_pixels_free(&pixels);
    }
}

static void test_png(void)
{
    const unsigned char rgb[12] = {0, 10, 128, 255, 128, 0, 1, 2, 3, 250, 251, 252};
    VolBytes a, b;
    CHECK(!vol_png_encode(rgb, 2, 2, &a, &err));
    CHECK(!vol_png_encode(rgb, 2, 2, &b, &err));
    CHECK(a.size == b.size && memcmp(a.data, b.data, a.size) == 0);
    check_read(a.data, a.size, false, 2, 2, 3, /* sRGB 128 is 0.2158605; up to 10 is the straight stretch, v/12.92 */
               (double[]){0, 0.0030352698, 0.21586050, 1, 0.21586050, 0, 0.00030352698, 0.00060705396, 0.00091058095,
                          0.95597334, 0.96468626, 0.97344530});
    check_read(a.data, a.size, true, 2, 2, 3, (double[]){0, 10, 128, 255, 128, 0, 1, 2, 3, 250, 251, 252});
    check_cuts(a.data, a.size);
    a.data[50] ^= 1;
    VolPixels pixels;
    CHECK(read_copy(a.data, a.size, true, &pixels) == VOL_BAD_INPUT);
    CHECK(strstr(err.text, "damaged PNG 'picture': wrong checksum in the chunk at byte "));
    vol_bytes_free(&a);
    vol_bytes_free(&b);
}

/* 16 bits with unassociated alpha: decoded first, then multiplied.  32896/65535 decodes to 0.2158605. */
static void test_png_alpha(void)
{
    double alpha = 32768.0 / 65535;
    check_read(sample_png_alpha, sizeof sample_png_alpha, false, 1, 1, 4,
               (double[]){alpha, 0.21586050 * alpha, 0, alpha});
    check_read(sample_png_alpha, sizeof sample_png_alpha, true, 1, 1, 4, (double[]){65535, 32896, 0, 32768});
}

static void test_jpeg(void)
{
    VolPixels pixels;
    CHECK(!read_copy(sample_jpeg, sizeof sample_jpeg, false, &pixels));
    CHECK(pixels.width == 16 && pixels.height == 16 && pixels.channels == 3);
    CHECK_NEAR((double)pixels.data[100], 0.21586050, 1e-6, 0);
    vol_pixels_free(&pixels);
    check_cuts(sample_jpeg, sizeof sample_jpeg);
}

/* Width below 8: pixels without run lengths; mantissa * 2^(exponent - 136). */
static void test_radiance(void)
{
    static const char hdr[] = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n\x80\x40\x20\x81\x80\x80\x80\x8b";
    check_read(hdr, sizeof hdr - 1, false, 2, 1, 3, (double[]){1, 0.5, 0.25, 1024, 1024, 1024});
    check_cuts((const unsigned char *)hdr, sizeof hdr - 1);
}

/* One strip of 2 x 1 signed 16-bit heights. */
static void test_tiff_heights(void)
{
    static const uint16_t entries[][2] = {{256, 2}, {257, 1}, {258, 16}, {259, 1}, {262, 1}, {273, 134}, {277, 1},
                                          {278, 1}, {279, 4}, {339, 2}};
    unsigned char file[138] = {'I', 'I', 42, 0, 8, 0, 0, 0, 10, 0};
    for (int i = 0; i < 10; i++) {
        unsigned char *at = file + 10 + 12 * i;
        at[0] = (unsigned char)(entries[i][0] & 255), at[1] = (unsigned char)(entries[i][0] >> 8);
        at[2] = 3, at[4] = 1; /* one SHORT */
        at[8] = (unsigned char)(entries[i][1] & 255), at[9] = (unsigned char)(entries[i][1] >> 8);
    }
    file[134] = 0x01, file[135] = 0x80; /* -32767 */
    file[136] = 0xe8, file[137] = 0x03; /* 1000 */
    check_read(file, sizeof file, true, 2, 1, 1, (double[]){-32767, 1000});
    check_cuts(file, sizeof file);
}

static void test_exr(void)
{
    VolImage image = {0};
    VolPart *part;
    VolBytes bytes;
    VolChannel *channel;
    VolBox2 box = {5, 5, 6, 5};
    CHECK(!vol_image_add_part(&image, NULL, box, box, &part, &err));
    for (int c = 0; c < 4; c++) {
        CHECK(!vol_part_add_channel(part, (const char *[]){"A", "R", "G", "B"}[c], VOL_PIXEL_FLOAT, &channel, &err));
        channel->data[0] = (float)c;
        channel->data[1] = NAN;
    }
    CHECK(!vol_exr_write(&image, VOL_EXR_ZIP, 1, &bytes, NULL, &err));
    VolPixels pixels;
    CHECK(!read_copy(bytes.data, bytes.size, false, &pixels));
    CHECK(pixels.channels == 4 && pixels.width == 2 && pixels.height == 1);
    CHECK(pixels.data[0] == 1 && pixels.data[1] == 2 && pixels.data[2] == 3 && pixels.data[3] == 0);
    CHECK(isnan(pixels.data[4]) && isnan(pixels.data[7]));
    vol_pixels_free(&pixels);
    vol_bytes_free(&bytes);
    vol_image_free(&image);
}

/* A part and a channel by its number in the file ("1 rgba.R", "0 Z"), all of 2 x 1 pixels; values are 1, 2, ... */
static VolBytes exr_of(const char *const *names)
{
    VolImage image = {0};
    VolBytes bytes;
    VolBox2 window = {-1, 4, 0, 4}, frame = {0, 0, 9, 9};
    for (int i = 0; names[i]; i++) {
        size_t p = (size_t)(names[i][0] - '0');
        VolPart *part;
        VolChannel *channel;
        while (image.part_count <= p)
            CHECK(!vol_image_add_part(&image, (const char *[]){"zero", "one", "beauty"}[image.part_count], window, frame,
                                      &part, &err));
        CHECK(!vol_part_add_channel(&image.parts[p], names[i] + 2, VOL_PIXEL_FLOAT, &channel, &err));
        channel->data[0] = (float)(i + 1);
    }
    CHECK(!vol_exr_write(&image, VOL_EXR_ZIP, 1, &bytes, NULL, &err));
    vol_image_free(&image);
    return bytes;
}

typedef struct Choice {
    const char *names[10];
    int want[4];           /* channels by their place in `names`, from 1; all 0: refused */
    const char *say;       /* part of a warning or note; NULL: silence */
    const char *why;       /* part of the refusal; NULL: the usual one */
} Choice;

static void check_choice(const Choice *choice, VolPixelsUse use)
{
    VolBytes bytes = exr_of(choice->names);
    VolPixels pixels;
    said[0] = 0;
    VolStatus status = read_as(bytes.data, bytes.size, use, &pixels);
    if (status != (choice->want[0] ? VOL_OK : VOL_BAD_INPUT))
        FAIL("%s, ...: status %d, %s", choice->names[0], status, err.text);
    else if (status && !strstr(err.text, choice->why ? choice->why : "no channels R G B, nor luminance (Y), among "))
        FAIL("%s, ...: '%s'", choice->names[0], err.text);
    else if (status)
        CHECK(!choice->why || !strstr(err.text, "no channels R G B"));
    else
        for (int c = 0; c < pixels.channels; c++)
            if (pixels.data[c] != (float)choice->want[c])
                FAIL("%s, ...: channel %d is %g", choice->names[0], c, (double)pixels.data[c]);
    if (choice->say ? !strstr(said, choice->say) : said[0])
        FAIL("%s, ...: says '%s'", choice->names[0], said);
    CHECK(status || (pixels.window.x0 == -1 && pixels.window.y1 == 4 && pixels.frame.x0 == 0 && pixels.frame.y1 == 9));
    vol_pixels_free(&pixels);
    vol_bytes_free(&bytes);
}

/* Layers whose names say that they hold no colours. */
static void check_data_layers(void)
{
    static const char *const data[] = {"depth", "Depth", "DEPTH", "AOV_depth", "depth01", "Z", "zdepth", "N", "normals",
                                       "Normal", "world_normal", "View.Normal", "P", "Pworld", "position", "uv", "UV", "st",
                                       "velocity", "motion", "motionVector", "motion_vectors", "Vector", "cryptomatte",
                                       "CryptoObject00", "uCryptoMaterial01", "id", "objectId", "IndexOB", "material_id"};
    static const char *const pictures[] = {"depth_of_field", "nice", "motion_blur", "identity", "zebra", "pass", "emission",
                                           "depth.beauty", "1"};
    for (size_t i = 0; i < sizeof data / sizeof *data + sizeof pictures / sizeof *pictures; i++) {
        bool is_data = i < sizeof data / sizeof *data;
        const char *layer = is_data ? data[i] : pictures[i - sizeof data / sizeof *data];
        char names[6][64];
        for (int c = 0; c < 4; c++)
            snprintf(names[c], sizeof names[c], "0 %s.%c", layer, "RGBY"[c]);
        const char *why = is_data ? ": depth, normals, identities and the like are no picture" : NULL;
        Choice rgb = {{names[0], names[1], names[2], "0 Zx"}, {is_data ? 0 : 1, 2, 3}, is_data ? NULL : "n the pic", why};
        check_choice(&rgb, VOL_PIXELS_COLOR);
        Choice y = {{names[3], "0 Zx"}, {is_data ? 0 : 1, 1, 1}, is_data ? NULL : "n the picture is layer", why};
        check_choice(&y, VOL_PIXELS_COLOR);
        Choice behind = {{names[0], names[1], names[2], "0 zz.Y"}, {is_data ? 4 : 1, 2, 3}, "n the picture is layer"};
        check_choice(&behind, VOL_PIXELS_COLOR);
        Choice look = {{names[0], names[1], names[2]}, {1, 2, 3}, "n the picture is layer"};
        check_choice(&look, VOL_PIXELS_LOOK);
    }
}

/* Colours wherever they are; depth, coordinates and the like are none. */
static void test_exr_colors(void)
{
    static const Choice choices[] = {
        {{"0 B", "0 G", "0 R"}, {3, 2, 1}, NULL},
        {{"0 R", "0 G", "0 B", "0 A", "0 Z", "0 N.R", "0 N.G", "0 N.B"}, {1, 2, 3, 4}, NULL},
        {{"0 Z", "1 R", "1 G", "1 B", "1 A"}, {2, 3, 4, 5}, "n the picture is part 1 ('one')"},
        {{"0 Y", "1 R", "1 G", "1 B"}, {2, 3, 4}, "n "},
        {{"0 Z", "0 rgba.R", "0 rgba.G", "0 rgba.B", "0 rgba.A"}, {2, 3, 4, 5}, "n the picture is layer 'rgba' of part 0"},
        {{"0 View.AO.R", "0 View.AO.G", "0 View.AO.B", "0 View.Combined.R", "0 View.Combined.G", "0 View.Combined.B"},
         {4, 5, 6}, "n the picture is layer 'View.Combined'"},
        {{"0 a.R", "0 a.G", "0 a.B", "0 b.R", "0 b.G", "0 b.B"}, {1, 2, 3}, "w the picture is layer 'a' of part 0"},
        {{"0 R", "0 G", "0 B", "1 R", "1 G", "1 B"}, {1, 2, 3}, "w the picture is part 0 ('zero') of 'picture': 1 more"},
        {{"0 R", "0 G", "0 B", "2 R", "2 G", "2 B", "1 Z"}, {4, 5, 6}, "n the picture is part 2 ('beauty')"},
        {{"0 red", "0 green", "0 blue"}, {1, 2, 3}, NULL},
        {{"0 Y"}, {1}, NULL},
        {{"0 Z", "1 Y"}, {2}, "n the picture is part 1"},
        {{"0 R"}, {1}, NULL},
        {{"0 Z"}, {0}, NULL},
        {{"0 depth"}, {0}, NULL},
        {{"0 A"}, {0}, NULL},
        {{"0 Z", "1 Z"}, {0}, NULL},
        {{"0 X", "0 Y", "0 Z"}, {0}, NULL},
        {{"0 N.X", "0 N.Y", "0 N.Z"}, {0}, NULL},
        {{"0 Y", "0 RY", "0 BY"}, {0}, NULL, "luminance and chroma (Y, RY, BY)"},
        {{"0 a.Y", "0 a.ry", "0 a.by", "0 Z"}, {0}, NULL, "luminance and chroma (Y, RY, BY)"},
        {{"0 R", "0 Z"}, {1}, NULL},
        {{"0 Z", "0 A", "0 R"}, {3}, NULL},
        {{"0 R", "0 N.R", "0 N.G", "0 N.B"}, {1}, NULL},
        {{"0 Z", "0 foo.R"}, {2}, "n the picture is layer 'foo'"},
        {{"0 foo.R", "1 Y"}, {2}, "n the picture is part 1"},
        {{"0 R", "0 G"}, {0}, NULL},
        {{"0 a.R", "0 b.G", "0 b.B"}, {0}, NULL},
    };
    for (size_t i = 0; i < sizeof choices / sizeof *choices; i++)
        check_choice(&choices[i], VOL_PIXELS_COLOR);
    check_data_layers();
    static const Choice looks[] = {{{"0 Z"}, {1}, NULL}, {{"0 Z", "1 R", "1 G", "1 B"}, {2, 3, 4}, "n "}};
    for (size_t i = 0; i < sizeof looks / sizeof *looks; i++)
        check_choice(&looks[i], VOL_PIXELS_LOOK);
}

/* Colours of other primaries are not converted, but that is said. */
static void test_exr_primaries(void)
{
    static const double lists[2][8] = {{0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.3127, 0.329},
                                       {0.7347, 0.2653, 0, 1, 0.0001, -0.077, 0.32168, 0.33767}};
    for (int i = 0; i < 2; i++) {
        VolImage image = {0};
        VolPart *part;
        VolChannel *channel;
        VolBytes bytes;
        VolPixels pixels;
        CHECK(!vol_image_add_part(&image, NULL, (VolBox2){0, 0, 1, 0}, (VolBox2){0, 0, 1, 0}, &part, &err));
        for (int c = 0; c < 3; c++)
            CHECK(!vol_part_add_channel(part, (const char *[]){"R", "G", "B"}[c], VOL_PIXEL_FLOAT, &channel, &err));
        CHECK(!vol_part_set_numbers(part, "chromaticities", VOL_ATTR_CHROMATICITIES, lists[i], &err));
        CHECK(!vol_exr_write(&image, VOL_EXR_ZIP, 1, &bytes, NULL, &err));
        said[0] = 0;
        CHECK(!read_as(bytes.data, bytes.size, VOL_PIXELS_COLOR, &pixels));
        CHECK(i ? strstr(said, "w the primaries of 'picture' are not those of Rec.709") != NULL : !said[0]);
        vol_pixels_free(&pixels);
        vol_bytes_free(&bytes);
        vol_image_free(&image);
    }
}

static void test_refused(void)
{
    VolPixels pixels;
    CHECK(read_copy("hello", 5, false, &pixels) == VOL_BAD_INPUT);
    CHECK(strstr(err.text, "cannot read image 'picture'"));
    CHECK(read_copy("", 0, false, &pixels) == VOL_BAD_INPUT);
    static const char huge[] = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 60000 +X 30000\nxyz";
    CHECK(read_copy(huge, sizeof huge - 1, false, &pixels) == VOL_BAD_INPUT);
    CHECK(strstr(err.text, "30000 x 60000"));
    CHECK(pixels.data == NULL);
}

int main(void)
{
    RUN(test_png);
    RUN(test_png_alpha);
    RUN(test_jpeg);
    RUN(test_radiance);
    RUN(test_tiff_heights);
    RUN(test_exr);
    RUN(test_exr_colors);
    RUN(test_exr_primaries);
    RUN(test_refused);
    return test_end();
}
