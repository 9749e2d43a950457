/* DICOM images of several frames, written here: places and scales of frames, times, gaps, and what is refused. */
#include <sys/stat.h>
#include <zlib.h>

#include "import_files.h"

enum { FRAMES = 6 };

typedef struct Image {
    bool implicit, big;
    bool undefined;     /* lengths of sequences and items */
    bool unknown;       /* the functional groups are of type UN, hence implicit little endian */
    const char *syntax; /* NULL: by the above */
    int frames;
    const char *position[FRAMES], *orientation[FRAMES], *spacing[FRAMES], *slope[FRAMES], *stack[FRAMES];
    int time[FRAMES], dimension[FRAMES];
    const char *shared_position, *shared_slope, *shared_spacing; /* NULL: none */
    int groups;         /* how many frames have functional groups; -1: there are none at all */
    const char *series, *instance, *top_position;
    void (*more)(Block *b, const struct Image *image);    /* further elements */
    void (*pixels)(Block *b, const struct Image *image);  /* NULL: 2 x 1 samples of 16 bits: 10 frame + column */
    int bits, samples;
    const char *photometric;
} Image;

static const Image usual = {.frames = 4,
                            .position = {"1\\2\\9", "1\\2\\3", "1\\2\\5", "1\\2\\7"},
                            .shared_spacing = "2\\0.5",
                            .shared_slope = "2",
                            .groups = 4,
                            .series = "1.2.3",
                            .bits = 16,
                            .samples = 1};
static const double in_order[8] = {17, 19, 37, 39, 57, 59, -3, -1};

static bool long_form(const char *vr)
{
    return strcmp(vr, "OW") == 0 || strcmp(vr, "OB") == 0 || strcmp(vr, "OF") == 0 || strcmp(vr, "OD") == 0 ||
           strcmp(vr, "SQ") == 0 || strcmp(vr, "UN") == 0;
}

static void put_head(Block *b, const Image *s, uint32_t tag, const char *vr, uint32_t length)
{
    bool big = s->big && tag >> 16 != 2, implicit = s->implicit && tag >> 16 != 2;
    put_int(b, tag >> 16, 2, big);
    put_int(b, tag & 0xffff, 2, big);
    if (implicit || tag >> 16 == 0xfffe) {
        put_int(b, length, 4, big);
        return;
    }
    put(b, vr, 2);
    if (long_form(vr))
        put_int(b, 0, 2, big);
    put_int(b, length, long_form(vr) ? 4 : 2, big);
}

static void put_value(Block *b, const Image *s, uint32_t tag, const char *vr, const void *value, size_t size)
{
    put_head(b, s, tag, vr, (uint32_t)(size + (size & 1)));
    put(b, value, size);
    if (size & 1)
        put(b, strcmp(vr, "UI") == 0 || strcmp(vr, "OB") == 0 ? "" : " ", 1);
}

static void put_words(Block *b, const Image *s, uint32_t tag, const char *vr, const char *text)
{
    if (text)
        put_value(b, s, tag, vr, text, strlen(text));
}

static void put_number(Block *b, const Image *s, uint32_t tag, const char *vr, int value)
{
    int size = strcmp(vr, "UL") == 0 ? 4 : 2;
    put_head(b, s, tag, vr, (uint32_t)size);
    put_int(b, (uint64_t)value, size, s->big);
}

/* A sequence of items that are written already, or one item. */
static void put_wrapped(Block *b, const Image *s, uint32_t tag, const char *vr, const Block *inner)
{
    bool item = tag == 0xfffee000;
    put_head(b, s, tag, vr, s->undefined ? 0xffffffff : (uint32_t)inner->size);
    put(b, inner->data, inner->size);
    if (s->undefined)
        put_head(b, s, item ? 0xfffee00d : 0xfffee0dd, "", 0);
}

/* A sequence of one item with these elements. */
static void put_macro(Block *b, const Image *s, uint32_t tag, const Block *elements)
{
    static Block item;
    item.size = 0;
    if (elements->size == 0)
        return;
    put_wrapped(&item, s, 0xfffee000, "", elements);
    put_wrapped(b, s, tag, "SQ", &item);
}

static void put_text_macro(Block *b, const Image *s, uint32_t macro, uint32_t tag, const char *text)
{
    static Block inner;
    inner.size = 0;
    put_words(&inner, s, tag, "DS", text);
    put_macro(b, s, macro, &inner);
}

