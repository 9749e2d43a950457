/* The importers, on tiny files of each format: values, spacing, orientation with shear, and damage. */

#include "import_files.h"

static const double counting[24] = {0,  1,  2,  3,  4,  5,  6,  7,  8,  9,  10, 11,
                                    12, 13, 14, 15, 16, 17, 18, 19, 20, 21, 22, 23};
static const int32_t dims234[3] = {2, 3, 4};

static void put_counting(Block *b, int count, int size, bool big)
{
    for (int i = 0; i < count; i++)
        put_int(b, (uint64_t)i, size, big);
}

/* ---- NIfTI ---- */

static Block nifti_header(bool big, int type, int bits, const int *dim, int axes)
{
    Block b = {.size = 352};
    set_int(&b, 0, 348, 4, big);
    set_int(&b, 40, (uint64_t)axes, 2, big);
    for (int i = 0; i < axes; i++)
        set_int(&b, 42 + 2 * (size_t)i, (uint64_t)dim[i], 2, big);
    set_int(&b, 70, (uint64_t)type, 2, big);
    set_int(&b, 72, (uint64_t)bits, 2, big);
    for (int i = 0; i < 4; i++)
        set_f32(&b, 76 + 4 * (size_t)i, i == 0 ? 1 : (float)(i + 1), big); /* pixdim 2, 3, 4 */
    set_f32(&b, 108, 352, big);
    memcpy(b.data + 344, "n+1", 4);
    return b;
}

static void test_nifti(void)
{
    Block b = nifti_header(false, 4, 16, (int[]){2, 3, 4}, 3);
    put_counting(&b, 24, 2, false);
    save_block("spacing.nii", &b);
    check_import("spacing.nii", NULL, VOL_STORE_FLOAT, dims234, (double[]){2, 0, 0, 0, 3, 0, 0, 0, 4, 0, 0, 0},
                 counting);
    check_cuts("spacing.nii", NULL, &b, b.size);
    check_damage(NULL, &b, 1000);

    /* qform: a quarter turn about z, then the third axis mirrored */
    set_int(&b, 252, 1, 2, false);
    set_f32(&b, 264, 0.70710678f, false);
    set_f32(&b, 268, 10, false);
    set_f32(&b, 272, 20, false);
    set_f32(&b, 276, 30, false);
    set_f32(&b, 76, -1, false);
    save_block("qform.nii", &b);
    check_import("qform.nii", NULL, VOL_STORE_FLOAT, dims234, (double[]){0, 2, 0, -3, 0, 0, 0, 0, -4, 10, 20, 30},
                 counting);

    /* sform wins, and shears */
    const float srow[12] = {1, 0.5f, 0, -7, 0, 2, 0.25f, -8, 0.125f, 0, 3, -9};
    set_int(&b, 254, 1, 2, false);
    for (size_t i = 0; i < 12; i++)
        set_f32(&b, 280 + 4 * i, srow[i], false);
    save_block("sform.nii", &b);
    const double sheared[12] = {1, 0, 0.125, 0.5, 2, 0, 0, 0.25, 3, -7, -8, -9};
    check_import("sform.nii", NULL, VOL_STORE_FLOAT, dims234, sheared, counting);

    Block packed = {.size = 0};
    put_packed(&packed, b.data, b.size, true);
    save_block("sform.nii.gz", &packed);
    check_import("sform.nii.gz", NULL, VOL_STORE_FLOAT, dims234, sheared, counting);
    check_cuts("sform.nii.gz", NULL, &packed, packed.size);
    check_damage(NULL, &packed, 1000);

    set_f32(&b, 112, 0.5f, false); /* scaling */
    set_f32(&b, 116, -3, false);
    save_block("scaled.nii", &b);
    double scaled[24];
    for (int i = 0; i < 24; i++)
        scaled[i] = 0.5 * i - 3;
    check_import("scaled.nii", NULL, VOL_STORE_FLOAT, dims234, sheared, scaled);
}

