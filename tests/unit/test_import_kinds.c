/* Kinds of samples that few files have: single bits, complex numbers, halves of bytes; and stacks of volumes. */
#include "import_files.h"

static const double bits[12] = {1, 0, 1, 1, 0, 0, 0, 1, 1, 1, 0, 1};
static const unsigned char packed_bits[2] = {0xb1, 0xd0}; /* the highest bit comes first */
static const int32_t dims[3] = {3, 2, 2};

static void save_text(const char *name, const char *text) { save(name, text, strlen(text)); }

/* ---- VTK ---- */

static void test_legacy_bits(void)
{
    char head[300];
    Block b;
    for (int binary = 0; binary < 2; binary++) {
        for (int before = 0; before < 2; before++) {
            snprintf(head, sizeof head,
                     "# vtk DataFile Version 3.0\nt\n%s\nDATASET STRUCTURED_POINTS\nDIMENSIONS 3 2 2\nPOINT_DATA 12\n",
                     binary ? "BINARY" : "ASCII");
            b = (Block){.size = 0};
            put_text(&b, head);
            for (int i = 0; i <= before; i++) {
                put_text(&b, i < before ? "SCALARS first bit\nLOOKUP_TABLE default\n"
                                        : "SCALARS wanted bit\nLOOKUP_TABLE default\n");
                if (binary)
                    put(&b, i < before ? (const unsigned char *)"\xff\xf0" : packed_bits, 2);
                else
                    put_text(&b, i < before ? "1 1 1 1 1 1 1 1 1 1 1 1" : "1 0 1 1 0 0 0 1\n1 1 0 1");
                put_text(&b, "\n");
            }
            VolImportOptions wanted = plain;
            wanted.array = "wanted";
            save_block("bits.vtk", &b);
            check_import("bits.vtk", &wanted, VOL_STORE_FLOAT, dims, NULL, bits);
            check_cuts("bits.vtk", &wanted, &b, b.size - 2);
            check_damage(&wanted, &b, 1000);
        }
    }
    VolImportOptions second = plain; /* components are packed one behind the other */
    second.component = 1;
    b = (Block){.size = 0};
    put_text(&b, "# vtk DataFile Version 3.0\nt\nBINARY\nDATASET STRUCTURED_POINTS\nDIMENSIONS 3 2 1\nPOINT_DATA 6\n"
                 "SCALARS s bit 2\nLOOKUP_TABLE default\n");
    put(&b, packed_bits, 2);
    save_block("pairs.vtk", &b);
    check_import("pairs.vtk", &second, VOL_STORE_FLOAT, (int32_t[]){3, 2, 1}, NULL, (double[]){0, 1, 0, 1, 1, 1});
}

static void save_vti(const char *format, const char *values, const char *appended, const char *more)
{
    char text[2000];
    snprintf(text, sizeof text,
             "<VTKFile type=\"ImageData\" byte_order=\"LittleEndian\" header_type=\"UInt32\"%s>\n"
             "<ImageData WholeExtent=\"0 2 0 1 0 1\"><Piece Extent=\"0 2 0 1 0 1\"><PointData Scalars=\"b\">\n"
             "<DataArray type=\"Bit\" Name=\"b\" format=\"%s\"%s>%s</DataArray></PointData></Piece></ImageData>\n"
             "%s</VTKFile>\n",
             more, format, appended[0] ? " offset=\"0\"" : "", values, appended);
    save_text("bits.vti", text);
}

