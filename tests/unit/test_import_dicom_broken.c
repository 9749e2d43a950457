/* Folders and lists of DICOM with files that are broken, or that are no slices. */
#include "dicom_files.h"

static Block cut; /* what `spoil` makes of a slice */

static void make_series(const char *name, const char *pattern)
{
    make_inner_folder(name);
    for (int i = 1; i <= 4; i++) {
        char file[64], place[16];
        int n = snprintf(file, sizeof file, "%s/", name);
        snprintf(file + n, sizeof file - (size_t)n, pattern, i);
        snprintf(place, sizeof place, "%d", i);
        save_plane(file, &(Plane){.z = place, .number = place, .pixels = {i, i}});
    }
}

static void check_whole(const char *name, int count)
{
    check_import(name, NULL, VOL_STORE_FLOAT, (int32_t[]){2, 1, count}, NULL, (double[]){1, 1, 2, 2, 3, 3, 4, 4});
}

static void check_operands(const char *broken, VolStatus wanted, const char *text)
{
    VolImported got;
    VolError err = {""};
    VolStatus status = import_files((const char *[]){"plain/1.dcm", "plain/2.dcm", broken}, 3, &plain, &got, &err);
    if (status != wanted || !strstr(err.text, text))
        FAIL("%s: status %d, message '%s'", broken, (int)status, err.text);
    vol_imported_free(&got);
}

/* The ways in which copying fails: nothing, the first bytes, room alone. */
static void test_not_dicom(void)
{
    static const char zeros[3000] = {0};
    static const struct {
        size_t size;
        const char *says;
    } ways[] = {{0, "4.dcm' is empty, but named as '"},
                {100, "4.dcm' holds only zeros, but"},
                {3000, "4.dcm' holds only zeros, but"}};
    make_series("plain", "%d.dcm");
    check_whole("plain", 4);
    for (size_t i = 0; i < 3; i++) {
        save("plain/4.dcm", zeros, ways[i].size);
        check_refused("plain", NULL, ways[i].says);
        check_operands("plain/4.dcm", VOL_BAD_INPUT, "plain/4.dcm'");
    }
    save("plain/4.dcm", "<html>404 not found</html>", 26);
    check_refused("plain", NULL, "4.dcm' is not DICOM, but named as '");
    check_operands("plain/4.dcm", VOL_BAD_INPUT, "4.dcm': it is not DICOM");
    save("plain/other.nrrd", "NRRD0001\n", 9);
    check_operands("plain/other.nrrd", VOL_USAGE, "is NRRD");
}

/* Names: an ending, or numbers alone in which they differ. */
static void test_names(void)
{
    static const char *const patterns[] = {"%d.IMA", "IM-0001-%04d", "1.2.840.%d.7", "%d", "slice %d of 4.Dcm", "CT.1.%d"};
    for (size_t i = 0; i < sizeof patterns / sizeof *patterns; i++) {
        char name[32], file[64];
        snprintf(name, sizeof name, "names%zu", i);
        make_series(name, patterns[i]);
        int n = snprintf(file, sizeof file, "%s/", name);
        for (int broken = 4; broken >= 1; broken -= 3) {
            snprintf(file + n, sizeof file - (size_t)n, patterns[i], broken);
            save(file, "", 0);
            check_refused(name, NULL, file);
        }
    }
}

/* What lies beside slices and is none. */
static void test_beside(void)
{
    static const char *const others[] = {"README.txt", "DICOMDIR",   ".DS_Store",   "2.png",  "Thumbs.db", "4.dcm.json",
                                         "VERSION",    "autorun.inf", ".4.dcm", "3.dcm~", "4.dcm.txt"};
    make_series("beside", "%d.dcm");
    make_series("bare", "IM%d");
    for (size_t i = 0; i < sizeof others / sizeof *others; i++) {
        char file[64];
        snprintf(file, sizeof file, "beside/%s", others[i]);
        save(file, "some text", 9);
        check_whole("beside", 4);
        snprintf(file, sizeof file, "bare/%s", others[i]);
        save(file, "some text", 9);
        check_whole("bare", 4);
    }
}

