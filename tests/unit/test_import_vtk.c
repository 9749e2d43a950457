/* VTK's image files: what they lack is said, whatever way it is written down; headers are read as VTK reads them.  And
 * what is said of files of other kinds. */
#include <zlib.h>

#include "import_files.h"

/* Images of 3 x 4 x 2 points are enough: values 0 .. 23. */
static const int32_t dims[3] = {3, 4, 2};
static double counting[256];

static const char numbers[] = "0 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17 18 19 20 21 22 23";
static const char lower[] = "0 1 2 3 4 5 6 7 8 9 10 11", upper[] = "12 13 14 15 16 17 18 19 20 21 22 23";

static void save_text(const char *name, const char *text) { save(name, text, strlen(text)); }

/* A .vti of the pieces (or whatever is within ImageData). */
static void save_vti(const char *extent, const char *within)
{
    static char text[1 << 16];
    snprintf(text, sizeof text,
             "<?xml version=\"1.0\"?>\n<VTKFile type=\"ImageData\" version=\"1.0\" byte_order=\"LittleEndian\">\n"
             "<ImageData WholeExtent=\"%s\" Origin=\"7 8 9\" Spacing=\"1 2 3\">%s</ImageData></VTKFile>\n",
             extent, within);
    save_text("a.vti", text);
}

/* One array as text. */
static const char *array(const char *attributes, const char *values)
{
    static char text[8][2048];
    static int next;
    char *to = text[next++ % 8];
    snprintf(to, sizeof *text, "<DataArray type=\"Int16\" Name=\"s\" format=\"ascii\" %s>%s</DataArray>", attributes,
             values);
    return to;
}

/* Arrays of points or cells in a piece. */
static const char *piece(const char *extent, const char *set, const char *arrays)
{
    static char text[8][4096];
    static int next;
    char *to = text[next++ % 8];
    snprintf(to, sizeof *text, "<Piece Extent=\"%s\"><%s>%s</%s></Piece>", extent, set, arrays, set);
    return to;
}

__attribute__((noinline)) static const char *both(const char *a, const char *b)
{
    static char text[8][8192];
    static int next;
    char *to = text[next++ % 8];
    snprintf(to, sizeof *text, "%s%s", a, b);
    return to;
}

#define WHOLE "0 2 0 3 0 1"
#define FRONT "0 2 0 3 0 0"
#define BACK "0 2 0 3 1 1"

/* ---- Pieces ---- */

static void test_pieces(void)
{
    const char *front = piece(FRONT, "PointData", array("", lower)), *back = piece(BACK, "PointData", array("", upper));
    save_vti(WHOLE, both(front, back));
    check_import("a.vti", NULL, VOL_STORE_FLOAT, dims, (double[]){1, 0, 0, 0, 2, 0, 0, 0, 3, 7, 8, 9}, counting);
    save_vti(WHOLE, both(back, front));
    check_import("a.vti", NULL, VOL_STORE_FLOAT, dims, NULL, counting);
    /* Overlapping ones: the last holds. */
    save_vti(WHOLE, both(piece(WHOLE, "PointData", array("", numbers)), back));
    check_import("a.vti", NULL, VOL_STORE_FLOAT, dims, NULL, counting);
    char last[24 * 4 + 1] = "";
    double twos[24];
    for (int i = 0; i < 24; i++) {
        strcat(last, "2 ");
        twos[i] = i < 12 ? i : 2;
    }
    save_vti(WHOLE, both(piece(WHOLE, "PointData", array("", numbers)), piece(BACK, "PointData", array("", last))));
    check_import("a.vti", NULL, VOL_STORE_FLOAT, dims, NULL, twos);
    /* One that is not needed, and empty ones, may lack the array. */
    save_vti(WHOLE, both(piece(BACK, "PointData", ""), piece(WHOLE, "PointData", array("", numbers))));
    check_import("a.vti", NULL, VOL_STORE_FLOAT, dims, NULL, counting);
    save_vti(WHOLE, both("<Piece Extent=\"0 -1 0 -1 0 -1\"><PointData/></Piece>", both(front, back)));
    check_import("a.vti", NULL, VOL_STORE_FLOAT, dims, NULL, counting);
    /* Other pieces may have their arrays in another order. */
    const char *other = "<DataArray type=\"Int16\" Name=\"o\" format=\"ascii\">1</DataArray>";
    VolImportOptions named = plain;
    named.array = "s";
    save_vti(WHOLE, both(piece(FRONT, "PointData", both(array("", lower), other)),
                         piece(BACK, "PointData", both(other, array("", upper)))));
    check_import("a.vti", &named, VOL_STORE_FLOAT, dims, NULL, counting); /* and the other may be short */
    named.array = "o";
    check_refused("a.vti", &named, "array 'o' (points) of piece 1 (extent " FRONT "): truncated: it holds 1 of its 12");
    /* Without pieces the image is one. */
    save_vti(WHOLE, both("<PointData>", both(array("", numbers), "</PointData>")));
    check_import("a.vti", NULL, VOL_STORE_FLOAT, dims, NULL, counting);
    /* Beyond the whole extent a piece is cut. */
    save_vti(FRONT, piece(WHOLE, "PointData", array("", numbers)));
    check_import("a.vti", NULL, VOL_STORE_FLOAT, (int32_t[]){3, 4, 1}, NULL, counting);
}

