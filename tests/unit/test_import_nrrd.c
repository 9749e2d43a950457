/* NRRD in the many spellings that teem reads, its encodings and its files beside the header. */
#include <bzlib.h>

#include "import_files.h"

static const double counting[24] = {0,  1,  2,  3,  4,  5,  6,  7,  8,  9,  10, 11,
                                    12, 13, 14, 15, 16, 17, 18, 19, 20, 21, 22, 23};
static const int32_t dims234[3] = {2, 3, 4};

static void put_counting(Block *b, int from, int count, int size)
{
    for (int i = from; i < from + count; i++)
        put_int(b, (uint64_t)i, size, false);
}

static void put_gzip(Block *b, const void *data, size_t size) { put_packed(b, data, size, true); }

static void put_bzip2(Block *b, const void *data, size_t size)
{
    unsigned room = (unsigned)(sizeof b->data - b->size);
    if (BZ2_bzBuffToBuffCompress((char *)b->data + b->size, &room, (char *)(uintptr_t)data, (unsigned)size, 9, 0, 0))
        abort();
    b->size += room;
}

static void put_hex(Block *b, const void *data, size_t size)
{
    const unsigned char *bytes = data;
    for (size_t i = 0; i < size; i++) {
        char text[8];
        snprintf(text, sizeof text, i % 2 ? "%02x" : i % 5 ? "%02X\n" : "%02X ", (unsigned)bytes[i]);
        put_text(b, text);
    }
}

static void put_ascii(Block *b, int from, int count)
{
    for (int i = from; i < from + count; i++) {
        char text[16];
        snprintf(text, sizeof text, i % 3 ? "%d, " : "%d\n", i);
        put_text(b, text);
    }
}

static void put_encoded(Block *b, const char *encoding, int from, int count)
{
    Block samples = {.size = 0};
    put_counting(&samples, from, count, 2);
    if (encoding[0] == 'g')
        put_gzip(b, samples.data, samples.size);
    else if (encoding[0] == 'b')
        put_bzip2(b, samples.data, samples.size);
    else if (encoding[0] == 'h')
        put_hex(b, samples.data, samples.size);
    else if (encoding[0] == 'r')
        put(b, samples.data, samples.size);
    else
        put_ascii(b, from, count);
}

/* A header before 24 shorts gives voxels of 2, 3 and 4 along the axes and this affine. */
static void check_header(const char *fields, const double *affine)
{
    Block b = {.size = 0};
    put_text(&b, fields);
    put_counting(&b, 0, 24, 2);
    save_block("header.nrrd", &b);
    int failed = test_failed_checks;
    check_import("header.nrrd", NULL, VOL_STORE_FLOAT, dims234, affine, counting);
    if (test_failed_checks > failed)
        printf("# header: %s\n", fields);
}

#define SHORTS "NRRD0004\ntype: short\ndimension: 3\nsizes: 2 3 4\nendian: little\nencoding: raw\n"

static void test_spellings(void)
{
    const double spaced[12] = {1, 0, 0, 0, 2, 0, 0, 0, 3, 0, 0, 0};
    check_header("NRRD0004\nType: Short\nDIMENSION: 3\nSizes: 2 3 4\nEndian: LITTLE\nEncoding: RAW\nSpacings: 1 2 3\n\n",
                 spaced);
    check_header("NRRD00.01\r\nTYPE: Signed Short Int\r\ndimension: 3\r\nsizes: 2 3 4\r\nendian: Little\r\n"
                 "encoding: Raw\r\nspacings: 1 2 3\r\n\r\n",
                 spaced);
    check_header(SHORTS "labels: \"x: a\" \"a \\\"b\\\" c\" \"z:=1\"\n"
                 "spacings:\t1  2\t3 \nspace units: \"mm\" \"m m\" \"\"\n"
                        "key: with:=type: double\ntype:=double\nunknown: field\n\n",
                 spaced);
    check_header(SHORTS "SpaceDimension: 3\nSpaceDirections: (1,0,0) ( 0 , 2 , 0 ) (0,0,3)\nspaceorigin: ( 4,5, 6)\n"
                        "measurement frame: (1,0,0) (0,1,0) (0,0,1)\nkinds: Space DOMAIN space\n\n",
                 (double[]){1, 0, 0, 0, 2, 0, 0, 0, 3, 4, 5, 6});
    check_header(SHORTS "axismins: 0 10 20\nAxisMaxs: 4 16 32\nCenterings: Cell CELL cell\n\n",
                 (double[]){2, 0, 0, 0, 2, 0, 0, 0, 3, 1, 11, 21.5});
    check_header(SHORTS "kinds: none ??? domain\nthicknesses: nan ??? 1\nspacings: NaN none ???\n\n",
                 (double[]){1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0});
}