static void put_scale(Block *b, const Image *s, const char *slope)
{
    static Block inner;
    inner.size = 0;
    put_words(&inner, s, 0x00281052, "DS", slope ? "-3" : NULL);
    put_words(&inner, s, 0x00281053, "DS", slope);
    put_macro(b, s, 0x00289145, &inner);
}

static void put_shared(Block *b, const Image *s)
{
    static Block groups, items;
    groups.size = items.size = 0;
    put_text_macro(&groups, s, 0x00209113, 0x00200032, s->shared_position);
    put_text_macro(&groups, s, 0x00289110, 0x00280030, s->shared_spacing);
    put_scale(&groups, s, s->shared_slope);
    put_wrapped(&items, s, 0xfffee000, "", &groups);
    put_wrapped(b, s, 0x52009229, "SQ", &items);
}

static void put_frames(Block *b, const Image *s)
{
    static Block groups, items, inner;
    items.size = 0;
    for (int i = 0; i < s->groups; i++) {
        groups.size = inner.size = 0;
        put_words(&inner, s, 0x00209056, "SH", s->stack[i]);
        if (s->time[i])
            put_number(&inner, s, 0x00209128, "UL", s->time[i]);
        if (s->dimension[i])
            put_number(&inner, s, 0x00209157, "UL", s->dimension[i]);
        put_macro(&groups, s, 0x00209111, &inner);
        put_text_macro(&groups, s, 0x00209113, 0x00200032, s->position[i]);
        put_text_macro(&groups, s, 0x00209116, 0x00200037, s->orientation[i]);
        put_text_macro(&groups, s, 0x00289110, 0x00280030, s->spacing[i]);
        put_scale(&groups, s, s->slope[i]);
        put_wrapped(&items, s, 0xfffee000, "", &groups);
    }
    put_wrapped(b, s, 0x52009230, "SQ", &items);
}

static void put_groups(Block *b, const Image *s)
{
    if (!s->unknown) {
        put_shared(b, s);
        put_frames(b, s);
        return;
    }
    Image plain_form = *s;
    plain_form.implicit = plain_form.undefined = true;
    plain_form.big = false;
    static Block inner;
    for (int i = 0; i < 2; i++) {
        inner.size = 0;
        (i ? put_frames : put_shared)(&inner, &plain_form);
        put_head(b, s, i ? 0x52009230 : 0x52009229, "UN", 0xffffffff);
        put(b, inner.data + 8, inner.size - 8);
    }
}

static Block *image_file(const Image *s)
{
    static Block b;
    char frames[16];
    b.size = 128;
    put_text(&b, "DICM");
    put_words(&b, s, 0x00020010, "UI",
              s->syntax     ? s->syntax
              : s->implicit ? "1.2.840.10008.1.2"
              : s->big      ? "1.2.840.10008.1.2.2"
                            : "1.2.840.10008.1.2.1");
    put_words(&b, s, 0x0020000e, "UI", s->series);
    put_words(&b, s, 0x00200013, "IS", s->instance);
    put_words(&b, s, 0x00200032, "DS", s->top_position);
    put_number(&b, s, 0x00280002, "US", s->samples);
    put_words(&b, s, 0x00280004, "CS", s->photometric);
    snprintf(frames, sizeof frames, "%d", s->frames);
    put_words(&b, s, 0x00280008, "IS", frames);
    put_number(&b, s, 0x00280010, "US", 1);
    put_number(&b, s, 0x00280011, "US", 2);
    put_number(&b, s, 0x00280100, "US", s->bits);
    put_number(&b, s, 0x00280101, "US", s->bits);
    put_number(&b, s, 0x00280102, "US", s->bits - 1);
    if (s->more)
        s->more(&b, s);
    if (s->groups >= 0)
        put_groups(&b, s);
    if (s->pixels) {
        s->pixels(&b, s);
        return &b;
    }
    put_head(&b, s, 0x7fe00010, "OW", (uint32_t)(4 * s->frames));
    for (int i = 0; i < 2 * s->frames; i++)
        put_int(&b, (uint64_t)(i / 2 * 10 + i % 2), 2, s->big);
    return &b;
}