static void test_holes(void)
{
    const char *front = piece(FRONT, "PointData", array("", lower));
    const char hole[] = "array 's' (points) has no value at 0 0 1 of WholeExtent " WHOLE ": ";
    char want[300];
    const struct {
        const char *within, *says;
    } rows[] = {
        {front, "no piece covers it"},
        {both(front, piece("0 2 0 3 2 2", "PointData", array("", upper))), "no piece covers it"},
        {both(front, piece(BACK, "PointData", "")), "piece 2 (extent " BACK ") is without the array"},
        {both(piece(BACK, "CellData", ""), front), "piece 1 (extent " BACK ") is without the array"},
        {both(front, "<Piece Extent=\"" BACK "\"/>"), "piece 2 (extent " BACK ") is without the array"},
        {both(front, piece(BACK, "PointData", "<DataArray type=\"Int16\" Name=\"t\" format=\"ascii\">1</DataArray>")),
         "piece 2 (extent " BACK ") is without the array"},
    };
    VolImportOptions named = plain;
    named.array = "s";
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        save_vti(WHOLE, rows[i].within);
        snprintf(want, sizeof want, "%s%s", hole, rows[i].says);
        check_refused("a.vti", &named, want);
    }
    save_vti(WHOLE, both(front, piece("0 2 0 1 1 1", "PointData", array("", "1 2 3 4 5 6"))));
    check_refused("a.vti", NULL, "has no value at 0 2 1");
    save_vti(WHOLE, both(front, piece("1 2 0 3 1 1", "PointData", array("", "1 2 3 4 5 6 7 8"))));
    check_refused("a.vti", NULL, "has no value at 0 0 1");
    save_vti("0 2000 0 2000 0 2000", front);
    check_refused("a.vti", NULL, "12 of the 8012006001 values that WholeExtent asks for: pieces are missing");
}

static void test_no_pieces(void)
{
    save_vti(WHOLE, "");
    check_refused("a.vti", NULL, "there are none");
    save_vti(WHOLE, "<Piece Extent=\"0 -1 0 -1 0 -1\"><PointData/></Piece>");
    check_refused("a.vti", NULL, "there are none");
    save_vti("0 -1 0 -1 0 -1", piece("0 -1 0 -1 0 -1", "PointData", array("", "")));
    check_refused("a.vti", NULL, "its WholeExtent is empty");
    save_vti(WHOLE, both("<Piece><PointData>", both(array("", numbers), "</PointData></Piece>")));
    check_refused("a.vti", NULL, "the Extent of piece 1 is not six numbers");
    save_vti("0 2 0 3 0", piece(WHOLE, "PointData", array("", numbers)));
    check_refused("a.vti", NULL, "WholeExtent of ImageData is not six numbers");
    save_text("a.vti", "<VTKFile type=\"ImageData\"><PolyData/></VTKFile>");
    check_refused("a.vti", NULL, "no element ImageData");
}

static void test_unlike_pieces(void)
{
    const char *front = piece(FRONT, "PointData", array("", lower));
    const char unlike[] = "<DataArray type=\"Float32\" Name=\"s\" format=\"ascii\">"
                          "12 13 14 15 16 17 18 19 20 21 22 23</DataArray>";
    save_vti(WHOLE, both(front, piece(BACK, "PointData", unlike)));
    check_refused("a.vti", NULL,
                  "of piece 2 (extent " BACK ") has 1 components of type Float32, in piece 1 1 of Int16");
    save_vti(WHOLE, both(front, piece(BACK, "PointData", array("NumberOfComponents=\"2\"", upper))));
    check_refused("a.vti", NULL, "of piece 2 (extent " BACK ") has 2 components of type Int16, in piece 1 1 of Int16");
    save_vti(WHOLE, both(front, piece(BACK, "PointData", array("", "12 13"))));
    check_refused("a.vti", NULL, "of piece 2 (extent " BACK "): truncated: it holds 2 of its 12 values");
    save_vti(WHOLE, both(front, piece(BACK, "PointData", array("", "12 13 x 15 16 17 18 19 20 21 22 23"))));
    check_refused("a.vti", NULL, "value 3 of 12, 'x', is no Int16");
    save_vti(WHOLE, piece(WHOLE, "PointData", array("NumberOfComponents=\"0\"", numbers)));
    check_refused("a.vti", NULL, "has 0 components");
    save_vti(WHOLE, piece(WHOLE, "PointData", "<DataArray type=\"Byte\" Name=\"b\" format=\"ascii\">1</DataArray>"));
    check_refused("a.vti", NULL, "values of type 'Byte' are not read");
}