/* Cut between two elements: the file ends well, but the pixels are missing. */
static void test_no_pixels(void)
{
    static Block whole;
    make_series("short", "%d.dcm");
    whole = plane_file(&(Plane){.z = "4", .number = "4", .pixels = {4, 4}});
    const size_t ends[] = {132, 132 + 8 + 20, 132 + 8 + 20 + 8 + 26, whole.size - 12 - 4};
    for (size_t i = 0; i < sizeof ends / sizeof *ends; i++) {
        cut = whole;
        cut.size = ends[i];
        save_block("short/4.dcm", &cut);
        check_refused("short", NULL, "short/4.dcm': it is a slice without pixels");
    }
    cut = plane_file(&(Plane){.z = "4", .number = "4", .series = "9.9", .pixels = {4, 4}});
    cut.size -= 16; /* of another series: no part of this one */
    save_block("short/4.dcm", &cut);
    check_whole("short", 3);
    cut.size = 132 + 8 + 20; /* a report, behind the syntax */
    put_tag_text(&cut, 0x00080016, "UI", "1.2.840.10008.5.1.4.1.1.88.11");
    put_tag_text(&cut, 0x0020000e, "UI", "1.2.3");
    save_block("short/4.dcm", &cut);
    check_whole("short", 3);
    cut = plane_file(&(Plane){.z = "4", .number = "4", .pixels = {4, 4}});
    for (size_t at = 132; at + 10 < cut.size; at++)
        if (memcmp(cut.data + at, "\x28\0\x10\0US", 6) == 0)
            set_int(&cut, at + 8, 0, 2, false);
    save_block("short/4.dcm", &cut); /* Rows 0 */
    check_refused("short", NULL, "DICOM size is impossible: 0 rows, 2 columns");
}

static void test_without_images(void)
{
    make_series("none", "%d.dcm");
    for (int i = 1; i <= 4; i++) {
        char file[32];
        cut = plane_file(&(Plane){.z = "4", .number = "4", .pixels = {4, 4}});
        cut.size -= 16;
        snprintf(file, sizeof file, "none/%d.dcm", i);
        save_block(file, &cut);
    }
    check_refused("none", NULL, "none': none of the 4 DICOM files in the folder holds pixels");
    make_inner_folder("none/inner");
    save_plane("none/inner/1", &(Plane){.z = "1"});
    check_refused("none", NULL, "but those in sub-folders may: give one of them: '");
    check_refused("none", NULL, "none/inner'");
    VolImported got;
    VolError err = {""};
    import_file("none", &plain, &got, &err);
    CHECK(strstr(err.text, "none',") == NULL);
    vol_imported_free(&got);
}

/* Without places numbers order the slices, so every one needs a number. */
static void test_no_numbers(void)
{
    make_inner_folder("unnumbered");
    save_plane("unnumbered/1", &(Plane){.pixels = {1, 1}});
    check_import("unnumbered", NULL, VOL_STORE_FLOAT, (int32_t[]){2, 1, 1}, NULL, (double[]){1, 1});
    save_plane("unnumbered/2", &(Plane){.pixels = {2, 2}});
    check_refused("unnumbered", NULL, "unnumbered/1': it has neither a place nor an instance number");
    save_plane("unnumbered/1", &(Plane){.number = "1"});
    check_refused("unnumbered", NULL, "unnumbered/2': it has neither a place nor an instance number");
    save_plane("unnumbered/2", &(Plane){.number = "1"});
    check_refused("unnumbered", NULL, "it has the same place as");
    check_refused("unnumbered", NULL, "instance number 1");
}

/* Files from before there was a preamble, or that lost it. */
static void test_no_preamble(void)
{
    Block b = plane_file(&(Plane){.z = "1", .pixels = {3, 4}});
    Block bare = {.size = 0}, meta = {.size = 0};
    put(&bare, b.data + 132, b.size - 132);
    save_block("bare.dcm", &bare);
    check_import("bare.dcm", NULL, VOL_STORE_FLOAT, (int32_t[]){2, 1, 1}, NULL, (double[]){3, 4});
    check_cuts("bare.dcm", NULL, &bare, bare.size);
    check_damage(NULL, &bare, 1000);
    put_int(&meta, 2, 4, false); /* group length, version */
    put_text(&meta, "UL");
    put_int(&meta, 4, 2, false);
    put_int(&meta, 28 + 14, 4, false);
    put_tag(&meta, 0x00020001, "OB", "\0\1", 2);
    put(&meta, bare.data, bare.size);
    save_block("meta.dcm", &meta);
    check_import("meta.dcm", NULL, VOL_STORE_FLOAT, (int32_t[]){2, 1, 1}, NULL, (double[]){3, 4});
    make_series("mixed", "%d.dcm");
    bare.size = 0;
    b = plane_file(&(Plane){.z = "4", .number = "4", .pixels = {4, 4}});
    put(&bare, b.data + 132, b.size - 132);
    save_block("mixed/4.dcm", &bare);
    check_whole("mixed", 4);
}

int main(void)
{
    make_folder();
    RUN(test_not_dicom);
    RUN(test_names);
    RUN(test_beside);
    RUN(test_no_pixels);
    RUN(test_without_images);
    RUN(test_no_numbers);
    RUN(test_no_preamble);
    remove_folder();
    return test_end();
}