static void save_image(const char *name, const Image *s) { save_block(name, image_file(s)); }

static void check_image(const Image *s, const VolImportOptions *options, int count, const double *affine,
                        const double *values)
{
    save_image("image", s);
    check_import("image", options, VOL_STORE_FLOAT, (int32_t[]){2, 1, count}, affine, values);
}

static void check_no_image(const Image *s, const char *text)
{
    save_image("image", s);
    check_refused("image", NULL, text);
}

static void test_order_and_scale(void)
{
    const double affine[12] = {0.5, 0, 0, 0, 2, 0, 0, 0, 2, 1, 2, 3};
    for (int form = 0; form < 12; form++) {
        Image s = usual;
        s.implicit = form % 3 == 1;
        s.big = form % 3 == 2;
        s.undefined = form / 3 % 2;
        s.unknown = form / 6;
        if (!s.unknown || !s.implicit)
            check_image(&s, NULL, 4, affine, in_order);
    }
    Image s = usual;
    s.slope[1] = "10"; /* a frame's own goes before what is shared */
    const double values[8] = {97, 107, 37, 39, 57, 59, -3, -1};
    check_image(&s, NULL, 4, affine, values);
    for (int i = 0; i < 4; i++)
        s.orientation[i] = "1\\0\\0\\0\\-1\\0"; /* the normal is -z */
    const double turned[12] = {0.5, 0, 0, 0, -2, 0, 0, 0, -2, 1, 2, 9};
    check_image(&s, NULL, 4, turned, (double[]){-3, -1, 57, 59, 37, 39, 97, 107});
}

static void test_spacing_option(void)
{
    VolImportOptions longer = plain;
    longer.spacing_given = true;
    longer.spacing = vol_vec3(4, 5, 6);
    check_image(&usual, &longer, 4, (double[]){4, 0, 0, 0, 5, 0, 0, 0, 6, 0, 0, 0}, in_order);
    longer.origin_given = true;
    longer.origin = vol_vec3(7, 8, 9);
    check_image(&usual, &longer, 4, (double[]){4, 0, 0, 0, 5, 0, 0, 0, 6, 7, 8, 9}, in_order);
}

static void test_contradictions(void)
{
    Image s = usual;
    s.orientation[2] = "0\\1\\0\\0\\0\\1";
    check_no_image(&s, "(frame 3): its orientation is not that of");
    s = usual;
    s.spacing[1] = "3\\0.5";
    check_no_image(&s, "(frame 2): its spacing is not that of");
    s = usual;
    s.position[3] = NULL;
    check_no_image(&s, "(frame 4): it has no position");
    s = usual;
    s.groups = 3;
    check_no_image(&s, "functional groups of 3 frames, but there are 4");
    s.groups = 5;
    check_no_image(&s, "functional groups of more frames than the 4");
}

/* Stacks are one volume where one follows the other in even steps. */
static void test_stacks(void)
{
    VolImportOptions fill = plain;
    fill.fill_gaps = true;
    Image s = usual;
    const char *const places[4] = {"1\\2\\3", "1\\2\\5", "1\\2\\7", "1\\2\\9"};
    for (int i = 0; i < 4; i++) {
        s.stack[i] = i < 2 ? "1" : "2";
        s.position[i] = places[i];
    }
    check_image(&s, NULL, 4, NULL, (double[]){-3, -1, 17, 19, 37, 39, 57, 59});
    s.position[3] = "1\\2\\49.3";
    s.position[2] = "1\\2\\47.3";
    check_no_image(&s, "(frame 2) and ");
    check_no_image(&s, "(frame 3) are of stacks '1' and '2', which lie 42.3 apart");
    s.position[3] = "1\\2\\11"; /* nor is anything filled between them */
    s.position[2] = "1\\2\\9";
    check_no_image(&s, "are of stacks '1' and '2', which lie 4 apart");
    save_image("image", &s);
    check_refused("image", &fill, "are of stacks '1' and '2', which lie 4 apart");
}