static void test_cells(void)
{
    /* 2 x 3 x 1 cells between the points. */
    save_vti(WHOLE, piece(WHOLE, "CellData", array("", "0 1 2 3 4 5")));
    check_import("a.vti", NULL, VOL_STORE_FLOAT, (int32_t[]){2, 3, 1},
                 (double[]){1, 0, 0, 0, 2, 0, 0, 0, 3, 7.5, 9, 10.5}, counting);
    save_vti(WHOLE, piece(WHOLE, "CellData", array("", "0 1 2 3 4")));
    check_refused("a.vti", NULL, "array 's' (cells) of piece 1 (extent " WHOLE "): truncated: it holds 5 of its 6");
    /* Pieces that share a layer of points have cells side by side. */
    save_vti(WHOLE, both(piece("0 1 0 3 0 1", "CellData", array("", "0 2 4")),
                         piece("1 2 0 3 0 1", "CellData", array("", "1 3 5"))));
    check_import("a.vti", NULL, VOL_STORE_FLOAT, (int32_t[]){2, 3, 1}, NULL, counting);
    /* Where they do not, all points are there, but not all cells. */
    save_vti(WHOLE, both(piece("0 1 0 3 0 1", "CellData", array("", "0 2 4")), piece("2 2 0 3 0 1", "CellData", "")));
    check_refused("a.vti", NULL, "array 's' (cells) has no value at 1 0 0");
    save_vti(FRONT, piece(FRONT, "CellData", array("", "0 1 2 3 4 5")));
    check_import("a.vti", NULL, VOL_STORE_FLOAT, (int32_t[]){2, 3, 1}, (double[]){1, 0, 0, 0, 2, 0, 0, 0, 3, 7.5, 9, 9},
                 counting);
}

static void test_time_steps(void)
{
    static char text[1 << 14];
    VolImportOptions step = plain;
    snprintf(
        text, sizeof text,
        "<VTKFile type=\"ImageData\"><ImageData WholeExtent=\"" WHOLE "\" TimeValues=\"0 0.5 1\">"
        "<Piece Extent=\"" WHOLE "\"><PointData Scalars=\"s\">%s%s%s</PointData></Piece></ImageData></VTKFile>",
        array("TimeStep=\"0\"", "1 2 3"), array("TimeStep=\"1\"", numbers),
        "<DataArray type=\"Float32\" Name=\"t\" format=\"ascii\">0 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17 18 19 20 "
        "21 22 23</DataArray>");
    save_text("a.vti", text);
    check_refused("a.vti", NULL, "it holds 3 of its 24 values");
    step.time_step = 1;
    check_import("a.vti", &step, VOL_STORE_FLOAT, dims, NULL, counting);
    step.time_step = 2;
    check_refused("a.vti", &step, "array 's' (points) has no value at time step 2 at 0 0 0");
    step.time_step = 3;
    step.array = "t"; /* of every step */
    check_refused("a.vti", &step, "there is no time step 3: there are 3");
    step.time_step = 2;
    check_import("a.vti", &step, VOL_STORE_FLOAT, dims, NULL, counting);
}

/* ---- Encodings ---- */

static void put_base64(Block *b, const unsigned char *data, size_t size)
{
    static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    for (size_t i = 0; i < size; i += 3) {
        unsigned bits = (unsigned)data[i] << 16 | (i + 1 < size ? (unsigned)data[i + 1] << 8 : 0) |
                        (i + 2 < size ? data[i + 2] : 0);
        char four[4] = {digits[bits >> 18], digits[bits >> 12 & 63], i + 1 < size ? digits[bits >> 6 & 63] : '=',
                        i + 2 < size ? digits[bits & 63] : '='};
        put(b, four, 4);
    }
}

enum { PLAIN, ZLIB, LZ4, LZMA };

/* Numbers before the data in `head`, the data, packed or not, in `body`: bytes from 0 to 23, in two blocks with zlib.
 */
static void encode(int packing, size_t word, bool big, Block *head, Block *body)
{
    static const unsigned char xz[] = {0xfd, 0x37, 0x7a, 0x58, 0x5a, 0x00, 0x00, 0x01, 0x69, 0x22, 0xde, 0x36, 0x02,
                                       0x00, 0x21, 0x01, 0x16, 0x00, 0x00, 0x00, 0x74, 0x2f, 0xe5, 0xa3, 0x01, 0x00,
                                       0x17, 0x00, 0x01, 0x02, 0x03, 0x04, 0x05, 0x06, 0x07, 0x08, 0x09, 0x0a, 0x0b,
                                       0x0c, 0x0d, 0x0e, 0x0f, 0x10, 0x11, 0x12, 0x13, 0x14, 0x15, 0x16, 0x17, 0x00,
                                       0x96, 0xa6, 0x95, 0x82, 0x00, 0x01, 0x2c, 0x18, 0xd3, 0x46, 0xdb, 0x0a, 0x90,
                                       0x42, 0x99, 0x0d, 0x01, 0x00, 0x00, 0x00, 0x00, 0x01, 0x59, 0x5a};
    unsigned char data[24];
    for (int i = 0; i < 24; i++)
        data[i] = (unsigned char)i;
    head->size = body->size = 0;
    if (packing == PLAIN) {
        put_int(head, 24, (int)word, big);
        put(body, data, 24);
        return;
    }
    put_int(head, packing == ZLIB ? 2 : 1, (int)word, big);
    put_int(head, packing == ZLIB ? 16 : 24, (int)word, big);
    put_int(head, packing == ZLIB ? 8 : 0, (int)word, big);
    for (int block = 0; packing == ZLIB && block < 2; block++) {
        unsigned char packed[64];
        uLongf size = sizeof packed;
        if (compress(packed, &size, data + 16 * block, block ? 8 : 16) != Z_OK)
            abort();
        put_int(head, size, (int)word, big);
        put(body, packed, size);
    }
    if (packing == LZ4) {
        put(body, "\xf0\x09", 2); /* 15 + 9 literals, and no match */
        put(body, data, 24);
        put_int(head, body->size, (int)word, big);
    } else if (packing == LZMA) {
        put(body, xz, sizeof xz);
        put_int(head, body->size, (int)word, big);
    }
}