static void test_places(void)
{
    check_header(SHORTS "axis mins: 0 10 20\naxis maxs: 4 16 32\n\n",
                 (double[]){2, 0, 0, 0, 2, 0, 0, 0, 3, 1, 11, 21.5});
    check_header(SHORTS "axis mins: 0 10 20\naxis maxs: 4 16 32\ncenters: node cell ???\n\n",
                 (double[]){4, 0, 0, 0, 2, 0, 0, 0, 3, 0, 11, 21.5});
    check_header(SHORTS "axis mins: 0 10 nan\nspacings: 1 2 3\ncenters: cell node cell\n\n",
                 (double[]){1, 0, 0, 0, 2, 0, 0, 0, 3, 0.5, 10, 0});
    check_header(SHORTS "space: RAS\nspace directions: (1,0,0) (0,2,0) (0,0,3)\nspace origin: none\n\n",
                 (double[]){1, 0, 0, 0, 2, 0, 0, 0, 3, 0, 0, 0});
    check_header("NRRD0004\ntype: short\ndimension: 5\nsizes: 1 2 3 4 1\nendian: little\nencoding: raw\n"
                 "spacings: nan 1 2 3 NaN\n\n",
                 (double[]){1, 0, 0, 0, 2, 0, 0, 0, 3, 0, 0, 0});

    /* a picture that stands upright */
    Block b = {.size = 0};
    put_text(&b, "NRRD0004\ntype: uchar\ndimension: 2\nsizes: 2 3\nencoding: raw\nspace dimension: 3\n"
                 "space directions: (0,2,0) (0,0,3)\nspace origin: (1,2,3)\n\n");
    put_counting(&b, 0, 6, 1);
    save_block("picture.nrrd", &b);
    check_import("picture.nrrd", NULL, VOL_STORE_FLOAT, (int32_t[]){2, 3, 1},
                 (double[]){0, 2, 0, 0, 0, 3, 1, 0, 0, 1, 2, 3}, counting);
}

/* Space and time in vectors of four numbers, as ITK writes them; where time is, the vectors say. */
static void test_four_axes(void)
{
    const char *const headers[] = {
        "sizes: 2 3 4 2\nspace dimension: 4\nspace directions: (1,0,0,0) (0,2,0,0) (0,0,3,0) (0,0,0,1)\n"
        "kinds: domain domain domain domain\nspace origin: (7,8,9,5)\n",
        "sizes: 2 3 4 2\nspace: left-posterior-superior-time\n"
        "space directions: (1,0,0,0) (0,2,0,0) (0,0,3,0) (0,0,0,0.5)\nspace origin: (7,8,9,0)\n",
        "sizes: 2 3 4 2\nspace dimension: 3\nspace directions: (1,0,0) (0,2,0) (0,0,3) none\n"
        "kinds: domain domain domain list\nspace origin: (7,8,9)\n",
        "sizes: 2 3 4 2\nspace dimension: 3\nspace directions: (1,0,0) (0,2,0) (0,0,3) (nan,nan,nan)\n"
        "kinds: space space space time\nspace origin: (7,8,9)\n"};
    const double affine[12] = {1, 0, 0, 0, 2, 0, 0, 0, 3, 7, 8, 9};
    double later[24];
    for (int i = 0; i < 24; i++)
        later[i] = 24 + i;
    for (int n = 0; n < 4; n++) {
        VolImportOptions second = plain;
        Block b = {.size = 0};
        put_text(&b, "NRRD0004\ntype: short\ndimension: 4\nendian: little\nencoding: raw\n");
        put_text(&b, headers[n]);
        put_text(&b, "\n");
        put_counting(&b, 0, 48, 2);
        save_block("four.nrrd", &b);
        second.component = n == 2 ? 0 : VOL_COMPONENT_DEFAULT;
        check_import("four.nrrd", &second, VOL_STORE_FLOAT, dims234, affine, counting);
        second.component = n == 2 ? 1 : VOL_COMPONENT_DEFAULT;
        second.time_step = n == 2 ? 0 : 1;
        check_import("four.nrrd", &second, VOL_STORE_FLOAT, dims234, affine, later);
    }
    Block b = {.size = 0};
    put_text(&b, "NRRD0004\ntype: short\ndimension: 4\nendian: little\nencoding: raw\nsizes: 2 2 3 4\nspace dimension: 4\n"
                 "space directions: (0,0,0,1) (1,0,0,0) (0,2,0,0) (0,0,3,0)\nspace origin: (7,8,9,0)\n\n");
    for (int i = 0; i < 24; i++) {
        put_int(&b, (uint64_t)i, 2, false);
        put_int(&b, 99, 2, false);
    }
    save_block("first.nrrd", &b);
    check_import("first.nrrd", NULL, VOL_STORE_FLOAT, dims234, affine, counting);
}