static void test_nifti_types(void)
{
    const int32_t dims[3] = {2, 2, 1};
    Block b = nifti_header(true, 8, 32, (int[]){2, 2, 1, 3}, 4); /* big endian, int32, three time steps */
    for (int i = 0; i < 12; i++)
        put_int(&b, (uint64_t)(int64_t)(i * 100000000 - 500000000), 4, true);
    save_block("steps.nii", &b);
    VolImportOptions second = plain;
    second.time_step = 1;
    check_import("steps.nii", &second, VOL_STORE_INT32, dims, NULL, (double[]){-1e8, 0, 1e8, 2e8});
    second.time_step = 3;
    check_refused("steps.nii", &second, "there is no time step 3: there are 3, from 0");

    Block u = nifti_header(false, 768, 32, (int[]){2, 2, 1}, 3);
    for (unsigned i = 0; i < 4; i++)
        put_int(&u, 0xfffffff0u + i, 4, false);
    save_block("u32.nii", &u);
    check_import("u32.nii", NULL, VOL_STORE_DOUBLE, dims, NULL,
                 (double[]){4294967280., 4294967281., 4294967282., 4294967283.});

    Block rgb = nifti_header(false, 128, 24, (int[]){2, 2, 1}, 3);
    put(&rgb, (unsigned char[]){1, 2, 2, 4, 0, 3, 0, 0, 0, 9, 2, 6}, 12);
    save_block("rgb.nii", &rgb);
    check_import("rgb.nii", NULL, VOL_STORE_FLOAT, dims, NULL, (double[]){3, 5, 0, 11});
    VolImportOptions blue = plain;
    blue.component = 2;
    check_import("rgb.nii", &blue, VOL_STORE_FLOAT, dims, NULL, (double[]){2, 3, 0, 6});
    blue.component = 3;
    check_refused("rgb.nii", &blue, "there is no component 3: there are 3, from 0");

    Block vector = nifti_header(false, 2, 8, (int[]){2, 2, 1, 1, 2}, 5); /* components slowest */
    put(&vector, (unsigned char[]){3, 0, 5, 8, 4, 7, 12, 15}, 8);
    save_block("vector.nii", &vector);
    check_import("vector.nii", NULL, VOL_STORE_FLOAT, dims, NULL, (double[]){5, 7, 13, 17});
}

static void test_nifti_damage(void)
{
    Block b = nifti_header(false, 4, 16, (int[]){2, 3, 4}, 3);
    put_counting(&b, 24, 2, false);
    Block bad = b;
    set_int(&bad, 70, 1536, 2, false);
    save_block("longer.nii", &bad);
    check_refused("longer.nii", NULL, "data type 1536");
    bad = b;
    set_int(&bad, 44, 0xffff, 2, false);
    save_block("negative.nii", &bad);
    check_refused("negative.nii", NULL, "dimension 2 is -1");
    bad = b;
    set_f32(&bad, 84, 0, false);
    save_block("flat.nii", &bad);
    check_import("flat.nii", NULL, VOL_STORE_FLOAT, dims234, (double[]){2, 0, 0, 0, 1, 0, 0, 0, 4, 0, 0, 0}, counting);
    VolImportOptions given = plain;
    given.spacing_given = given.origin_given = true;
    given.spacing = vol_vec3(5, 6, 7);
    given.origin = vol_vec3(1, 2, 3);
    check_import("flat.nii", &given, VOL_STORE_FLOAT, dims234, (double[]){5, 0, 0, 0, 6, 0, 0, 0, 7, 1, 2, 3},
                 counting);
    bad = b;
    set_int(&bad, 345, 'i', 1, false);
    save_block("two.nii", &bad);
    check_refused("two.nii", NULL, "two files");
    set_int(&b, 40, 7, 2, false); /* seven axes of 32767: the product overflows */
    for (size_t i = 0; i < 7; i++)
        set_int(&b, 42 + 2 * i, 32767, 2, false);
    save_block("huge.nii", &b);
    check_refused("huge.nii", NULL, "too large");
}