/* A .vti whose array is encoded in one of the ways; appended data have 5 bytes before them. */
static void make_binary(Block *b, int packing, size_t word, bool big, bool appended, bool raw, const char *extent)
{
    static const char *const packings[] = {"", "compressor=\"vtkZLibDataCompressor\"",
                                           "compressor=\"vtkLZ4DataCompressor\"",
                                           "compressor=\"vtkLZMADataCompressor\""};
    static Block head, body;
    char text[1024];
    encode(packing, word, big, &head, &body);
    if (packing == PLAIN && !raw) { /* in one piece */
        put(&head, body.data, body.size);
        body.size = 0;
    }
    b->size = 0;
    snprintf(text, sizeof text,
             "<VTKFile type=\"ImageData\" version=\"1.0\" byte_order=\"%s\" header_type=\"UInt%zu\" %s>"
             "<ImageData WholeExtent=\"%s\"><Piece Extent=\"%s\"><PointData>"
             "<DataArray type=\"UInt8\" Name=\"s\" format=\"%s\" %s>",
             big ? "BigEndian" : "LittleEndian", 8 * word, packings[packing], extent, extent,
             appended ? "appended" : "binary", appended ? "offset=\"5\"" : "");
    put_text(b, text);
    if (!appended) {
        put_text(b, "\n  ");
        put_base64(b, head.data, head.size);
        put_base64(b, body.data, body.size);
        put_text(b, "\n");
    }
    put_text(b, "</DataArray></PointData></Piece></ImageData>");
    if (appended) {
        put_text(b, raw ? "<AppendedData encoding=\"raw\">\n  _12345" : "<AppendedData encoding=\"base64\">\n_12345");
        if (raw) {
            put(b, head.data, head.size);
            put(b, body.data, body.size);
        } else {
            put_base64(b, head.data, head.size);
            put_base64(b, body.data, body.size);
        }
        put_text(b, "\n</AppendedData>");
    }
    put_text(b, "</VTKFile>");
}

static void test_encodings(void)
{
    static Block b;
    for (int n = 0; n < 4 * 2 * 2 * 3; n++) {
        int packing = n % 4, way = n / 16;
        size_t word = n / 4 % 2 ? 8 : 4;
        bool big = n / 8 % 2;
        make_binary(&b, packing, word, big, way > 0, way > 1, WHOLE);
        save_block("a.vti", &b);
        check_import("a.vti", NULL, VOL_STORE_FLOAT, dims, NULL, counting);
        check_cuts("a.vti", NULL, &b, b.size);
        check_damage(NULL, &b, 200);
        /* More points than values. */
        make_binary(&b, packing, word, big, way > 0, way > 1, "0 2 0 3 0 2");
        save_block("a.vti", &b);
        check_refused("a.vti", NULL, "truncated: it holds 24 of its 36 values");
        if (test_failed_checks)
            FAIL("way %d, packing %d, word %zu", way, packing, word);
    }
}

/* Sizes that the file cannot hold are found out before memory is taken for them. */
static void test_forged_sizes(void)
{
    static Block b;
    static char text[4096];
    const char *const extents[] = {"0 2147483647 0 2147483647 0 2147483647", "-2147483648 2147483647 0 0 0 0",
                                   "0 65535 0 65535 0 255"};
    for (size_t i = 0; i < sizeof extents / sizeof *extents; i++)
        for (int way = 0; way < 3; way++)
            for (int packing = 0; packing < 4; packing++) {
                make_binary(&b, packing, 8, false, way > 0, way > 1, extents[i]);
                save_block("a.vti", &b);
                check_refused("a.vti", NULL, "");
            }
    /* A table of blocks that promises a terabyte of zeros. */
    snprintf(text, sizeof text,
             "<VTKFile type=\"ImageData\" byte_order=\"LittleEndian\" compressor=\"vtkZLibDataCompressor\">"
             "<ImageData WholeExtent=\"0 1023 0 1023 0 1023\"><Piece Extent=\"0 1023 0 1023 0 1023\"><PointData>"
             "<DataArray type=\"UInt8\" Name=\"s\" format=\"appended\" offset=\"0\"/></PointData></Piece></ImageData>"
             "<AppendedData encoding=\"raw\">_");
    b.size = 0;
    put_text(&b, text);
    put_int(&b, 1, 4, false);
    put_int(&b, 1 << 30, 4, false);
    put_int(&b, 0, 4, false);
    put_int(&b, 8, 4, false);
    put_text(&b, "12345678</AppendedData></VTKFile>");
    save_block("a.vti", &b);
    check_refused("a.vti", NULL, "the sizes of its packed blocks cannot be");
}