static void test_same_place(void)
{
    Image s = usual;
    s.position[3] = s.position[0];
    check_no_image(&s, "the same place");
    s.stack[0] = "1", s.stack[3] = "2";
    check_no_image(&s, "stacks '1' and '2'");
    s.stack[0] = s.stack[3] = NULL;
    s.dimension[0] = 1, s.dimension[3] = 7;
    check_no_image(&s, "dimension 1 of the Dimension Index Values (1 and 7)");
    s.dimension[0] = s.dimension[3] = 0;
    s.time[3] = 1;
    check_no_image(&s, "not all times have the same slices");
    s = usual;
    for (int i = 0; i < 4; i++)
        s.position[i] = NULL;
    s.shared_position = "1\\2\\3"; /* a film of one place */
    check_no_image(&s, "the same place");
}

static void test_times(void)
{
    Image s = usual;
    const char *const places[2] = {"1\\2\\3", "1\\2\\5"};
    for (int i = 0; i < 4; i++) {
        s.position[i] = places[i % 2];
        s.time[i] = 2 - i / 2;
    }
    check_image(&s, NULL, 2, NULL, (double[]){37, 39, 57, 59});
    VolImportOptions later = plain;
    later.time_step = 1;
    check_image(&s, &later, 2, (double[]){0.5, 0, 0, 0, 2, 0, 0, 0, 2, 1, 2, 3}, (double[]){-3, -1, 17, 19});
}

static void check_filled(const char *name, int count, const double *values)
{
    VolImportOptions fill = plain;
    fill.fill_gaps = true;
    VolImported got;
    VolError err = {""};
    if (import_file(name, &fill, &got, &err) || got.dims[2] != count) {
        FAIL("%s: %d slices, message '%s'", name, got.dims[2], err.text);
    } else {
        for (int n = 0; n < 2 * count; n++)
            if (isnan(values[n / 2]) ? !isnan((double)got.single[n]) : got.single[n] != values[n / 2] + n % 2 * 2)
                FAIL("%s: value %d is %g", name, n, (double)got.single[n]);
        CHECK_NEAR(got.index_to_world.m[2][2], 2, 0, 1e-12);
    }
    vol_imported_free(&got);
}

static void test_gaps(void)
{
    Image s = usual;
    s.frames = s.groups = 6;
    const char *const places[6] = {"0\\0\\0", "0\\0\\2", "0\\0\\4", "0\\0\\12", "0\\0\\14", "0\\0\\18"};
    for (int i = 0; i < 6; i++)
        s.position[i] = places[5 - i];
    check_no_image(&s, "3 slices are missing at 0, 0, 6, between");
    check_no_image(&s, "(frame 4) and");
    check_no_image(&s, "8 apart where 2 is usual; with other places 4 are missing at 2");
    check_no_image(&s, "--fill-gaps");
    check_filled("image", 10, (double[]){97, 77, 57, NAN, NAN, NAN, 37, 17, NAN, -3});

    s.position[0] = "0\\0\\11"; /* half a step is no gap */
    s.position[1] = "0\\0\\8.5";
    s.position[2] = "0\\0\\6";
    check_image(&s, NULL, 6, NULL, (double[]){97, 99, 77, 79, 57, 59, 37, 39, 17, 19, -3, -1});
    s.position[0] = "0\\0\\1e30";
    VolImportOptions fill = plain;
    fill.fill_gaps = true;
    save_image("image", &s);
    check_refused("image", &fill, "too many to fill");
}

/* One frame per file. */
static void test_missing_file(void)
{
    const char *const places[4] = {"7\\8\\9", "7\\8\\12", "7\\8\\15", "7\\8\\21"}, *const numbers[4] = {"1", "2", "3", "5"};
    char names[4][16];
    const char *list[4];
    for (int with = 0; with < 2; with++) {
        for (int i = 0; i < 4; i++) {
            Image s = usual;
            s.frames = 1;
            s.groups = -1;
            s.instance = numbers[i];
            s.top_position = with ? places[i] : NULL;
            list[i] = names[i];
            snprintf(names[i], sizeof names[i], "gap%d", i);
            save_image(names[i], &s);
        }
        VolImportOptions options = plain;
        options.spacing_given = true;
        options.spacing = vol_vec3(1, 1, 3);
        VolImported got;
        VolError err = {""};
        VolStatus status = import_files(list, 4, &options, &got, &err);
        CHECK(status == (with ? VOL_BAD_INPUT : VOL_OK));
        if (with)
            CHECK(strstr(err.text, "1 slice is missing at 7, 8, 18, between '") != NULL);
        else
            CHECK(got.dims[2] == 4);
        vol_imported_free(&got);
        options.fill_gaps = true;
        if (import_files(list, 4, &options, &got, &err))
            FAIL("%s", err.text);
        else
            CHECK(got.dims[2] == 5 && isnan((double)got.single[6]) && got.single[9] == 1);
        vol_imported_free(&got);
    }
}