static void test_non_finite(void)
{
    Block b = nifti_header(false, 16, 32, (int[]){3, 1, 1}, 3);
    put_f32(&b, NAN, false);
    put_f32(&b, 2.5f, false);
    put_f32(&b, -INFINITY, false);
    save_block("nan.nii", &b);
    VolImported got;
    VolError err = {""};
    CHECK(import_file("nan.nii", &plain, &got, &err) == VOL_OK);
    CHECK(got.non_finite == 2 && isnan(got.single[0]) && got.single[1] == 2.5f && isinf(got.single[2]));
    vol_imported_free(&got);
}

/* ---- NRRD ---- */

static void test_nrrd(void)
{
    Block b = {.size = 0};
    put_text(
        &b,
        "NRRD0004\n# a comment\ntype: short\ndimension: 3\nspace: left-posterior-superior\nsizes: 2 3 4\n"
        "space directions: (1,0,0.125) (0.5,2,0) (0,0.25,3)\nkey:=value: with colon\nkinds: domain domain domain\n"
        "endian: big\nencoding: raw\nspace origin: (-7,-8,-9)\n\n");
    size_t header = b.size;
    put_counting(&b, 24, 2, true);
    save_block("sheared.nrrd", &b);
    const double sheared[12] = {1, 0, 0.125, 0.5, 2, 0, 0, 0.25, 3, -7, -8, -9};
    check_import("sheared.nrrd", NULL, VOL_STORE_FLOAT, dims234, sheared, counting);
    check_cuts("sheared.nrrd", NULL, &b, b.size);
    check_damage(NULL, &b, 1000);
    CHECK(header > 0);

    Block g = {.size = 0};
    put_text(&g, "NRRD0004\r\ntype: uint16\r\ndimension: 3\r\nsizes: 2 3 4\r\nspacings: 1 2 3\r\nendian: "
                 "little\r\nencoding: gzip\r\n\r\n");
    Block samples = {.size = 0};
    put_counting(&samples, 24, 2, false);
    put_packed(&g, samples.data, samples.size, true);
    save_block("gzip.nrrd", &g);
    check_import("gzip.nrrd", NULL, VOL_STORE_FLOAT, dims234, (double[]){1, 0, 0, 0, 2, 0, 0, 0, 3, 0, 0, 0},
                 counting);
    check_cuts("gzip.nrrd", NULL, &g, g.size);
    check_damage(NULL, &g, 1000);

    Block t = {.size = 0};
    put_text(&t,
             "NRRD0001\ntype: unsigned char\ndimension: 3\nsizes: 2 1 2\naxis mins: 0 0 10\naxis maxs: 4 1 14\n"
             "centers: cell cell node\nencoding: ascii\n\n7 8\n9 10");
    save_block("text.nrrd", &t);
    check_import("text.nrrd", NULL, VOL_STORE_FLOAT, (int32_t[]){2, 1, 2},
                 (double[]){2, 0, 0, 0, 1, 0, 0, 0, 4, 1, 0.5, 10}, (double[]){7, 8, 9, 10});
}

static void test_nrrd_axes(void)
{
    const int32_t dims[3] = {2, 2, 1};
    Block b = {.size = 0};
    put_text(&b, "NRRD0005\ntype: float\ndimension: 5\nsizes: 2 2 2 1 2\nspace dimension: 3\n"
                 "space directions: none (1,0,0) (0,1,0) (0,0,1) none\nkinds: vector space space space time\n"
                 "endian: little\nencoding: raw\n\n");
    const float v[16] = {3, 4, 0, 1, 5, 12, 8, 15, 6, 8, 0, 2, 7, 24, 20, 21};
    for (int i = 0; i < 16; i++)
        put_f32(&b, v[i], false);
    save_block("axes.nrrd", &b);
    check_import("axes.nrrd", NULL, VOL_STORE_FLOAT, dims, NULL, (double[]){5, 1, 13, 17});
    VolImportOptions later = plain;
    later.time_step = 1;
    later.component = 1;
    check_import("axes.nrrd", &later, VOL_STORE_FLOAT, dims, NULL, (double[]){8, 2, 24, 21});
}