/* ---- Headers in XML ---- */

static void test_xml_headers(void)
{
    static char text[1 << 15], padding[6001];
    memset(padding, '-', sizeof padding - 1);
    for (size_t i = 1; i < sizeof padding - 1; i += 2)
        padding[i] = ' ';
    const struct {
        const char *before, *file, *after;
    } rows[] = {
        {"", "<VTKFile type = \"ImageData\" version\n=\t\"1.0\" byte_order = 'LittleEndian' >", ""},
        {"", "<VTKFile byte_order='LittleEndian' version='1.0' type='ImageData'>", ""},
        {"", "<VTKFile\n\ttype='ImageData'\r\n>", ""},
        {"", "<VTKFile note=\"type='PolyData'\" type=\"ImageData\" xtype=\"PolyData\">", ""},
        {"", "<VTKFile type=\"Image&#68;ata\">", ""},
        {"\xef\xbb\xbf<?xml version='1.0' encoding='UTF-8'?>", "<VTKFile type='ImageData'>", ""},
        {"<?xml version=\"1.0\"?><!-- <VTKFile type=\"PolyData\"> </VTKFile> -->\n", "<VTKFile type=\"ImageData\">",
         ""},
        {"\n\n <?x <VTKFile type=\"PolyData\"?>", "<VTKFile type=\"ImageData\">", "<?x </VTKFile>?>"},
        {"<!DOCTYPE VTKFile [<!ELEMENT VTKFile ANY> <!-- > ]> -->]>", "<VTKFile type=\"ImageData\">", ""},
        {"", "<VTKFile type=\"ImageData\">", "<!-- </VTKFile> <AppendedData> -->"},
        {"", "<VTKFile type=\"ImageData\">", "<Other><![CDATA[</VTKFile><ImageData> & ]]></Other>"},
        {"<!--", padding, "--><VTKFile type=\"ImageData\">"},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        snprintf(text, sizeof text,
                 "%s%s%s<ImageData Spacing='1 2 3' WholeExtent\n = ' 0 2  0 3\n0 1 '><!-- <Piece/> --><Piece\n"
                 "Extent='" WHOLE "'><PointData Scalars='s'>%s</PointData></Piece></ImageData></VTKFile><!-- -->\n",
                 rows[i].before, rows[i].file, rows[i].after, array("", numbers));
        save_text("a.vti", text);
        check_import("a.vti", NULL, VOL_STORE_FLOAT, dims, NULL, counting);
        VolBytes bytes = {(unsigned char *)text, strlen(text)};
        CHECK_TEXT(vol_import_format(&bytes) ? vol_import_format(&bytes) : "none", ".vti");
        if (test_failed_checks)
            FAIL("header %zu", i);
    }
}

static void test_other_xml(void)
{
    const char *const texts[] = {
        "<?xml version=\"1.0\"?><VoreenData version=\"1\"><!-- <VTKFile type=\"ImageData\"> --></VoreenData>",
        "<a><VTKFile type=\"ImageData\"></VTKFile></a>",
        "<VTKFiles type=\"ImageData\"/>",
        "<!-- <VTKFile type",
        "<!-- <VTKFile type=\"ImageData\"> ",
        "<!-- ",
        "<!",
        "<?",
        "<",
        "<VTKFile",
        "<!DOCTYPE a [",
        "<!DOCTYPE \""};
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
        VolBytes bytes = {(unsigned char *)(uintptr_t)texts[i], strlen(texts[i])};
        CHECK(vol_import_format(&bytes) == NULL);
        save_text("a.xml", texts[i]);
        check_refused("a.xml", NULL, "unknown format");
    }
    const char *const kinds[] = {"PolyData",       "UnstructuredGrid", "RectilinearGrid",
                                 "StructuredGrid", "PImageData",       "vtkMultiBlockDataSet",
                                 "Collection",     "HyperTreeGrid",    "imagedata"};
    for (size_t i = 0; i < sizeof kinds / sizeof *kinds; i++) {
        char text[300], says[200];
        snprintf(text, sizeof text, "<!-- type=\"ImageData\" --><VTKFile version = '1.0'\n type = '%s'><x", kinds[i]);
        snprintf(says, sizeof says, "VTK files of kind '%s' are not read in this version (ImageData are)", kinds[i]);
        save_text("a.vtu", text);
        check_refused("a.vtu", NULL, says);
    }
    save_text("a.vti", "<VTKFile version=\"1.0\"><ImageData/></VTKFile>");
    check_refused("a.vti", NULL, "it has no type");
    save_text("a.vti", "<VTKFile type=\"ImageData\" byte_order=\"Middle\"></VTKFile>");
    check_refused("a.vti", NULL, "byte_order=\"Middle\" is not known");
    save_text("a.vti", "<VTKFile type=\"ImageData\" compressor=\"x\"></VTKFile>");
    check_refused("a.vti", NULL, "compressor=\"x\" is not known");
    save_text("a.vti", "<VTKFile type=\"ImageData\">\n<ImageData></VTKFile>");
    check_refused("a.vti", NULL, "");
    save_text("a.vti", "<VTKFile type=\"ImageData\">\n<ImageData WholeExtent=\"" WHOLE "\">\n</VTKFile>");
    check_refused("a.vti", NULL, "damaged: line 3: mismatched tag");
}