static void test_text(void)
{
    const char *const texts[] = {"0, 1, 2,3,4 ,5", "0,1,2,3,4,5", "0 1\n2\t3\r\n4\v5", ",0 , 1 2.0 3e0 4,5, and more"};
    for (int i = 0; i < 4; i++) {
        Block b = {.size = 0};
        put_text(&b, i % 2 ? "NRRD0001\ntype: float\n" : "NRRD0001\ntype: uchar\n");
        put_text(&b, "dimension: 1\nsizes: 6\nencoding: TXT\n\n");
        put_text(&b, texts[i]);
        save_block("text.nrrd", &b);
        check_import("text.nrrd", NULL, VOL_STORE_FLOAT, (int32_t[]){6, 1, 1}, NULL, counting);
    }
    const struct {
        const char *type, *text;
        VolVdbStore store;
        double values[2];
    } typed[] = {{"int", "-2147483648, 7", VOL_STORE_INT32, {-2147483648., 7}},
                 {"uint", "4294967295 0", VOL_STORE_DOUBLE, {4294967295., 0}},
                 {"double", "0.1 -1e300", VOL_STORE_DOUBLE, {0.1, -1e300}},
                 {"float", "0.5 -inf", VOL_STORE_FLOAT, {0.5, -INFINITY}},
                 {"long long", "-9007199254740992 3", VOL_STORE_DOUBLE, {-9007199254740992., 3}}};
    for (size_t i = 0; i < sizeof typed / sizeof *typed; i++) {
        Block b = {.size = 0};
        put_text(&b, "NRRD0001\ndimension: 1\nsizes: 2\nencoding: ascii\ntype: ");
        put_text(&b, typed[i].type);
        put_text(&b, "\n\n");
        put_text(&b, typed[i].text);
        save_block("typed.nrrd", &b);
        check_import("typed.nrrd", NULL, typed[i].store, (int32_t[]){2, 1, 1}, NULL, typed[i].values);
    }
}

/* ---- Encodings ---- */

static const char *const encodings[] = {"raw", "gzip", "GZ", "bzip2", "bz2", "hex", "ascii", "text", "txt"};
enum { ENCODINGS = sizeof encodings / sizeof *encodings };

static char initial(const char *encoding) { return encoding[0] == 'G' ? 'g' : encoding[0]; }

static void begin(Block *b, const char *encoding)
{
    b->size = 0;
    put_text(b, "NRRD0004\ntype: ushort\ndimension: 3\nsizes: 2 3 4\nendian: little\nencoding: ");
    put_text(b, encoding);
    put_text(b, "\n");
}

static void put_part(Block *b, const char *encoding, int from, int count)
{
    const char kind[2] = {initial(encoding), 0};
    put_encoded(b, kind, from, count);
}