static void put_offsets(Block *b, const Image *s)
{
    put_words(b, s, 0x3004000c, "DS", s->instance);
    put_words(b, s, 0x3004000e, "DS", "0.5");
    put_words(b, s, 0x00280030, "DS", "2\\0.5");
}

static void test_dose(void)
{
    Image s = usual;
    s.groups = -1;
    s.top_position = "1\\2\\3";
    s.more = put_offsets;
    const double affine[12] = {0.5, 0, 0, 0, 2, 0, 0, 0, 4, 1, 2, 3};
    const double values[8] = {0, 0.5, 5, 5.5, 10, 10.5, 15, 15.5};
    s.instance = "0\\4\\8\\12";
    check_image(&s, NULL, 4, affine, values);
    s.instance = "3\\7\\11\\15"; /* places along z */
    check_image(&s, NULL, 4, affine, values);
    s.instance = "0\\-4\\-8\\-12";
    check_image(&s, NULL, 4, (double[]){0.5, 0, 0, 0, 2, 0, 0, 0, 4, 1, 2, -9},
                (double[]){15, 15.5, 10, 10.5, 5, 5.5, 0, 0.5});
    s.instance = "0\\4\\8\\16\\20";
    check_no_image(&s, "5 Grid Frame Offsets for 4 frames");
    s.instance = "0\\4\\8\\16";
    check_no_image(&s, "1 slice is missing");
}

/* Nuclear medicine: the place of the first frame lies with its detector; the step has a sign. */
static void put_detector(Block *b, const Image *s)
{
    static Block inner;
    inner.size = 0;
    put_words(&inner, s, 0x00200032, "DS", "5\\6\\7");
    put_macro(b, s, 0x00540022, &inner);
    put_words(b, s, 0x00180088, "DS", "-3");
    put_words(b, s, 0x00280030, "DS", "2\\0.5");
    put_head(b, s, 0x00540010, "US", 8);
    for (int i = 0; i < 4; i++)
        put_int(b, s->instance ? (uint64_t)i : 1, 2, s->big);
}

static void test_detector(void)
{
    Image s = usual;
    s.groups = -1;
    s.more = put_detector;
    const double values[8] = {0, 1, 10, 11, 20, 21, 30, 31};
    check_image(&s, NULL, 4, (double[]){0.5, 0, 0, 0, 2, 0, 0, 0, -3, 5, 6, 7}, values);
    s.instance = "1";
    check_no_image(&s, "several energy windows");
}

static void put_mosaic_type(Block *b, const Image *s)
{
    put_words(b, s, 0x00080008, "CS", "ORIGINAL\\PRIMARY\\M\\ND\\MOSAIC");
}

static void put_mosaic_number(Block *b, const Image *s)
{
    put_words(b, s, 0x00190011, "LO", "SIEMENS MR HEADER");
    put_number(b, s, 0x0019110a, "US", 36);
}

static void test_mosaic(void)
{
    Image s = usual;
    s.more = put_mosaic_type;
    check_no_image(&s, "dcm2niix");
    s.more = put_mosaic_number;
    check_no_image(&s, "dcm2niix");
}

/* Nested: a sequence with an item in which something of undefined length is of type UN. */
static void put_unknown(Block *b, const Image *s)
{
    Image inside = {.implicit = true, .undefined = true};
    static Block number, inner, item, outer;
    number.size = inner.size = item.size = outer.size = 0;
    put_number(&number, &inside, 0x00280010, "US", 99);
    put_wrapped(&item, &inside, 0xfffee000, "", &number);
    put_head(&inner, s, 0x00091001, "UN", 0xffffffff);
    put(&inner, item.data, item.size);
    put_head(&inner, &inside, 0xfffee0dd, "", 0);
    put(b, inner.data, inner.size);
    put_number(&inner, s, 0x00280010, "US", 99);
    put_wrapped(&outer, s, 0xfffee000, "", &inner);
    put_wrapped(b, s, 0x00091002, "SQ", &outer);
}