/* ---- Legacy ---- */

#define HEAD "# vtk DataFile Version 3.0\nt\nASCII\n"
#define PLACE "DATASET STRUCTURED_POINTS\nDIMENSIONS 3 4 2\nORIGIN 7 8 9\nSPACING 1 2 3\n"
#define SCALARS "POINT_DATA 24\nSCALARS s short 1\nLOOKUP_TABLE default\n"

static void check_legacy(const char *before, const char *values)
{
    static char text[8192];
    snprintf(text, sizeof text, "%s%s\n", before, values);
    save_text("a.vtk", text);
    check_import("a.vtk", NULL, VOL_STORE_FLOAT, dims, (double[]){1, 0, 0, 0, 2, 0, 0, 0, 3, 7, 8, 9}, counting);
    /* The same with the line ends of DOS, and in lower case. */
    static char dos[8192], small[8192];
    size_t n = 0;
    for (const char *c = text; *c; c++) {
        if (*c == '\n')
            dos[n++] = '\r';
        dos[n++] = *c;
    }
    save("a.vtk", dos, n);
    check_import("a.vtk", NULL, VOL_STORE_FLOAT, dims, NULL, counting);
    snprintf(small, sizeof small, "%s", text);
    for (char *c = strchr(small, '\n'); *c; c++)
        *c = (char)(*c >= 'A' && *c <= 'Z' ? *c + 'a' - 'A' : *c);
    save_text("a.vtk", small);
    check_import("a.vtk", NULL, VOL_STORE_FLOAT, dims, NULL, counting);
    if (test_failed_checks)
        FAIL("header '%.40s'", before);
}

static void test_legacy_headers(void)
{
    static const char *const headers[] = {
        HEAD PLACE SCALARS,
        "# vtk DataFile Version 1.0\nDATASET POLYDATA from run 7\nASCII\n\n" PLACE "\n" SCALARS,
        "# vtk DataFile Version 2.0\n\nASCII\nDATASET   STRUCTURED_POINTS\tDIMENSIONS\t3 4\n2 SPACING 1 2 3 ORIGIN 7 8 "
        "9 "
        "POINT_DATA 24 SCALARS s short LOOKUP_TABLE default ",
        "# vtk DataFile Version 5.1\nt\nASCII\nDATASET STRUCTURED_POINTS\nDIMENSIONS 3 4 2\nASPECT_RATIO 1 2 3\nORIGIN "
        "7 8 "
        "9\n"
        "FIELD FieldData 2\nTIME 1 1 double\n0.5\nMETADATA\nINFORMATION 1\nNAME a LOCATION b\nDATA 1\n\n"
        "note 1 2 string\nDATASET x\nPOINT_DATA y\n" SCALARS,
        HEAD PLACE "POINT_DATA 24\nFIELD f 1\no%20p 2 2 float\n1 2 3 4\nMETADATA\nCOMPONENT_NAMES\n\nb\n\n"
                   "SCALARS s short 1\nLOOKUP_TABLE default\n",
        HEAD "DATASET STRUCTURED_POINTS\nEXTENT 0 2 0 3 0 1\nORIGIN 7 8 9\nSPACING 1 2 3\n"
             "CELL_DATA 6\nSCALARS c float\nLOOKUP_TABLE m\n1 2 3 4 5 6\nLOOKUP_TABLE m 2\n0 0 0 1 1 1 1 1\n" SCALARS,
    };
    for (size_t i = 0; i < sizeof headers / sizeof *headers; i++)
        check_legacy(headers[i], numbers);
    static char title[700];
    memset(title, 'x', sizeof title - 1);
    static char text[2048];
    snprintf(text, sizeof text, "# vtk DataFile Version 3.0\n%s\nASCII\n" PLACE SCALARS, title);
    check_legacy(text, numbers);
}

static void test_legacy_binary(void)
{
    Block b = {.size = 0};
    put_text(&b, "# vtk DataFile Version 3.0\nt\nBINARY\n" PLACE "POINT_DATA 24\nVECTORS v unsigned_char\n");
    for (int i = 0; i < 9; i++)
        put_text(&b, "DATASET\n"); /* 72 bytes */
    put_text(&b, "\nSCALARS s short 1\nLOOKUP_TABLE default\n");
    for (int i = 0; i < 24; i++)
        put_int(&b, (uint64_t)i, 2, true);
    size_t whole = b.size;
    put_text(&b, "\nMETADATA\nINFORMATION 0\n\n");
    save_block("a.vtk", &b);
    check_import("a.vtk", NULL, VOL_STORE_FLOAT, dims, NULL, counting);
    VolImportOptions named = plain;
    named.array = "s";
    check_cuts("a.vtk", &named, &b, whole);
    check_damage(NULL, &b, 2000);
    /* A line of any length comes before the data. */
    b.size = 0;
    put_text(&b,
             "# vtk DataFile Version 3.0\nt\nBINARY\n" PLACE "POINT_DATA 24\nSCALARS s short 1\nLOOKUP_TABLE default");
    for (int i = 0; i < 300; i++)
        put_text(&b, " ");
    put_text(&b, "\n");
    for (int i = 0; i < 24; i++)
        put_int(&b, (uint64_t)i, 2, true);
    save_block("a.vtk", &b);
    check_import("a.vtk", NULL, VOL_STORE_FLOAT, dims, NULL, counting);
}