static void test_encodings(void)
{
    for (int e = 0; e < ENCODINGS; e++) {
        Block b, data = {.size = 0};
        begin(&b, encodings[e]);
        put_text(&b, "\n");
        put_part(&b, encodings[e], 0, 24);
        save_block("attached.nrrd", &b);
        check_import("attached.nrrd", NULL, VOL_STORE_FLOAT, dims234, NULL, counting);
        if (initial(encodings[e]) != 't' && initial(encodings[e]) != 'a')
            check_cuts("attached.nrrd", NULL, &b, b.size);
        check_damage(NULL, &b, 1000);

        put_text(&data, "one line\nand another\n"); /* lines are skipped before unpacking */
        put_part(&data, encodings[e], 0, 24);
        save_block("lines.dat", &data);
        begin(&b, encodings[e]);
        put_text(&b, "line skip: 2\ndata file: lines.dat\n");
        save_block("detached.nhdr", &b);
        check_import("detached.nhdr", NULL, VOL_STORE_FLOAT, dims234, NULL, counting);
    }
}

/* Bytes are skipped in what was unpacked, from the start or, below 0, from the end. */
static void test_byte_skip(void)
{
    const char *const kinds[] = {"raw", "gzip", "bzip2"};
    const char *const skips[] = {"byteskip: 5\n", "byte skip: -4\n"};
    Block samples = {.size = 0};
    put_text(&samples, "12345");
    put_counting(&samples, 0, 24, 2);
    put_text(&samples, "abc");
    for (int e = 0; e < 6; e++) {
        Block b, data = {.size = 0};
        put_text(&data, "line\n");
        if (e / 2 == 0)
            put(&data, samples.data, samples.size);
        else
            (e / 2 == 1 ? put_gzip : put_bzip2)(&data, samples.data, samples.size);
        save_block("skipped.dat", &data);
        begin(&b, kinds[e / 2]);
        put_text(&b, "LineSkip: 1\nDataFile: skipped.dat\n");
        put_text(&b, skips[e % 2]);
        save_block("skipped.nhdr", &b);
        check_import("skipped.nhdr", NULL, VOL_STORE_FLOAT, dims234, NULL, counting);
    }
    const char *const refused[] = {"raw\nbyte skip: -11\n\n", "raw\nbyte skip: 9223372036854775806\n\n",
                                   "raw\nline skip: 99\n\n"};
    for (int i = 0; i < 3; i++) {
        Block b;
        begin(&b, refused[i]);
        put(&b, samples.data, samples.size);
        save_block("far.nrrd", &b);
        check_refused("far.nrrd", NULL, "truncated");
    }
}

/* Several files, each encoded by itself, named in every way. */
static void test_files(void)
{
    const struct {
        int parts;
        const char *form;
    } forms[] = {
        {4, "data file: part%d 0 3 1\n"},
        {4, "Data File: part%03d.x 10 7 -1\n"},
        {4, "datafile: part%d 0 3 1 2\n"},
        {12, "data file: part%d 0 11 1 1\n"},
        {2, "data file: part%d 0 1 1 3\n"},
        {4, "data file: LIST\npart0\n./part1\npart2\npart3\n"},
        {4, "data file: list 2\r\npart0\r\npart1\r\npart2\r\npart3\r\n"},
        {12, "data file: LIST 1\npart0\npart1\npart2\npart3\npart4\npart5\npart6\npart7\npart8\npart9\npart10\npart11"},
        {2, "data file: LIST 3\npart0\npart1\n"},
        {1, "data file: LIST\npart0\n"},
        {4, "data file: SKIPLIST\n0 part0\n0 part1\n0 part2\n0 part3\n"},
    };
    for (int e = 0; e < ENCODINGS; e++)
        for (size_t f = 0; f < sizeof forms / sizeof *forms; f++) {
            int share = 24 / forms[f].parts;
            for (int i = 0; i < forms[f].parts; i++) {
                Block part = {.size = 0};
                char name[32];
                put_part(&part, encodings[e], i * share, share);
                snprintf(name, sizeof name, f == 1 ? "part%03d.x" : "part%d", f == 1 ? 10 - i : i);
                save_block(name, &part);
            }
            Block b;
            begin(&b, encodings[e]);
            put_text(&b, forms[f].form);
            save_block("files.nhdr", &b);
            check_import("files.nhdr", NULL, VOL_STORE_FLOAT, dims234, NULL, counting);
        }
}

