/* DICOM slices at uneven places: what jitters, what is missing, and what is no series of even steps. */
#include "dicom_files.h"

/* A folder of slices at these places, each with its number in the list as its value. */
static void save_places(const char *name, const double *z, int count)
{
    make_inner_folder(name);
    for (int i = 0; i < count; i++) {
        char file[64], place[32];
        snprintf(file, sizeof file, "%s/%03d.dcm", name, i);
        snprintf(place, sizeof place, "%.9g", z[i]);
        save_plane(file, &(Plane){.z = place, .pixels = {i, i}});
    }
}

static VolImportOptions filled(void)
{
    VolImportOptions options = plain;
    options.fill_gaps = true;
    return options;
}

/* Six slices 1.5 apart but for the third step. */
static void save_jump(const char *name, double step)
{
    double z[6];
    for (int i = 0; i < 6; i++)
        z[i] = 30 + 1.5 * i + (i > 2 ? step - 1.5 : 0);
    save_places(name, z, 6);
}

/* No whole number of steps: nothing that could be filled is missing. */
static void test_jumps(void)
{
    const double ratios[] = {1.55, 1.7, 1.8, 2.2, 2.3, 2.4, 2.5, 2.6, 3.5, 10.4, 41.5 / 1.5};
    const VolImportOptions fill = filled();
    for (size_t i = 0; i < sizeof ratios / sizeof *ratios; i++) {
        char name[32];
        snprintf(name, sizeof name, "jump%zu", i);
        save_jump(name, 1.5 * ratios[i]);
        check_refused(name, NULL, "002.dcm' at 0, 0, 33 and ");
        check_refused(name, NULL, "where 1.5 is usual");
        check_refused(name, &fill, "--fill-gaps fills only whole steps");
    }
    check_refused("jump10", NULL, "003.dcm' at 0, 0, 74.5: they are 41.5 apart");
    const double ends[5] = {0, 2, 4, 6, 9.5}, begins[5] = {0, 3.5, 5.5, 7.5, 9.5}, three[3] = {0, 1, 2.7};
    save_places("ends", ends, 5);
    check_refused("ends", NULL, "0, 0, 9.5: they are 3.5 apart");
    save_places("begins", begins, 5);
    check_refused("begins", NULL, "0, 0, 3.5: they are 3.5 apart");
    save_places("three", three, 3);
    check_refused("three", NULL, "0, 0, 2.7: they are 1.7 apart");
    const double both[8] = {0, 2, 4, 8, 10, 12, 17, 19}; /* the one that cannot be filled is named */
    save_places("both", both, 8);
    check_refused("both", NULL, "0, 0, 17: they are 5 apart");
    check_refused("both", &fill, "0, 0, 17: they are 5 apart");
    const double parts[9] = {0, 2.5, 5, 7.5, 10, 12.5, 13.5, 14.5, 15.5}; /* two series in one */
    save_places("parts", parts, 9);
    check_refused("parts", NULL, "they are 2.5 apart where 1 is usual; with other places 5");
}

/* Within half a step nothing is refused. */
static void test_jitter(void)
{
    const double z[7] = {0, 1.4, 3.1, 4.4, 6, 7.6, 9}, half[5] = {0, 2, 4, 7, 9}, near[6] = {0, 2, 4, 4.7, 6, 8};
    save_places("jitter", z, 7);
    check_import("jitter", NULL, VOL_STORE_FLOAT, (int32_t[]){2, 1, 7}, NULL,
                 (double[]){0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 5, 5, 6, 6});
    save_places("half", half, 5);
    check_import("half", NULL, VOL_STORE_FLOAT, (int32_t[]){2, 1, 5}, NULL, (double[]){0, 0, 1, 1, 2, 2, 3, 3, 4, 4});
    save_places("near", near, 6);
    check_import("near", NULL, VOL_STORE_FLOAT, (int32_t[]){2, 1, 6}, NULL,
                 (double[]){0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 5, 5});
}

/* More steps with a missing slice than without. */
static void test_most_missing(void)
{
    static const struct {
        int count;
        double z[8];
        const char *says;
    } cases[] = {
        {6, {0, 2, 4, 6, 7, 8}, "1 slice is missing at 0, 0, 1,"},
        {4, {0, 2, 4, 5}, "1 slice is missing at 0, 0, 1,"},
        {6, {0, 2, 4, 6, 8, 9}, "with other places 4 are missing at 4"},
        {6, {0, 1, 3, 5, 7, 9}, "1 slice is missing at 0, 0, 2,"},
        {5, {0, 3, 6, 9, 10}, "2 slices are missing at 0, 0, 1,"},
        {5, {0, 2, 5, 8, 9}, "with other places 5 are missing at 3"},
        {6, {0, 2.03, 4.01, 5.97, 7, 8}, "with other places 3 are missing at 3"},
    };
    const VolImportOptions fill = filled();
    for (size_t n = 0; n < sizeof cases / sizeof *cases; n++) {
        char name[32];
        snprintf(name, sizeof name, "most%zu", n);
        save_places(name, cases[n].z, cases[n].count);
        check_refused(name, NULL, cases[n].says);
        VolImported got;
        VolError err = {""};
        int slots = (int)(cases[n].z[cases[n].count - 1] + 1.5), at = 0;
        if (import_file(name, &fill, &got, &err) || got.dims[2] != slots) {
            FAIL("%s: %d slices, message '%s'", name, got.dims[2], err.text);
        } else {
            for (int k = 0; k < slots; k++) {
                bool there = (int)(cases[n].z[at] + 0.5) == k;
                CHECK(there ? got.single[2 * k] == (float)at : isnan((double)got.single[2 * k]));
                at += there;
            }
        }
        vol_imported_free(&got);
    }
}

/* Numbers are no places: however far apart they are, the slices may be neighbours. */
static void test_numbers(void)
{
    const char *const numbers[4] = {"1", "3", "5", "10"};
    make_inner_folder("numbers");
    for (int i = 0; i < 4; i++) {
        char file[64];
        snprintf(file, sizeof file, "numbers/%d", i);
        save_plane(file, &(Plane){.number = numbers[i], .pixels = {i, i}});
    }
    check_import("numbers", NULL, VOL_STORE_FLOAT, (int32_t[]){2, 1, 4}, NULL, (double[]){0, 0, 1, 1, 2, 2, 3, 3});
}

int main(void)
{
    make_folder();
    RUN(test_jumps);
    RUN(test_jitter);
    RUN(test_most_missing);
    RUN(test_numbers);
    remove_folder();
    return test_end();
}