static void test_legacy_refused(void)
{
    const struct {
        const char *text, *says;
    } rows[] = {
        {HEAD "DATASET UNSTRUCTURED_GRID\nPOINTS 1 float\n0 0 0\n", "kind 'UNSTRUCTURED_GRID' are not read"},
        {HEAD "dataset rectilinear_grid\n", "kind 'RECTILINEAR_GRID' are not read"},
        {HEAD "DATASET STRUCTURED_GRID\n", "kind 'STRUCTURED_GRID' are not read"},
        {HEAD "DATASET POLYDATA\n", "kind 'POLYDATA' are not read"},
        {HEAD "FIELD FieldData 1\nDATASET STRUCTURED_POINTS\n", "kind 'FIELD' are not read"},
        {"# vtk DataFile Version 3.0\nt\nASCI\n" PLACE, "neither ASCII nor BINARY"},
        {"# vtk DataFile Version 3.0\nDATASET STRUCTURED_POINTS\nASCII\n", "truncated after 59 bytes"},
        {HEAD PLACE, "there are none"},
        {HEAD PLACE "POINT_DATA 24\n", "there are none"},
        {HEAD PLACE "POINT_DATA 24\nSCALARS s short 1\n", "truncated"},
        {HEAD PLACE SCALARS, "array 's' holds 0 of its 24 values"},
        {HEAD PLACE SCALARS "1 2 3\n", "array 's' holds 3 of its 24 values"},
        {HEAD PLACE "POINT_DATA 3\nSCALARS s short 1\nLOOKUP_TABLE default\n1 2 3\n",
         "array 's' has 3 values, the image 3 x 4 x 2 points"},
        {HEAD PLACE "POINT_DATA 99999999999999\nSCALARS s double 1\nLOOKUP_TABLE default\n1 2 3\n", "holds 3 of its"},
        {HEAD PLACE "POINT_DATA 24\nFIELD f 1\na 1 999999999999999 string\nx\ny\n", "holds 2 of its"},
        {HEAD PLACE "POINT_DATA 24\nFIELD f 2000000000\na 1 1 int\n1\n", "arrays of a FIELD are missing"},
        {HEAD PLACE "POINT_DATA 24\nFIELD f 1\na -1 2 int\n1\n", "are impossible"},
        {HEAD PLACE "POINT_DATA 24\nSCALARS s shirt 1\nLOOKUP_TABLE default\n1\n", "type 'shirt' is not known"},
        {HEAD PLACE "POINT_DATA 24\nSCALARS s short 1\n1 2 3\n", "a LOOKUP_TABLE"},
        {HEAD "DATASET STRUCTURED_POINTS\nSPACING 1 1 1\nPOINT_DATA 1\nSCALARS s short\nLOOKUP_TABLE default\n1\n",
         "its DIMENSIONS are missing"},
        {HEAD "DATASET STRUCTURED_POINTS\nDIMENSIONS 3 0 2\nPOINT_DATA 0\nSCALARS s short\nLOOKUP_TABLE default\n",
         "its DIMENSIONS are not positive"},
        {HEAD "DATASET STRUCTURED_POINTS\nDIMENSIONS 3 four 2\n", "DIMENSIONS are to be three numbers"},
        {HEAD PLACE "POINTS 24 float\n", "'POINTS' is no keyword of STRUCTURED_POINTS"},
        {HEAD PLACE "POINT_DATA 24\nNONSENSE\n", "'NONSENSE' is no attribute of points"},
        {HEAD PLACE
         "POINT_DATA 24\nSCALARS s bit 1\nLOOKUP_TABLE default\n0 1 0 1 0 1 0 1 0 1 0 1 0 1 0 1 0 1 0 1 0 1 0 x",
         "value 24 of 24 of array 's', 'x', is no number of its type"},
        {HEAD PLACE SCALARS "0 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17 18 19 20 21 22 70000",
         "value 24 of 24 of array 's', '70000', is no number of its type"},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        save_text("a.vtk", rows[i].text);
        check_refused("a.vtk", NULL, rows[i].says);
    }
}

static void test_legacy_other_arrays(void)
{
    save_text("a.vtk", HEAD "DATASET STRUCTURED_POINTS\nDIMENSIONS 2 1 1\nCELL_DATA 1\nFIELD f 2\nNULL_ARRAY\n"
                            "a%20b%2 1 1 int\n7\n");
    VolImportOptions named = plain;
    named.array = "a b%2";
    check_import("a.vtk", &named, VOL_STORE_INT32, (int32_t[]){1, 1, 1}, NULL, (double[]){7});
    save_text("a.vtk",
              HEAD "DATASET STRUCTURED_POINTS\nDIMENSIONS 2 1 1\nPOINT_DATA 2\nCOLOR_SCALARS c 2\n0 0.5 1 2\n");
    VolImportOptions component = plain;
    component.component = 0;
    check_import("a.vtk", &component, VOL_STORE_FLOAT, (int32_t[]){2, 1, 1}, NULL, (double[]){0, 255});
    component.component = 1;
    check_import("a.vtk", &component, VOL_STORE_FLOAT, (int32_t[]){2, 1, 1}, NULL, (double[]){128, 255});
}