static void test_read_over(void)
{
    for (int form = 0; form < 6; form++) {
        Image s = usual;
        s.implicit = form % 3 == 1;
        s.big = form % 3 == 2;
        s.undefined = form / 3;
        s.more = put_unknown;
        check_image(&s, NULL, 4, NULL, in_order);
    }
    Block *b = image_file(&usual);
    const size_t end = b->size;
    const char *const tails[] = {"\0\0\0\0", "x", "\0\0\0", "what is this, no data element",
                                 "\xfc\xff\xfc\xffOB\0\0\4\0\0\0\0\0\0\0", "\x28\0\x10\0US\2\0\x63\0"};
    const size_t sizes[] = {4, 1, 3, 29, 16, 10};
    for (int i = 0; i < 6; i++) {
        b->size = end;
        put(b, tails[i], sizes[i]);
        save_block("tail", b);
        check_import("tail", NULL, VOL_STORE_FLOAT, (int32_t[]){2, 1, 4}, NULL, in_order);
    }
    b->size = end; /* padding within the pixels */
    set_int(b, end - 16 - 4, 20, 4, false);
    put_int(b, 77, 4, false);
    save_block("tail", b);
    check_import("tail", NULL, VOL_STORE_FLOAT, (int32_t[]){2, 1, 4}, NULL, in_order);
}

static void put_fragments(Block *b, const Image *s)
{
    put_head(b, s, 0x7fe00010, "OB", 0xffffffff);
    put_head(b, s, 0xfffee000, "", 0);
    put_head(b, s, 0xfffee0dd, "", 0);
}

static void test_syntaxes(void)
{
    const char *const texts[][2] = {{"1.2.840.10008.1.2.5", "dcmdrle"},
                                    {"1.2.840.10008.1.2.4.50", "dcmdjpeg"},
                                    {"1.2.840.10008.1.2.4.57", "dcmdjpeg"},
                                    {"1.2.840.10008.1.2.4.70", "dcmdjpeg"},
                                    {"1.2.840.10008.1.2.4.80", "dcmdjpls"},
                                    {"1.2.840.10008.1.2.4.90", "gdcmconv --raw"},
                                    {"1.2.840.10008.1.2.4.201", "gdcmconv --raw"},
                                    {"1.2.840.10008.1.2.4.102", "a video is no volume"},
                                    {"1.2.3.4", "unknown"},
                                    {"1.2.840.10008.1.2.1", "compressed"}};
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
        Image s = usual;
        s.syntax = texts[i][0];
        s.pixels = put_fragments;
        check_no_image(&s, texts[i][0]);
        check_no_image(&s, texts[i][1]);
    }
}

/* All behind the group that names the syntax is packed. */
static void test_deflated(void)
{
    Image s = usual;
    s.syntax = "1.2.840.10008.1.2.1.99";
    const Block *b = image_file(&s);
    static Block packed;
    const size_t head = 132 + 8 + 22; /* up to the end of the UID */
    packed.size = 0;
    put(&packed, b->data, head);
    z_stream z = {.next_in = (Bytef *)(uintptr_t)(b->data + head), .avail_in = (uInt)(b->size - head)};
    z.next_out = packed.data + head;
    z.avail_out = (uInt)(sizeof packed.data - head);
    CHECK(deflateInit2(&z, 9, Z_DEFLATED, -15, 8, Z_DEFAULT_STRATEGY) == Z_OK);
    CHECK(deflate(&z, Z_FINISH) == Z_STREAM_END);
    packed.size = head + z.total_out;
    deflateEnd(&z);
    save_block("deflated", &packed);
    check_import("deflated", NULL, VOL_STORE_FLOAT, (int32_t[]){2, 1, 4}, NULL, in_order);
    check_cuts("deflated", NULL, &packed, packed.size);
    check_damage(NULL, &packed, 1000);
}

static void put_bits(Block *b, const Image *s) { put_value(b, s, 0x7fe00010, "OW", "\xa6", 1); }

static void put_bytes(Block *b, const Image *s)
{
    put_value(b, s, 0x7fe00010, "OW", s->big ? "\1\0\x0b\x0a\x15\x14\x1f\x1e" : "\0\1\x0a\x0b\x14\x15\x1e\x1f", 8);
}

