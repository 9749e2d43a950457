/* DICOM series, written here slice by slice: order, tilt, rescaling, syntaxes, and what is refused. */
#include <sys/stat.h>

#include "import_files.h"

typedef struct Slice {
    const char *position, *instance, *series;
    bool implicit, big;
    const char *syntax;
    const char *slope, *intercept;
    int bits_stored, is_signed;
    const int *pixels; /* 3 x 2 */
} Slice;

static const int counting[6] = {0, 1, 2, 3, 4, 5};
static const Slice usual = {.position = "1\\2\\3",
                            .instance = "1",
                            .series = "1.2.3",
                            .bits_stored = 16,
                            .pixels = counting};

static void put_element(Block *b, const Slice *s, unsigned group, unsigned element, const char *vr,
                        const void *value, size_t size)
{
    bool big = s->big && group != 2, implicit = s->implicit && group != 2;
    size_t even = size + (size & 1);
    put_int(b, group, 2, big);
    put_int(b, element, 2, big);
    if (implicit) {
        put_int(b, even, 4, big);
    } else if (strcmp(vr, "OW") == 0 || strcmp(vr, "SQ") == 0) {
        put(b, vr, 2);
        put_int(b, 0, 2, big);
        put_int(b, even, 4, big);
    } else {
        put(b, vr, 2);
        put_int(b, even, 2, big);
    }
    put(b, value, size);
    if (size & 1)
        put(b, strcmp(vr, "UI") == 0 ? "" : " ", 1);
}

static void put_words(Block *b, const Slice *s, unsigned group, unsigned element, const char *vr, const char *text)
{
    put_element(b, s, group, element, vr, text, strlen(text));
}

static void put_short(Block *b, const Slice *s, unsigned element, int value)
{
    Block v = {.size = 0};
    put_int(&v, (uint64_t)value, 2, s->big);
    put_element(b, s, 0x28, element, "US", v.data, 2);
}

/* A sequence of undefined length with an item of undefined length, whose Rows must not be taken for the image's.
 */
static void put_sequence(Block *b, const Slice *s)
{
    put_int(b, 0x8, 2, s->big);
    put_int(b, 0x1140, 2, s->big);
    if (!s->implicit) {
        put_text(b, "SQ");
        put_int(b, 0, 2, s->big);
    }
    put_int(b, 0xffffffff, 4, s->big);
    const unsigned tags[3] = {0xe000, 0xe00d, 0xe0dd};
    for (int i = 0; i < 3; i++) {
        put_int(b, 0xfffe, 2, s->big);
        put_int(b, tags[i], 2, s->big);
        put_int(b, i == 0 ? 0xffffffff : 0, 4, s->big);
        if (i == 0)
            put_short(b, s, 0x0010, 99);
    }
}

static Block slice_file(const Slice *s)
{
    Block b = {.size = 128}, pixels = {.size = 0};
    const char *syntax = s->syntax     ? s->syntax
                         : s->implicit ? "1.2.840.10008.1.2"
                         : s->big      ? "1.2.840.10008.1.2.2"
                                       : "1.2.840.10008.1.2.1";
    put_text(&b, "DICM");
    put_words(&b, s, 2, 0x10, "UI", syntax);
    put_words(&b, s, 8, 0x103e, "LO", "head");
    put_sequence(&b, s);
    put_words(&b, s, 0x18, 0x50, "DS", "7");
    put_words(&b, s, 0x20, 0xe, "UI", s->series);
    put_words(&b, s, 0x20, 0x11, "IS", "4");
    put_words(&b, s, 0x20, 0x13, "IS", s->instance);
    if (s->position)
        put_words(&b, s, 0x20, 0x32, "DS", s->position);
    put_words(&b, s, 0x20, 0x37, "DS", "0\\1\\0\\0\\0\\-1"); /* rows run along y, columns along -z */
    put_short(&b, s, 0x02, 1);
    put_short(&b, s, 0x10, 2); /* rows */
    put_short(&b, s, 0x11, 3); /* columns */
    put_words(&b, s, 0x28, 0x30, "DS", "0.5\\0.25");
    put_short(&b, s, 0x100, 16);
    put_short(&b, s, 0x101, s->bits_stored);
    put_short(&b, s, 0x102, s->bits_stored - 1);
    put_short(&b, s, 0x103, s->is_signed);
    if (s->slope) {
        put_words(&b, s, 0x28, 0x1052, "DS", s->intercept);
        put_words(&b, s, 0x28, 0x1053, "DS", s->slope);
    }
    for (int i = 0; i < 6; i++)
        put_int(&pixels, (uint64_t)s->pixels[i], 2, s->big);
    put_element(&b, s, 0x7fe0, 0x10, "OW", pixels.data, pixels.size);
    return b;
}

static void save_slice(const char *name, const Slice *s)
{
    Block b = slice_file(s);
    save_block(name, &b);
}