/* ---- Others ---- */

/* A PLOT3D grid or solution of 3 x 4 x 2 points, in one block or two of them. */
static void put_plot3d(Block *b, bool big, bool records, int blocks, bool solution, int size)
{
    b->size = 0;
    if (blocks > 1) {
        if (records)
            put_int(b, 4, 4, big);
        put_int(b, (uint64_t)blocks, 4, big);
        if (records)
            put_int(b, 4, 4, big);
    }
    if (records)
        put_int(b, (uint64_t)(12 * blocks), 4, big);
    for (int i = 0; i < blocks; i++)
        for (int a = 0; a < 3; a++)
            put_int(b, (uint64_t)dims[a], 4, big);
    if (records)
        put_int(b, (uint64_t)(12 * blocks), 4, big);
    for (int i = 0; i < blocks; i++) {
        uint64_t bytes[2] = {solution ? 4u * (uint64_t)size : 0, (solution ? 5u : 3u) * 24 * (uint64_t)size};
        for (int r = solution ? 0 : 1; r < 2; r++) {
            if (records)
                put_int(b, bytes[r], 4, big);
            for (uint64_t n = 0; n < bytes[r]; n++)
                put(b, "?", 1);
            if (records)
                put_int(b, bytes[r], 4, big);
        }
    }
}

#define TEXT(s) s, sizeof(s) - 1

static void test_unread(void)
{
    static Block b;
    for (int n = 0; n < 32; n++) {
        put_plot3d(&b, n & 1, n & 2, n & 4 ? 2 : 1, n & 8, n & 16 ? 8 : 4);
        save_block("flow", &b);
        check_refused("flow", NULL, "it is laid out as PLOT3D, which is not read in this version");
        put(&b, "x", 1);
        save_block("flow", &b);
        check_refused("flow", NULL, "unknown format");
    }
    const struct {
        const char *name, *text;
        size_t size;
        const char *says;
    } rows[] = {
        {"a", TEXT("CDF\1\0\0\0\0\0\0\0\12\0\0\0\2\0\0\0\12len_string\0\0num_dim\0\0"), "it is an Exodus mesh (netCDF),"},
        {"a", TEXT("CDF\2\0\0\0\0\0\0\0\12\0\0\0\1\0\0\0\4time"), "it is netCDF (as are Exodus meshes),"},
        {"a", TEXT("CDF\5\0\0\0\0\0\0\0\0num_nodes"), "it is an Exodus mesh (netCDF),"},
        {"a", TEXT("\x89HDF\r\n\x1a\n\0\0\0\0"), "it is HDF5 (as are netCDF 4 and VTKHDF),"},
        {"a", TEXT("\x89HDF\r\n\x1a\n\0\0\0\0 VTKHDF"), "it is a VTKHDF file (HDF5),"},
        {"a", TEXT("\x89HDF\r\n\x1a\n\0\0\0\0 num_nodes"), "it is an Exodus mesh (netCDF in HDF5),"},
        {"a", TEXT("# made by x\n\nFORMAT\n type:   ensight gold\nGEOMETRY\n"), "it is an EnSight case file,"},
        {"a", TEXT("C Binary\0\0\0\0\0\0"), "it is an EnSight geometry file,"},
        {"a.XYZ", TEXT("2 2 2\n1 2 3\n"), "its name says PLOT3D, which is not read in this version"},
        {"a.q", TEXT("2 2 2\n1 2 3\n"), "its name says PLOT3D,"},
        {"a.exo", TEXT("hello"), "its name says Exodus,"},
        {"a", TEXT("FORMAT\nof\n"), "unknown format"},
        {"a", TEXT("CDF\3"), "unknown format"},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        save(rows[i].name, rows[i].text, rows[i].size);
        check_refused(rows[i].name, NULL, rows[i].says);
    }
    /* Several of them are not taken for a series. */
    const char *const two[] = {"a.XYZ", "a.q"};
    VolImported got;
    VolError err = {""};
    CHECK(import_files(two, 2, &plain, &got, &err) == VOL_BAD_INPUT);
    CHECK(strstr(err.text, "its name says PLOT3D") != NULL);
}

int main(void)
{
    make_folder();
    for (int i = 0; i < 256; i++)
        counting[i] = i;
    RUN(test_pieces);
    RUN(test_holes);
    RUN(test_no_pieces);
    RUN(test_unlike_pieces);
    RUN(test_cells);
    RUN(test_time_steps);
    RUN(test_encodings);
    RUN(test_forged_sizes);
    RUN(test_xml_headers);
    RUN(test_other_xml);
    RUN(test_legacy_headers);
    RUN(test_legacy_binary);
    RUN(test_legacy_refused);
    RUN(test_legacy_other_arrays);
    RUN(test_unread);
    remove_folder();
    return test_end();
}