static void test_nrrd_detached(void)
{
    const char header[] = "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 2 3 4\nencoding: raw\n";
    Block b = {.size = 0};
    put_counting(&b, 24, 1, false);
    save("data.raw", b.data, 24);
    for (size_t k = 0; k < 4; k++) {
        char name[32];
        snprintf(name, sizeof name, "slice%02zu.raw", 5 + 2 * k);
        save(name, b.data + 6 * k, 6);
    }
    const char *const forms[] = {"data file: data.raw\n", "data file: slice%02d.raw 5 11 2\n",
                                 "data file: LIST\nslice05.raw\nslice07.raw\nslice09.raw\nslice11.raw\n"};
    for (int i = 0; i < 3; i++) {
        Block h = {.size = 0};
        put_text(&h, header);
        put_text(&h, forms[i]);
        save_block("detached.nhdr", &h);
        check_import("detached.nhdr", NULL, VOL_STORE_FLOAT, dims234, NULL, counting);
    }
    Block h = {.size = 0};
    put_text(&h, header);
    put_text(&h, "data file: LIST\nslice05.raw\nslice07.raw\nslice09.raw\n");
    save_block("detached.nhdr", &h);
    check_refused("detached.nhdr", NULL, "size does not match");
}

static void test_nrrd_damage(void)
{
    const struct {
        const char *text, *why;
    } cases[] = {
        {"NRRD0004\ntype: block\ndimension: 3\n\n", "'type: block'"},
        {"NRRD0004\ntype: uchar\ndimension: 17\n\n", "'dimension: 17'"},
        {"NRRD0004\ntype: uchar\ndimension: 3\nsizes: 2 0 1\n\n", "sizes"},
        {"NRRD0004\ntype: uchar\ndimension: 3\nsizes: 2 1\nencoding: raw\n\n12", "fewer sizes"},
        {"NRRD0004\ntype: uchar\ndimension: 1\nsizes: 2\nencoding: zrl\n\n12", "'encoding: zrl'"},
        {"NRRD0004\ntype: short\ndimension: 1\nsizes: 1\nencoding: raw\n\n12", "endian"},
        {"NRRD0004\ntype: uchar\ndimension: 3\nsizes: 2000000000 2000000000 2000000000\nencoding: raw\n\n12",
         "too large"},
        {"NRRD0004\ntype: uchar\ndimension: 3\nsizes: 9999 9999 9999\nencoding: ascii\n\n1 2", "fewer numbers"},
        {"NRRD0004\ntype: uchar\ndimension: 2\nsizes: 2 1\nencoding: ascii\n\n1 x", "no number"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        save("bad.nrrd", cases[i].text, strlen(cases[i].text));
        check_refused("bad.nrrd", NULL, cases[i].why);
    }
}

/* ---- MetaImage ---- */

static void test_metaimage(void)
{
    const char header[] = "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\n"
                          "TransformMatrix = 0 1 0 -1 0 0 0.5 0 1\nOffset = 1 2 3\nElementSpacing = 2 3 4\n"
                          "DimSize = 2 3 4\nElementType = MET_SHORT\n";
    const double affine[12] = {0, 2, 0, -3, 0, 0, 2, 0, 4, 1, 2, 3};
    Block samples = {.size = 0}, local = {.size = 0}, packed = {.size = 0};
    put_counting(&samples, 24, 2, false);
    put_text(&local, header);
    put_text(&local, "ElementDataFile = LOCAL\n");
    put(&local, samples.data, samples.size);
    save_block("local.mha", &local);
    check_import("local.mha", NULL, VOL_STORE_FLOAT, dims234, affine, counting);
    check_cuts("local.mha", NULL, &local, local.size);
    check_damage(NULL, &local, 1000);

    put_text(&packed, header);
    put_text(&packed, "CompressedData = True\nElementDataFile = LOCAL\n");
    put_packed(&packed, samples.data, samples.size, false);
    save_block("packed.mha", &packed);
    check_import("packed.mha", NULL, VOL_STORE_FLOAT, dims234, affine, counting);
    check_cuts("packed.mha", NULL, &packed, packed.size);
    check_damage(NULL, &packed, 1000);

    Block apart = {.size = 0}, data = {.size = 0};
    put_text(&apart, header);
    put_text(&apart, "HeaderSize = -1\nElementDataFile = apart.raw\n");
    put_text(&data, "seven bytes");
    put(&data, samples.data, samples.size);
    save_block("apart.mhd", &apart);
    save_block("apart.raw", &data);
    check_import("apart.mhd", NULL, VOL_STORE_FLOAT, dims234, affine, counting);

    const char many[] = "NDims = 3\nDimSize = 2 2 2\nElementType = MET_UCHAR\nElementDataFile = LIST\nm1\nm2\n";
    save("many.mhd", many, strlen(many));
    save("m1", "\1\2\3\4", 4);
    save("m2", "\5\6\7\10", 4);
    check_import("many.mhd", NULL, VOL_STORE_FLOAT, (int32_t[]){2, 2, 2}, NULL, counting + 1);

    const char bad[] = "NDims = 3\nDimSize = 2 2\nElementType = MET_UCHAR\nElementDataFile = LOCAL\n";
    save("bad.mha", bad, strlen(bad));
    check_refused("bad.mha", NULL, "'DimSize = 2 2'");
    const char zero[] =
        "NDims = 3\nDimSize = 1 1 2\nElementSpacing = 1 1 0\nElementType = MET_UCHAR\nElementDataFile = LOCAL\nab";
    save("zero.mha", zero, strlen(zero));
    check_import("zero.mha", NULL, VOL_STORE_FLOAT, (int32_t[]){1, 1, 2}, (double[]){1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0},
                 (double[]){'a', 'b'});
}

/* ---- MRC ---- */

static Block mrc_header(bool big, int mode)
{
    Block b = {.size = 1024};
    const int words[10] = {2, 3, 4, mode, 10, 20, 30, 4, 8, 16}; /* NX.., MODE, NSTART.., MX.. */
    for (size_t i = 0; i < 10; i++)
        set_int(&b, 4 * i, (uint64_t)words[i], 4, big);
    const float cell[6] = {8, 8, 8, 90, 60, 90};
    for (size_t i = 0; i < 6; i++)
        set_f32(&b, 40 + 4 * i, cell[i], big);
    const int axes[3] = {3, 1, 2}; /* columns run along c, rows along a, sections along b */
    for (size_t i = 0; i < 3; i++)
        set_int(&b, 64 + 4 * i, (uint64_t)axes[i], 4, big);
    memcpy(b.data + 208, "MAP ", 4);
    b.data[212] = big ? 0x11 : 0x44;
    return b;
}

static void test_mrc(void)
{
    /* a = 8 x / 4; b = 8 y / 8; c = 8 (cos 60, 0, sin 60) / 16; place 10 c + 20 a + 30 b */
    const double c[3] = {0.25, 0, 0.43301270189221932};
    const double affine[12] = {c[0], 0, c[2], 2, 0, 0, 0, 1, 0, 10 * c[0] + 40, 30, 10 * c[2]};
    for (int big = 0; big < 2; big++) {
        Block b = mrc_header(big, 1);
        put_counting(&b, 24, 2, big);
        save_block("short.mrc", &b);
        check_import("short.mrc", NULL, VOL_STORE_FLOAT, dims234, affine, counting);
    }
    Block b = mrc_header(false, 0);
    set_f32(&b, 196, 5, false); /* ORIGIN wins */
    set_int(&b, 92, 100, 4, false); /* an extended header */
    put(&b, (char[100]){0}, 100);
    for (int i = 0; i < 24; i++)
        put_int(&b, (uint64_t)-i, 1, false);
    save_block("byte.mrc", &b);
    double negative[24];
    for (int i = 0; i < 24; i++)
        negative[i] = -i;
    check_import("byte.mrc", NULL, VOL_STORE_FLOAT, dims234, (double[]){c[0], 0, c[2], 2, 0, 0, 0, 1, 0, 5, 0, 0},
                 negative);
    check_cuts("byte.mrc", NULL, &b, b.size);
    check_damage(NULL, &b, 1000);
    set_int(&b, 12, 7, 4, false);
    save_block("mode.mrc", &b);
    check_refused("mode.mrc", NULL, "MRC mode 7");
    set_int(&b, 12, 0, 4, false);
    set_int(&b, 64, 1, 4, false);
    save_block("axes.mrc", &b);
    check_refused("axes.mrc", NULL, "no permutation");
}

/* ---- Raw, slices, Inviwo ---- */

static void test_raw(void)
{
    Block b = {.size = 0};
    put_text(&b, "head");
    put_counting(&b, 24, 2, true);
    save_block("samples.raw", &b);
    VolImportOptions raw = plain;
    raw.raw = raw.big_endian = true;
    raw.type = VOL_SAMPLE_I16;
    raw.header = 4;
    memcpy(raw.dims, (int64_t[]){2, 3, 4}, sizeof raw.dims);
    check_import("samples.raw", &raw, VOL_STORE_FLOAT, dims234, (double[]){1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0},
                 counting);
    raw.header = 3;
    check_refused("samples.raw", &raw, "24 samples of i16 are 48 bytes, there are 49");
    raw.header = 6;
    check_refused("samples.raw", &raw, "truncated");

    raw.header = 0;
    raw.dims[2] = 0;
    raw.type = VOL_SAMPLE_U8;
    save("s.1", "\0\1\2\3\4\5", 6);
    save("s.2", "\6\7\10\11\12\13", 6);
    VolImported got;
    VolError err = {""};
    CHECK(import_files((const char *[]){"s.1", "s.2"}, 2, &raw, &got, &err) == VOL_OK);
    CHECK(got.dims[2] == 2);
    for (int i = 0; got.single && i < 12; i++)
        CHECK(got.single[i] == (float)i);
    vol_imported_free(&got);
    save("s.2", "\6\7\10\11\12", 5);
    CHECK(import_files((const char *[]){"s.1", "s.2"}, 2, &raw, &got, &err) == VOL_BAD_INPUT);
    CHECK(strstr(err.text, "s.2") != NULL);
}

static void test_slice_numbers(void)
{
    char *name = NULL;
    VolError err = {""};
    CHECK(vol_fill_slice_number("a.%d", 7, &name, &err) == VOL_OK);
    CHECK_TEXT(name, "a.7");
    free(name);
    CHECK(vol_fill_slice_number("a%03d.raw", 7, &name, &err) == VOL_OK);
    CHECK_TEXT(name, "a007.raw");
    free(name);
    const char *const bad[] = {"a", "a%s", "a%d%d", "a%99d", "a%", "a%-3d", "a%n"};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++)
        CHECK(vol_fill_slice_number(bad[i], 7, &name, &err) == VOL_USAGE);
}