static void test_xml_bits(void)
{
    save_vti("ascii", "1 0 1 1 0 0\n0 1 1 1 0 1", "", "");
    check_import("bits.vti", NULL, VOL_STORE_FLOAT, dims, NULL, bits);
    save_vti("binary", "AgAAALHQ", "", "");
    check_import("bits.vti", NULL, VOL_STORE_FLOAT, dims, NULL, bits);
    save_vti("appended", "", "<AppendedData encoding=\"base64\">_AgAAALHQ</AppendedData>", "");
    check_import("bits.vti", NULL, VOL_STORE_FLOAT, dims, NULL, bits);
    save_vti("appended", "", "<AppendedData encoding=\"base64\">_AQAAAACAAAACAAAACgAAAA==eF7beAEAAjQBgg==</AppendedData>",
             " compressor=\"vtkZLibDataCompressor\"");
    check_import("bits.vti", NULL, VOL_STORE_FLOAT, dims, NULL, bits);
    save_vti("binary", "AQAAALE=", "", "");
    check_refused("bits.vti", NULL, "truncated: it holds 8 of its 12 values");
    save_vti("ascii", "1 0 1 1 0 0\n0 1 1 1 0", "", "");
    check_refused("bits.vti", NULL, "truncated: it holds 11 of its 12 values");
    /* two pieces, each packed by itself */
    save_text("bits.vti",
              "<VTKFile type=\"ImageData\" byte_order=\"LittleEndian\"><ImageData WholeExtent=\"0 2 0 1 0 1\">\n"
              "<Piece Extent=\"0 2 0 1 0 0\"><PointData><DataArray type=\"Bit\" Name=\"b\" format=\"binary\">AQAAALA="
              "</DataArray></PointData></Piece><Piece Extent=\"0 2 0 1 1 1\"><PointData><DataArray type=\"Bit\" Name=\"b\" "
              "format=\"ascii\">0 1 1 1 0 1</DataArray></PointData></Piece></ImageData></VTKFile>");
    check_import("bits.vti", NULL, VOL_STORE_FLOAT, dims, NULL, bits);
}

/* ---- NIfTI ---- */

static void test_complex(void)
{
    for (int big = 0; big < 2; big++)
        for (int twice = 0; twice < 2; twice++) {
            const double parts[4] = {3, -4, -5, 12};
            Block b = {.size = 352};
            set_int(&b, 0, 348, 4, big);
            for (size_t i = 0; i < 4; i++) {
                set_int(&b, 40 + 2 * i, i == 0 ? 3 : i == 1 ? 2 : 1, 2, big);
                set_f32(&b, 76 + 4 * i, 1, big);
            }
            set_int(&b, 70, twice ? 1792 : 32, 2, big);
            set_int(&b, 72, twice ? 128 : 64, 2, big);
            set_f32(&b, 108, 352, big);
            memcpy(b.data + 344, "n+1", 4);
            for (int i = 0; i < 4; i++) {
                uint64_t word;
                memcpy(&word, &parts[i], sizeof word);
                if (twice)
                    put_int(&b, word, 8, big);
                else
                    put_f32(&b, (float)parts[i], big);
            }
            VolImportOptions imaginary = plain;
            imaginary.component = 1;
            save_block("complex.nii", &b);
            VolVdbStore store = twice ? VOL_STORE_DOUBLE : VOL_STORE_FLOAT;
            check_import("complex.nii", NULL, store, (int32_t[]){2, 1, 1}, NULL, (double[]){5, 13});
            check_import("complex.nii", &imaginary, store, (int32_t[]){2, 1, 1}, NULL, (double[]){-4, 12});
            check_cuts("complex.nii", NULL, &b, b.size);
        }
}

/* ---- MRC ---- */

static Block mrc_header(int mode, int nx, int ny, int nz)
{
    Block b = {.size = 1024};
    const int sizes[3] = {nx, ny, nz};
    for (size_t a = 0; a < 3; a++) {
        set_int(&b, 4 * a, (uint64_t)sizes[a], 4, false);
        set_int(&b, 28 + 4 * a, (uint64_t)sizes[a], 4, false); /* intervals */
        set_f32(&b, 40 + 4 * a, 2 * (float)sizes[a], false);
        set_int(&b, 64 + 4 * a, a + 1, 4, false);
    }
    set_int(&b, 12, (uint64_t)mode, 4, false);
    memcpy(b.data + 208, "MAP D\x44", 6);
    return b;
}

/* IMOD's flag: a row has twice as many samples as bytes. */
static void test_packed_bytes(void)
{
    Block b = mrc_header(0, 2, 2, 1);
    const double affine[12] = {2, 0, 0, 0, 2, 0, 0, 0, 2, 0, 0, 0};
    set_int(&b, 152, 1146047817, 4, false);
    set_int(&b, 156, 16, 4, false);
    put(&b, (unsigned char[]){0x21, 0xf3, 0x54, 0x0f}, 4);
    save_block("packed.mrc", &b);
    check_import("packed.mrc", NULL, VOL_STORE_FLOAT, (int32_t[]){4, 2, 1}, affine, (double[]){1, 2, 3, 15, 4, 5, 15, 0});
    check_cuts("packed.mrc", NULL, &b, b.size);
    check_damage(NULL, &b, 500);
    set_int(&b, 156, 17, 4, false); /* signed bytes of two samples */
    save_block("packed.mrc", &b);
    check_refused("packed.mrc", NULL, "signed");
}

