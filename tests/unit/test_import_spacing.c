/* Headers that leave the spacing out, or the type half said: which axes get 1, in which direction, and how MRC samples
 * are told apart. */
#include "import_files.h"

static const int32_t dims222[3] = {2, 2, 2};
static const double eight[8] = {0, 1, 2, 3, 4, 5, 6, 7};

/* As check_import, and which axes were given 1 ("xz"; "": none). */
static void check_made(const char *name, const Block *b, const VolImportOptions *options, const double *affine,
                       const char *made)
{
    save_block(name, b);
    check_import(name, options, VOL_STORE_FLOAT, dims222, affine, eight);
    VolImported got;
    VolError err = {""};
    if (import_file(name, options ? options : &plain, &got, &err))
        FAIL("%s: %s", name, err.text);
    for (int a = 0; a < 3; a++)
        if (got.spacing_made[a] != (strchr(made, "xyz"[a]) != NULL))
            FAIL("%s: spacing along %c is %s", name, "xyz"[a], got.spacing_made[a] ? "made" : "the file's");
    vol_imported_free(&got);
}

/* ---- MRC ---- */

/* 2 x 2 x 2, no more is set than must be; cell 2 4 8, one interval per voxel. */
static Block mrc_header(bool big, int mode)
{
    Block b = {.size = 1024};
    const int words[10] = {2, 2, 2, mode, 0, 0, 0, 2, 2, 2};
    for (size_t i = 0; i < 10; i++)
        set_int(&b, 4 * i, (uint64_t)words[i], 4, big);
    const float cell[6] = {2, 4, 8, 90, 90, 90};
    for (size_t i = 0; i < 6; i++)
        set_f32(&b, 40 + 4 * i, cell[i], big);
    for (size_t i = 0; i < 3; i++)
        set_int(&b, 64 + 4 * i, i + 1, 4, big);
    memcpy(b.data + 208, "MAP ", 4);
    b.data[212] = b.data[213] = big ? 0x11 : 0x44;
    return b;
}

static Block mrc_counting(bool big)
{
    Block b = mrc_header(big, 0);
    for (int i = 0; i < 8; i++)
        put_int(&b, (uint64_t)i, 1, big);
    return b;
}

static void test_mrc_cell(void)
{
    const float bad[] = {0, -4, NAN, INFINITY};
    for (int big = 0; big < 2; big++) {
        for (size_t i = 0; i < 4; i++) {
            Block b = mrc_counting(big);
            set_f32(&b, 44, bad[i], big);
            check_made("cell.mrc", &b, NULL, (double[]){1, 0, 0, 0, 1, 0, 0, 0, 4, 0, 0, 0}, "y");
        }
        Block b = mrc_counting(big);
        for (size_t i = 0; i < 6; i++)
            set_f32(&b, 40 + 4 * i, 0, big);
        set_int(&b, 16, 5, 4, big); /* NSTART counts in steps of 1 */
        check_made("none.mrc", &b, NULL, (double[]){1, 0, 0, 0, 1, 0, 0, 0, 1, 5, 0, 0}, "xyz");

        b = mrc_counting(big);
        set_int(&b, 28, 0, 4, big); /* MX; columns run along y */
        set_int(&b, 64, 2, 4, big);
        set_int(&b, 68, 1, 4, big);
        check_made("mx.mrc", &b, NULL, (double[]){0, 2, 0, 1, 0, 0, 0, 0, 4, 0, 0, 0}, "y");
        VolImportOptions given = plain;
        given.spacing_given = true;
        given.spacing = vol_vec3(3, 5, 7);
        check_made("mx.mrc", &b, &given, (double[]){0, 3, 0, 5, 0, 0, 0, 0, 7, 0, 0, 0}, "");
    }
}

static void test_mrc_cell_oblique(void)
{
    Block b = mrc_counting(false);
    set_f32(&b, 44, 0, false); /* b of no length keeps its direction, 60 degrees from a */
    set_f32(&b, 60, 60, false);
    check_made("oblique.mrc", &b, NULL, (double[]){1, 0, 0, 0.5, 0.86602540378, 0, 0, 0, 4, 0, 0, 0}, "y");
    const float angles[] = {NAN, INFINITY, -90, 180, 400};
    for (size_t i = 0; i < 5; i++) {
        b = mrc_counting(false);
        set_f32(&b, 60, angles[i], false);
        check_made("angles.mrc", &b, NULL, (double[]){1, 0, 0, 0, 2, 0, 0, 0, 4, 0, 0, 0}, "");
    }
}