static void test_one_slice(void)
{
    const int32_t dims[3] = {3, 2, 1};
    const double affine[12] = {0, 0.25, 0, 0, 0, -0.5, -7, 0, 0, 1, 2, 3}; /* thickness along the normal */
    const double values[6] = {0, 1, 2, 3, 4, 5};
    Slice s = usual;
    Block b = slice_file(&s);
    save_block("one.dcm", &b);
    check_import("one.dcm", NULL, VOL_STORE_FLOAT, dims, affine, values);
    check_cuts("one.dcm", NULL, &b, b.size);
    check_damage(NULL, &b, 1000);
    s.implicit = true;
    save_slice("implicit.dcm", &s);
    check_import("implicit.dcm", NULL, VOL_STORE_FLOAT, dims, affine, values);
    s.implicit = false;
    s.big = true;
    save_slice("big.dcm", &s);
    check_import("big.dcm", NULL, VOL_STORE_FLOAT, dims, affine, values);
}

static void test_stored_bits(void)
{
    /* 12 bits, signed; what lies above them is no part of the value */
    const int pixels[6] = {0x0001, 0x07ff, 0x0800, 0x0fff, 0xf001, 0x1fff};
    Slice s = usual;
    s.bits_stored = 12;
    s.is_signed = 1;
    s.pixels = pixels;
    s.slope = "2";
    s.intercept = "-1000.5";
    save_slice("bits.dcm", &s);
    const double values[6] = {-998.5, 3093.5, -5096.5, -1002.5, -998.5, -1002.5};
    check_import("bits.dcm", NULL, VOL_STORE_FLOAT, (int32_t[]){3, 2, 1}, NULL, values);
}

/* Slices out of order, shifted along a row from one to the next as by a tilted gantry, each with its own slope. */
static void test_tilted_series(void)
{
    const char *const positions[3] = {"30\\1\\0", "10\\0\\0", "20\\0.5\\0"}, *const slopes[3] = {"3", "1", "2"};
    char names[3][16];
    for (int i = 0; i < 3; i++) {
        Slice s = usual;
        s.position = positions[i];
        s.slope = slopes[i];
        s.intercept = "0";
        snprintf(names[i], sizeof names[i], "tilt%d", i);
        save_slice(names[i], &s);
    }
    VolImported got;
    VolError err = {""};
    if (import_files((const char *[]){names[0], names[1], names[2]}, 3, &plain, &got, &err)) {
        FAIL("%s", err.text);
        return;
    }
    /* normal = y x -z = -x: the slice with the largest x comes first */
    const double affine[12] = {0, 0.25, 0, 0, 0, -0.5, -10, -0.5, 0, 30, 1, 0};
    for (int n = 0; n < 12; n++)
        CHECK_NEAR(got.index_to_world.m[n / 3][n % 3], affine[n], 0, 1e-12);
    for (int n = 0; n < 18; n++)
        CHECK(got.single[n] == (float)((3 - n / 6) * (n % 6)));
    vol_imported_free(&got);
}

static void test_folder(void)
{
    char path[512], hidden[600];
    snprintf(path, sizeof path, "%s", path_of("series"));
    if (mkdir(path, 0777))
        FAIL("cannot make %s", path);
    Slice s = usual;
    save_slice("series/b", &s);
    s.position = "-1\\2\\3";
    save_slice("series/a", &s);
    save("series/notes.txt", "no DICOM", 8);
    snprintf(hidden, sizeof hidden, "%s/inner", path);
    if (mkdir(hidden, 0777))
        FAIL("cannot make %s", hidden);
    const double values[12] = {0, 1, 2, 3, 4, 5, 0, 1, 2, 3, 4, 5};
    check_import("series", NULL, VOL_STORE_FLOAT, (int32_t[]){3, 2, 2},
                 (double[]){0, 0.25, 0, 0, 0, -0.5, -2, 0, 0, 1, 2, 3}, values);

    s.series = "9.9"; /* a second series: to be chosen */
    s.position = "5\\2\\3";
    save_slice("series/c", &s);
    check_refused("series", NULL, "2 DICOM series, choose one by --array: 4 'head' (1.2.3), 4 'head' (9.9)");
    VolImportOptions second = plain;
    second.array = "9.9";
    check_import("series", &second, VOL_STORE_FLOAT, (int32_t[]){3, 2, 1}, NULL, values);
    second.array = "8.8";
    check_refused("series", &second, "there is no DICOM series '8.8'");
}

static void test_refused(void)
{
    Slice s = usual;
    s.syntax = "1.2.840.10008.1.2.4.70";
    save_slice("jpeg.dcm", &s);
    check_refused("jpeg.dcm", NULL, "transfer syntax 1.2.840.10008.1.2.4.70");

    s = usual;
    save_slice("twice1", &s);
    save_slice("twice2", &s);
    VolImported got;
    VolError err = {""};
    CHECK(import_files((const char *[]){"twice1", "twice2"}, 2, &plain, &got, &err) == VOL_BAD_INPUT);
    CHECK(strstr(err.text, "the same place") != NULL);
    CHECK(import_files((const char *[]){"twice1", "one.dcm", "series/notes.txt"}, 3, &plain, &got, &err) ==
          VOL_BAD_INPUT);
    check_refused("series/inner", NULL, "no DICOM file");
}

int main(void)
{
    make_folder();
    RUN(test_one_slice);
    RUN(test_stored_bits);
    RUN(test_tilted_series);
    RUN(test_folder);
    RUN(test_refused);
    remove_folder();
    return test_end();
}