static void test_volume_stack(void)
{
    VolImportOptions second = plain;
    second.time_step = 1;
    for (int mode = 0; mode < 102; mode += 101) {
        Block b = mrc_header(mode, 2, 1, 4);
        set_int(&b, 36, 2, 4, false); /* two sections a volume */
        set_f32(&b, 48, 6, false);
        set_int(&b, 88, 401, 4, false);
        if (mode)
            put(&b, (unsigned char[]){0x21, 0x43, 0x65, 0x87}, 4);
        else
            put(&b, (unsigned char[]){1, 2, 3, 4, 5, 6, 7, 8}, 8);
        const double affine[12] = {2, 0, 0, 0, 2, 0, 0, 0, 3, 0, 0, 0};
        save_block("stack.mrc", &b);
        check_import("stack.mrc", NULL, VOL_STORE_FLOAT, (int32_t[]){2, 1, 2}, affine, (double[]){1, 2, 3, 4});
        check_import("stack.mrc", &second, VOL_STORE_FLOAT, (int32_t[]){2, 1, 2}, affine, (double[]){5, 6, 7, 8});
        check_cuts("stack.mrc", NULL, &b, b.size);
        set_int(&b, 36, 3, 4, false); /* no whole number of volumes */
        save_block("stack.mrc", &b);
        check_refused("stack.mrc", NULL, "stack of volumes of 3 sections");
        set_int(&b, 88, 1, 4, false); /* no stack: intervals of the cell */
        save_block("stack.mrc", &b);
        check_import("stack.mrc", NULL, VOL_STORE_FLOAT, (int32_t[]){2, 1, 4}, NULL, (double[]){1, 2, 3, 4, 5, 6, 7, 8});
    }
}

/* ---- One array without a name ---- */

static void test_no_such_array(void)
{
    VolImportOptions named = plain;
    named.array = "foo";
    Block b = mrc_header(0, 1, 1, 1);
    put(&b, "\1", 1);
    save_block("a.mrc", &b);
    check_refused("a.mrc", &named, "there is no array 'foo': MRC holds one, without a name");
    save_text("a.nrrd", "NRRD0001\ntype: float\ndimension: 3\nsizes: 1 1 1\nencoding: text\n\n1\n");
    check_refused("a.nrrd", &named, "there is no array 'foo': NRRD holds one, without a name");
}

/* ---- Names of what is not read ---- */

/* Of every beginning of a file, which ends where its memory does; and with a byte changed. */
static void test_foreign(void)
{
    static const char *const texts[] = {
        "<?xml version='1.0'?><!----><VTKFile version = \"1.0\"  type = 'UnstructuredGrid' ><UnstructuredGrid/></VTKFile>",
        "# vtk DataFile Version 3.0\nt\nASCII\nDATASET UNSTRUCTURED_GRID\n",
        "<VTKFile type=", "<VTKFile type=''>", "<VTKFile a=\"type='PolyData'\" type", "\x89PNG\r\n\x1a\n", "{\"a\": 1}"};
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
        size_t whole = strlen(texts[i]);
        for (size_t n = 0; n <= 2 * whole; n++) {
            size_t size = n <= whole ? n : whole;
            unsigned char *copy = malloc(size ? size : 1);
            if (!copy)
                abort();
            memcpy(copy, texts[i], size);
            if (n > whole)
                copy[n - whole - 1] ^= (unsigned char)(1 + n % 7);
            VolBytes bytes = {copy, size};
            VolForeign is = vol_import_foreign(&bytes, NULL);
            if (n == whole && i < 2 && (!is.what || !strstr(is.what, "unstructured grid)") || !is.mesh))
                FAIL("text %zu is '%s'", i, is.what ? is.what : "nothing");
            free(copy);
        }
    }
}

int main(void)
{
    make_folder();
    RUN(test_legacy_bits);
    RUN(test_xml_bits);
    RUN(test_complex);
    RUN(test_packed_bytes);
    RUN(test_volume_stack);
    RUN(test_no_such_array);
    RUN(test_foreign);
    remove_folder();
    return test_end();
}