static void test_mrc_order(void)
{
    for (int big = 0; big < 2; big++) {
        const unsigned char stamps[] = {0, 0x44, 0x11, 0xff};
        for (size_t i = 0; i < 4; i++) { /* whatever the stamp says, MAPC tells */
            Block b = mrc_counting(big);
            b.data[212] = b.data[213] = stamps[i];
            check_made("stamp.mrc", &b, NULL, (double[]){1, 0, 0, 0, 2, 0, 0, 0, 4, 0, 0, 0}, "");
        }
        Block b = mrc_counting(big);
        memset(b.data + 64, 0, 12); /* no MAPC either: the stamp, else the sizes */
        check_made("axes.mrc", &b, NULL, (double[]){1, 0, 0, 0, 2, 0, 0, 0, 4, 0, 0, 0}, "");
        b.data[212] = 0;
        check_made("axes.mrc", &b, NULL, (double[]){1, 0, 0, 0, 2, 0, 0, 0, 4, 0, 0, 0}, "");
    }
    Block b = mrc_counting(false);
    set_f32(&b, 196, NAN, false);
    save_block("origin.mrc", &b);
    check_refused("origin.mrc", NULL, "its origin along x is nan (give --origin)");
}

static void test_mrc_bytes(void)
{
    const double without[8] = {0, 127, -128, -1, -2, 1, 2, 3}, with[8] = {0, 127, 128, 255, 254, 1, 2, 3};
    for (int big = 0; big < 2; big++) {
        Block b = mrc_header(big, 0);
        put(&b, (unsigned char[]){0, 127, 128, 255, 254, 1, 2, 3}, 8);
        save_block("plain.mrc", &b);
        check_import("plain.mrc", NULL, VOL_STORE_FLOAT, dims222, NULL, without);
        set_int(&b, 152, 1146047817, 4, big);
        save_block("unsigned.mrc", &b);
        check_import("unsigned.mrc", NULL, VOL_STORE_FLOAT, dims222, NULL, with);
        set_int(&b, 156, 14, 4, big);
        save_block("unsigned.mrc", &b);
        check_import("unsigned.mrc", NULL, VOL_STORE_FLOAT, dims222, NULL, with);
        set_int(&b, 156, 15, 4, big);
        save_block("signed.mrc", &b);
        check_import("signed.mrc", NULL, VOL_STORE_FLOAT, dims222, NULL, without);
    }
}

static void test_mrc_modes(void)
{
    const int32_t one[3] = {2, 1, 1}, odd[3] = {3, 2, 1};
    for (int big = 0; big < 2; big++) {
        Block b = mrc_header(big, 12);
        const int halves[8] = {0, 0x3c00, 0xc000, 0x7bff, 1, 0x03ff, 0x3555, 0x8000};
        for (int i = 0; i < 8; i++)
            put_int(&b, (uint64_t)halves[i], 2, big);
        save_block("half.mrc", &b);
        check_import("half.mrc", NULL, VOL_STORE_FLOAT, dims222, NULL,
                     (double[]){0, 1, -2, 65504, 0x1p-24, 0x1.ff8p-15, 0x1.554p-2, 0});
        check_cuts("half.mrc", NULL, &b, b.size);
        check_damage(NULL, &b, 500);

        b = mrc_header(big, 101);
        set_int(&b, 0, 3, 4, big);
        set_int(&b, 8, 1, 4, big);
        put(&b, (unsigned char[]){0x21, 0xf3, 0x54, 0x0f}, 4);
        save_block("nibbles.mrc", &b);
        check_import("nibbles.mrc", NULL, VOL_STORE_FLOAT, odd, NULL, (double[]){1, 2, 3, 4, 5, 15});
        check_cuts("nibbles.mrc", NULL, &b, b.size);
        check_damage(NULL, &b, 500);

        b = mrc_header(big, 3);
        set_int(&b, 4, 1, 4, big);
        set_int(&b, 8, 1, 4, big);
        Block floats = b, colours = b;
        const int parts[4] = {3, -4, -5, 12};
        for (int i = 0; i < 4; i++) {
            put_int(&b, (uint64_t)parts[i], 2, big);
            put_f32(&floats, (float)parts[i], big);
        }
        save_block("complex.mrc", &b);
        check_import("complex.mrc", NULL, VOL_STORE_FLOAT, one, NULL, (double[]){5, 13});
        set_int(&floats, 12, 4, 4, big);
        save_block("complex.mrc", &floats);
        check_import("complex.mrc", NULL, VOL_STORE_FLOAT, one, NULL, (double[]){5, 13});
        set_int(&colours, 12, 16, 4, big);
        put(&colours, (unsigned char[]){1, 2, 2, 255, 0, 0}, 6);
        save_block("colours.mrc", &colours);
        check_import("colours.mrc", NULL, VOL_STORE_FLOAT, one, NULL, (double[]){3, 255});
    }
}

/* ---- NIfTI ---- */

static Block nifti_header(bool big)
{
    Block b = {.size = 352};
    set_int(&b, 0, 348, 4, big);
    for (size_t i = 0; i < 4; i++) {
        set_int(&b, 40 + 2 * i, i ? 2 : 3, 2, big);
        set_f32(&b, 76 + 4 * i, i ? (float)i + 1 : 1, big); /* pixdim 2, 3, 4 */
    }
    set_int(&b, 70, 2, 2, big);
    set_int(&b, 72, 8, 2, big);
    set_f32(&b, 108, 352, big);
    memcpy(b.data + 344, "n+1", 4);
    for (int i = 0; i < 8; i++)
        put_int(&b, (uint64_t)i, 1, big);
    return b;
}