static void test_skip_list(void)
{
    Block b;
    for (int i = 0; i < 4; i++) {
        char name[32];
        Block part = {.size = 0};
        put(&part, "abcdefg", (size_t)i);
        put_counting(&part, 6 * i, 6, 2);
        snprintf(name, sizeof name, "skip%d", i);
        save_block(name, &part);
    }
    begin(&b, "raw");
    put_text(&b, "data file: SKIPLIST 2\n0 skip0\n1 skip1\n2 skip2\n-1 skip3\n");
    save_block("files.nhdr", &b);
    check_import("files.nhdr", NULL, VOL_STORE_FLOAT, dims234, NULL, counting);
}

/* ---- What is refused ---- */

static void test_damage(void)
{
    const struct {
        const char *fields, *why;
    } cases[] = {
        {"sizes: 2 1 1 1\nencoding: raw\n\n12", "more sizes than dimensions"},
        {"sizes: 2 1 1\nencoding: raw\nspacings: 1 1\n\n12", "fewer spacings than dimensions"},
        {"sizes: 2 1 1\nencoding: raw\nspacings: 1 1 inf\n\n12", "'spacings: 1 1 inf'"},
        {"sizes: 2 1 1\nencoding: raw\nspacings: 1 1 x\n\n12", "'spacings: 1 1 x'"},
        {"sizes: 2 1 1\nencoding: raw\ncenters: cell corner cell\n\n12", "'centers: cell corner cell'"},
        {"sizes: 2 1 1\nencoding: raw\nspace directions: (1,0,0) (0,1,0) (0,0)\n\n12", "'space directions"},
        {"sizes: 2 1 1\nencoding: raw\nspace directions: (1,0,0) (0,1,0) (0,nan,0)\n\n12", "'space directions"},
        {"sizes: 2 1 1\nencoding: raw\nspace directions: (1,0,0) (0,1,0)\n\n12", "fewer space directions"},
        {"sizes: 2 1 1\nencoding: raw\nspace directions: (1,0,0) (0,1,0 (0,0,1\n\n12", "'space directions"},
        {"sizes: 2 1 1\nencoding: raw\nspace dimension: 2\nspace origin: (1,2,3)\n\n12", "'space origin"},
        {"sizes: 2 1 1\nencoding: bzip2\n\n12", "compressed data"},
        {"sizes: 2 1 1\nencoding: hex\n\n12", "fewer hexadecimal digits"},
        {"sizes: 2 1 1\nencoding: hex\n\n1 2x4", "no digit after 2"},
        {"sizes: 2 1 1\nencoding: hex\nbyte skip: -1\n\n1234", "counts from the end"},
        {"sizes: 2 1 1\nencoding: ascii\n\n1 256", "sample 1 of 2 is not of the type"},
        {"sizes: 2 1 1\nencoding: ascii\n\n1 2.5", "sample 1 of 2 is not of the type"},
        {"sizes: 2 1 1\nencoding: ascii\n\n1;2 3", "sample 0 of 2 is no number"},
        {"sizes: 2 1 1\nencoding: ascii\n\n1 ,,,", "sample 1 of 2 is missing"},
        {"sizes: 2 1 1\nencoding: raw\ndata file: LIST\n", "list of data files is empty"},
        {"sizes: 2 1 3\nencoding: raw\ndata file: LIST\na\nb\n", "size does not match"},
        {"sizes: 2 1 3\nencoding: raw\ndata file: LIST 4\na\nb\nc\n", "files of 4 axes"},
        {"sizes: 2 1 3\nencoding: raw\ndata file: a%d 1 9 0\n", "step"},
        {"sizes: 2 1 3\nencoding: raw\ndata file: a%d 1 9 -1\n", "step"},
        {"sizes: 2 1 3\nencoding: raw\ndata file: a%d 0 2000000000 1\n", "size does not match"},
        {"sizes: 2 1 3\nencoding: raw\ndata file: a\ndata file: b\n", "twice"},
        {"sizes: 2 1 3\nencoding: raw\ndata file: SKIPLIST\na b\n", "SKIPLIST"},
        {"sizes: 2 1 3\nencoding: raw\ndata file: SKIPLIST\n7\n", "SKIPLIST"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        Block b = {.size = 0};
        put_text(&b, "NRRD0004\ntype: uchar\ndimension: 3\n");
        put_text(&b, cases[i].fields);
        save_block("bad.nrrd", &b);
        check_refused("bad.nrrd", NULL, cases[i].why);
    }
}

/* teem, whose format this is, takes each field once, and what has one entry per axis only after their number. */
static void test_order_of_fields(void)
{
    static const char *const fields[] = {"type: uchar", "dimension: 3", "sizes: 2 1 1", "encoding: raw", "endian: little",
                                         "spacings: 1 1 1", "centers: cell cell cell", "kinds: space space space",
                                         "axis mins: 0 0 0", "axis maxs: 1 1 1", "space dimension: 3",
                                         "space directions: (1,0,0) (0,1,0) (0,0,1)", "space origin: (0,0,0)",
                                         "labels: \"x\" \"y\" \"z\"", "units: \"m\" \"m\" \"m\"", "byte skip: 0",
                                         "line skip: 0", "content: none", "thicknesses: 1 1 1"};
    for (size_t n = 0; n < sizeof fields / sizeof *fields; n++) {
        char header[400], why[100];
        Block b = {.size = 0};
        snprintf(header, sizeof header, "NRRD0004\n%s\n# %s\n%s\n%s\nkey:=a\nkey:=b\n%s\nencoding: raw\n\n12",
                 n == 0 ? "content: 1" : "type: uchar", fields[n],
                 n == 1 ? "content: 1" : "dimension: 3", fields[n], fields[n]);
        put_text(&b, header);
        save_block("twice.nrrd", &b);
        snprintf(why, sizeof why, "line 8: NRRD field '%.*s' is there twice, in line 5 too", (int)strcspn(fields[n], ":"),
                 fields[n]);
        check_refused("twice.nrrd", NULL, why);
    }
    Block spellings = {.size = 0};
    put_text(&spellings, "NRRD0004\ntype: uchar\ndimension: 3\ncenters: cell cell cell\nCenterings: node node node\n\n");
    save_block("twice.nrrd", &spellings);
    check_refused("twice.nrrd", NULL, "line 5: NRRD field 'centerings' is there twice, in line 4 too");
    static const char *const per_axis[] = {"sizes: 2 1 1", "spacings: 1 1 1", "centers: cell cell cell", "axis mins: 0 0 0",
                                           "kinds: space space space", "space directions: (1,0,0) (0,1,0) (0,0,1)"};
    for (size_t n = 0; n < sizeof per_axis / sizeof *per_axis; n++) {
        char header[400], why[100];
        Block b = {.size = 0};
        snprintf(header, sizeof header, "NRRD0004\ntype: uchar\n%s\ndimension: 3\n%sencoding: raw\n\n12", per_axis[n],
                 n ? "sizes: 2 1 1\n" : "");
        put_text(&b, header);
        save_block("early.nrrd", &b);
        snprintf(why, sizeof why, "line 3: NRRD field '%.*s' comes before 'dimension'", (int)strcspn(per_axis[n], ":"),
                 per_axis[n]);
        check_refused("early.nrrd", NULL, why);
    }
}

/* Nothing packed, and headers changed at random. */
static void test_random(void)
{
    Block b;
    const char *const packed[] = {"gzip", "bzip2"};
    for (int i = 0; i < 2; i++) {
        begin(&b, packed[i]);
        put_text(&b, "\n");
        (i == 0 ? put_gzip : put_bzip2)(&b, "", 0);
        save_block("empty.nrrd", &b);
        check_refused("empty.nrrd", NULL, "truncated");
    }
    const char *const ends[] = {"axis mins: 0 1 2\naxis maxs: 3 4 nan\ncenters: cell node ???\n"
                                "line skip: 0\nbyte skip: -1\n\n",
                                "space dimension: 4\nspace directions: (1,0,0,0) none (0,0,2,0)\n"
                                "space origin: (1,2,3,4)\n\n",
                                "data file: LIST 2\ncut\ncut\ncut\ncut\n", "data file: cut%d 1 4 1 2\n",
                                "data file: SKIPLIST\n1 cut\n2 cut\n3 cut\n-4 cut\n"};
    for (int i = 0; i < 5; i++) {
        begin(&b, "raw");
        put_text(&b, ends[i]);
        put_counting(&b, 0, 24, 2);
        check_damage(NULL, &b, 2000);
    }
}

/* The whole file packed: also in several streams. */
static void test_packed(void)
{
    Block b, packed = {.size = 0}, more = {.size = 0};
    begin(&b, "raw");
    put_text(&b, "\n");
    put_counting(&b, 0, 24, 2);
    put_bzip2(&packed, b.data, b.size);
    save_block("whole.bz2", &packed);
    check_import("whole.bz2", NULL, VOL_STORE_FLOAT, dims234, NULL, counting);
    check_cuts("whole.bz2", NULL, &packed, packed.size);
    check_damage(NULL, &packed, 500);
    const VolBytes bytes = {packed.data, packed.size};
    CHECK(strcmp(vol_import_format(&bytes), "NRRD") == 0);
    put_bzip2(&more, b.data, 50);
    put_bzip2(&more, b.data + 50, b.size - 50);
    save_block("two.bz2", &more);
    check_import("two.bz2", NULL, VOL_STORE_FLOAT, dims234, NULL, counting);
}

/* ---- Samples alone ---- */

static void test_raw(void)
{
    const char *const names[] = {"s0", "s1", "s2", "s3"};
    for (int packed = 0; packed < 3; packed++) {
        VolImportOptions options = plain;
        options.raw = true;
        options.type = VOL_SAMPLE_U16;
        options.header = 3;
        for (int a = 0; a < 3; a++)
            options.dims[a] = dims234[a];
        Block all = {.size = 0}, out = {.size = 0};
        put_text(&all, "abc");
        put_counting(&all, 0, 24, 2);
        (packed == 0 ? put : packed == 1 ? put_gzip : put_bzip2)(&out, all.data, all.size);
        save_block("all", &out);
        check_import("all", &options, VOL_STORE_FLOAT, dims234, NULL, counting);
        check_cuts("all", &options, &out, all.size); /* as long as `all`, it would pass for samples */
        check_damage(&options, &out, 500);
        options.header = 2;
        check_refused("all", &options, "size does not match");
        options.header = 3;
        for (int i = 0; i < 4; i++) {
            Block slice = {.size = 0}, one = {.size = 0};
            put_text(&slice, "xyz");
            put_counting(&slice, 6 * i, 6, 2);
            (packed == 0 || i == 2 ? put : packed == 1 ? put_gzip : put_bzip2)(&one, slice.data, slice.size);
            save_block(names[i], &one);
        }
        options.dims[2] = 0;
        VolImported got;
        VolError err = {""};
        CHECK(import_files(names, 4, &options, &got, &err) == VOL_OK);
        for (int i = 0; got.single && i < 24; i++)
            CHECK(got.single[i] == (float)i);
        vol_imported_free(&got);
    }
    /* samples that begin like a packed file, and are not: their number tells */
    VolImportOptions options = plain;
    options.raw = true;
    options.type = VOL_SAMPLE_U8;
    options.dims[0] = 4, options.dims[1] = options.dims[2] = 1;
    save("mark", "\x1f\x8b\x08\x07", 4);
    check_import("mark", &options, VOL_STORE_FLOAT, (int32_t[]){4, 1, 1}, NULL, (double[]){0x1f, 0x8b, 8, 7});
}

int main(void)
{
    make_folder();
    RUN(test_spellings);
    RUN(test_places);
    RUN(test_four_axes);
    RUN(test_text);
    RUN(test_encodings);
    RUN(test_byte_skip);
    RUN(test_files);
    RUN(test_skip_list);
    RUN(test_damage);
    RUN(test_order_of_fields);
    RUN(test_random);
    RUN(test_packed);
    RUN(test_raw);
    remove_folder();
    return test_end();
}