static void put_floats(Block *b, const Image *s)
{
    put_head(b, s, 0x7fe00008, "OF", 32);
    for (int i = 0; i < 8; i++)
        put_f32(b, (float)i + 0.5f, s->big);
}

static void put_doubles(Block *b, const Image *s)
{
    put_head(b, s, 0x7fe00009, "OD", 64);
    for (int i = 0; i < 8; i++) {
        double v = i + 0.5;
        uint64_t bits;
        memcpy(&bits, &v, sizeof bits);
        put_int(b, bits, 8, s->big);
    }
}

static void test_kinds(void)
{
    Image s = usual;
    s.samples = 3;
    s.photometric = "RGB";
    check_no_image(&s, "RGB");
    s.samples = 1;
    s.photometric = "PALETTE COLOR";
    check_no_image(&s, "PALETTE COLOR");
    s.photometric = "MONOCHROME1";
    check_image(&s, NULL, 4, NULL, in_order);
    s.bits = 12;
    check_no_image(&s, "12 bits allocated");
    s.bits = 1;
    s.pixels = put_bits; /* 01 10 01 01, the lowest first */
    check_image(&s, NULL, 4, NULL, (double[]){-1, -3, -3, -1, -3, -1, -3, -1});
    s.big = true;
    check_no_image(&s, "single bits");
    s.bits = 8;
    s.pixels = put_bytes;
    check_image(&s, NULL, 4, NULL, in_order);
    for (int big = 0; big < 2; big++) {
        const double halves[8] = {2, 4, 6, 8, 10, 12, -2, 0};
        s.big = big;
        s.bits = 32;
        s.pixels = put_floats;
        check_image(&s, NULL, 4, NULL, halves);
        s.pixels = put_doubles;
        check_no_image(&s, "floats of 32 bits, not 64");
        s.bits = 64;
        save_image("image", &s);
        check_import("image", NULL, VOL_STORE_DOUBLE, (int32_t[]){2, 1, 4}, NULL, halves);
    }
}

static void make_inner(const char *name)
{
    char path[600];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    if (mkdir(path, 0777))
        FAIL("cannot make %s", path);
}

static void put_nothing(Block *b, const Image *s) { put_words(b, s, 0x7fe10010, "LO", "no pixels"); }

static void test_parent_folder(void)
{
    make_inner("patient");
    make_inner("patient/empty");
    check_refused("patient", NULL, "no DICOM file with an image in the folder");
    make_inner("patient/study");
    make_inner("patient/study/b");
    make_inner("patient/study/a");
    save_image("patient/study/a/1", &usual);
    save_image("patient/study/b/1", &usual);
    check_refused("patient", NULL, "patient/study/a', '");
    check_refused("patient", NULL, "patient/study/b'");
    Image s = usual;
    s.pixels = put_nothing;
    save_image("patient/DICOMDIR", &s);
    check_refused("patient", NULL, "patient/study/a', '");
    check_refused("patient", NULL, "patient/study/b'");
}

static void test_damage(void)
{
    VolImportOptions fill = plain;
    fill.fill_gaps = true;
    for (int form = 0; form < 6; form++) {
        Image s = usual;
        s.implicit = form % 3 == 1;
        s.big = form % 3 == 2;
        s.undefined = form / 3;
        s.position[3] = "1\\2\\13";
        s.more = form == 4 ? put_offsets : form == 5 ? put_detector : put_unknown;
        s.groups = form == 4 || form == 5 ? -1 : 4;
        s.instance = form == 4 ? "0\\4\\8\\16" : NULL;
        static Block b;
        b = *image_file(&s);
        memset(b.data, 0, 128);
        check_cuts("cut", &fill, &b, b.size);
        check_damage(&fill, &b, 1000);
    }
}

int main(void)
{
    make_folder();
    RUN(test_order_and_scale);
    RUN(test_spacing_option);
    RUN(test_contradictions);
    RUN(test_same_place);
    RUN(test_stacks);
    RUN(test_times);
    RUN(test_gaps);
    RUN(test_missing_file);
    RUN(test_dose);
    RUN(test_detector);
    RUN(test_mosaic);
    RUN(test_read_over);
    RUN(test_syntaxes);
    RUN(test_deflated);
    RUN(test_kinds);
    RUN(test_parent_folder);
    RUN(test_damage);
    remove_folder();
    return test_end();
}