static void test_nifti(void)
{
    const float bad[] = {0, NAN, INFINITY, -INFINITY};
    for (size_t i = 0; i < 8; i++) {
        bool big = i % 2;
        Block b = nifti_header(big);
        set_f32(&b, 84, bad[i / 2], big);
        check_made("none.nii", &b, NULL, (double[]){2, 0, 0, 0, 1, 0, 0, 0, 4, 0, 0, 0}, "y");
        set_int(&b, 252, 1, 2, big); /* a quarter turn about z */
        set_f32(&b, 264, 0.70710678f, big);
        check_made("qform.nii", &b, NULL, (double[]){0, 2, 0, -1, 0, 0, 0, 0, 4, 0, 0, 0}, "y");
        set_int(&b, 254, 1, 2, big); /* an sform of zeros */
        check_made("both.nii", &b, NULL, (double[]){0, 2, 0, -1, 0, 0, 0, 0, 4, 0, 0, 0}, "y");
        set_f32(&b, 264, NAN, big);
        save_block("quatern.nii", &b);
        check_refused("quatern.nii", NULL, "quaternion");
    }
}

static void test_nifti_sform(void)
{
    Block b = nifti_header(false);
    set_int(&b, 254, 1, 2, false);
    check_made("sform.nii", &b, NULL, (double[]){2, 0, 0, 0, 3, 0, 0, 0, 4, 0, 0, 0}, ""); /* nothing: pixdim */
    set_f32(&b, 280 + 4 * 1, 2, false);  /* y runs along world x, */
    set_f32(&b, 280 + 4 * 4, -3, false); /* x backwards along world y, z nowhere */
    check_made("sform.nii", &b, NULL, (double[]){0, -3, 0, 2, 0, 0, 0, 0, 4, 0, 0, 0}, "");
    Block bare = b;
    set_f32(&bare, 88, 0, false); /* no pixdim either */
    check_made("sform.nii", &bare, NULL, (double[]){0, -3, 0, 2, 0, 0, 0, 0, 1, 0, 0, 0}, "z");
    Block nan = b;
    set_f32(&nan, 280 + 4 * 2, NAN, false);
    check_made("sform.nii", &nan, NULL, (double[]){0, -3, 0, 2, 0, 0, 0, 0, 4, 0, 0, 0}, "");
    set_f32(&b, 280 + 4 * 4, 0, false); /* x nowhere either: y has its place */
    check_made("sform.nii", &b, NULL, (double[]){0, 2, 0, 2, 0, 0, 0, 0, 4, 0, 0, 0}, "");
    set_f32(&b, 280 + 4 * 1, 0, false);
    for (size_t i = 0; i < 3; i++)
        set_f32(&b, 280 + 4 * i, 1, false); /* all along x */
    set_f32(&b, 280 + 4 * 3, 9, false);
    check_made("sform.nii", &b, NULL, (double[]){2, 0, 0, 0, 3, 0, 0, 0, 4, 9, 0, 0}, "");
    set_f32(&b, 280 + 4 * 2, 0, false); /* z nowhere, x and y the same way */
    check_made("sform.nii", &b, NULL, (double[]){2, 0, 0, 0, 3, 0, 0, 0, 4, 9, 0, 0}, "");
    for (size_t i = 0; i < 3; i++)
        set_f32(&b, 80 + 4 * i, NAN, false);
    check_made("sform.nii", &b, NULL, (double[]){1, 0, 0, 0, 1, 0, 0, 0, 1, 9, 0, 0}, "xyz");
}

/* ---- MetaImage ---- */

static void test_metaimage(void)
{
    const char *const bad[] = {"0", "nan", "inf"};
    for (int i = 0; i < 3; i++) {
        char text[300];
        snprintf(text, sizeof text,
                 "NDims = 3\nDimSize = 2 2 2\nTransformMatrix = 0 1 0 -1 0 0 0 0 -1\nElementSpacing = 2 %s 4\n"
                 "ElementType = MET_UCHAR\nElementDataFile = LOCAL\n",
                 bad[i]);
        Block b = {.size = 0};
        put_text(&b, text);
        put(&b, "\0\1\2\3\4\5\6\7", 8);
        check_made("zero.mha", &b, NULL, (double[]){0, 2, 0, -1, 0, 0, 0, 0, -4, 0, 0, 0}, "y");
    }
}

int main(void)
{
    make_folder();
    RUN(test_mrc_cell);
    RUN(test_mrc_cell_oblique);
    RUN(test_mrc_order);
    RUN(test_mrc_bytes);
    RUN(test_mrc_modes);
    RUN(test_nifti);
    RUN(test_nifti_sform);
    RUN(test_metaimage);
    remove_folder();
    return test_end();
}