static void test_inviwo_dat(void)
{
    const char plain_dat[] = "ObjectFileName:\tvoxels.raw\nResolution:\t 2 3 4\nFormat:\t UCHAR";
    const char placed[] = "RawFile: voxels.raw\nResolution: 2 3 4\nFormat: UINT8\nBasisVector1: 4 0 0\n"
                          "BasisVector2: 3 3 0\nBasisVector3: 0 0 4\nOffset: -2 0 0\n";
    Block b = {.size = 0};
    put_counting(&b, 24, 1, false);
    save_block("voxels.raw", &b);
    save("plain.dat", plain_dat, strlen(plain_dat));
    save("placed.dat", placed, strlen(placed));
    check_import("plain.dat", NULL, VOL_STORE_FLOAT, dims234, (double[]){1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0},
                 counting);
    check_import("placed.dat", NULL, VOL_STORE_FLOAT, dims234,
                 (double[]){2, 0, 0, 1, 1, 0, 0, 0, 1, -0.5, 0.5, 0.5}, counting);
    save("voxels.raw", b.data, 23);
    check_refused("plain.dat", NULL, "truncated");
}

/* ---- VTK ---- */

static void test_vtk_legacy(void)
{
    Block b = {.size = 0};
    put_text(&b,
             "# vtk DataFile Version 3.0\nx\nBINARY\nDATASET STRUCTURED_POINTS\nDIMENSIONS 2 3 4\nSPACING 1 2 3\n"
             "ORIGIN 10 20 30\nPOINT_DATA 24\nSCALARS first short 1\nLOOKUP_TABLE default\n");
    put_counting(&b, 24, 2, true);
    size_t whole = b.size;
    put_text(&b, "\nVECTORS second float\n");
    for (int i = 0; i < 24; i++)
        for (int c = 0; c < 3; c++)
            put_f32(&b, (float)(i * (c == 0 ? 2 : c == 1 ? 3 : 6)), true);
    save_block("legacy.vtk", &b);
    const double affine[12] = {1, 0, 0, 0, 2, 0, 0, 0, 3, 10, 20, 30};
    check_import("legacy.vtk", NULL, VOL_STORE_FLOAT, dims234, affine, counting);
    check_cuts("legacy.vtk", NULL, &b, whole);
    check_damage(NULL, &b, 1000);
    VolImportOptions second = plain;
    second.array = "second";
    double scaled[24];
    for (int i = 0; i < 24; i++)
        scaled[i] = 7 * i;
    check_import("legacy.vtk", &second, VOL_STORE_FLOAT, dims234, affine, scaled);
    second.component = 1;
    for (int i = 0; i < 24; i++)
        scaled[i] = 3 * i;
    check_import("legacy.vtk", &second, VOL_STORE_FLOAT, dims234, affine, scaled);
    second.array = "third";
    check_refused("legacy.vtk", &second,
                  "there is no array 'third': there are first (1, points), second (3, points)");
}

static void test_vtk_xml(void)
{
    const char text[] =
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"ImageData\" version=\"1.0\" byte_order=\"LittleEndian\">\n"
        "<ImageData WholeExtent=\"3 4 0 1 0 0\" Origin=\"10 20 30\" Spacing=\"2 3 4\" Direction=\"0 -1 0 1 0 0 0 "
        "0 1\">\n"
        "<Piece Extent=\"3 4 0 1 0 0\"><PointData>\n"
        "<DataArray type=\"Float64\" Name=\"a\" format=\"ascii\">0.5 1.5 2.5 3.5</DataArray>\n"
        "<DataArray type=\"Int32\" Name=\"b\" format=\"ascii\">7 8 9 10</DataArray>\n"
        "</PointData><CellData></CellData></Piece></ImageData></VTKFile>\n";
    save("image.vti", text, strlen(text));
    const int32_t dims[3] = {2, 2, 1};
    /* Direction's columns are the index axes: x runs along +y, y along -x; the extent begins at 3. */
    const double affine[12] = {0, 2, 0, -3, 0, 0, 0, 0, 4, 10, 26, 30};
    VolImportOptions named = plain;
    named.array = "a";
    check_import("image.vti", &named, VOL_STORE_DOUBLE, dims, affine, (double[]){0.5, 1.5, 2.5, 3.5});
    named.array = "b";
    check_import("image.vti", &named, VOL_STORE_INT32, dims, affine, (double[]){7, 8, 9, 10});
    check_refused("image.vti", NULL, "there are a (1, points), b (1, points)");
    Block b = {.size = 0};
    put_text(&b, text);
    check_cuts("image.vti", &named, &b, b.size - 1);
    check_damage(&named, &b, 1000); /* the last byte is a newline */
    const char mesh[] = "<VTKFile type=\"UnstructuredGrid\"></VTKFile>";
    save("mesh.vtu", mesh, strlen(mesh));
    check_refused("mesh.vtu", NULL, "'UnstructuredGrid'");
}

static void test_unknown(void)
{
    save("unknown", "hello", 5);
    check_refused("unknown", NULL, "unknown format (tried NIfTI, NRRD");
    save("empty", "", 0);
    check_refused("empty", NULL, "it is empty");
}

int main(void)
{
    make_folder();
    RUN(test_nifti);
    RUN(test_nifti_types);
    RUN(test_nifti_damage);
    RUN(test_non_finite);
    RUN(test_nrrd);
    RUN(test_nrrd_axes);
    RUN(test_nrrd_detached);
    RUN(test_nrrd_damage);
    RUN(test_metaimage);
    RUN(test_mrc);
    RUN(test_raw);
    RUN(test_slice_numbers);
    RUN(test_inviwo_dat);
    RUN(test_vtk_legacy);
    RUN(test_vtk_xml);
    RUN(test_unknown);
    remove_folder();
    return test_end();
}
