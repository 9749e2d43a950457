/* vol-diff: are two images or two sets of grids the same, where not, and by how much? */
#include <string.h>

#include "cmd/shell/program.h"
#include "compare/compare.h"

static struct Options {
    double max, rms, rel;
} options;

static const VolOpt table[] = {
    {.name = "max", .kind = VOL_OPT_REAL, .offset = offsetof(struct Options, max), .value_name = "E",
     .help = "allow differences of up to E"},
    {.name = "rms", .kind = VOL_OPT_REAL, .offset = offsetof(struct Options, rms), .value_name = "E",
     .help = "allow a root mean square difference of up to E in each channel or grid"},
    {.name = "rel", .kind = VOL_OPT_REAL, .offset = offsetof(struct Options, rel), .value_name = "E",
     .help = "allow differences of up to E times the larger of the two values"},
};

static VolStatus read_tolerance(const Run *run, VolTolerance *out, VolError *err)
{
    *out = (VolTolerance){.max_given = run_given(run, "max"), .rms_given = run_given(run, "rms"),
                          .rel_given = run_given(run, "rel"), .max = options.max, .rms = options.rms, .rel = options.rel};
    if (options.max < 0 || options.rms < 0 || options.rel < 0)
        return vol_fail(err, VOL_USAGE, "bounds cannot be negative");
    return VOL_OK;
}

/* stdout is the report's. */
static bool difference_wanted(const Run *run) { return strcmp(run->common->output, "-") != 0; }

static VolStatus diff_images(const Run *run, VolBytes bytes[2], const char *names[2], const VolTolerance *tolerance,
                             VolReport *report, VolError *err)
{
    VolImage image[2] = {{0}, {0}}, difference = {0};
    VolStatus status = vol_exr_read(&bytes[0], names[0], &image[0], err);
    if (!status)
        status = vol_exr_read(&bytes[1], names[1], &image[1], err);
    bool wanted = difference_wanted(run);
    if (wanted)
        run_warn_of_name(run, run->common->output, "EXR");
    if (!status)
        status = vol_compare_images(&image[0], &image[1], tolerance, report, wanted ? &difference : NULL, err);
    VolBytes exr = {0};
    if (!status && difference.part_count)
        status = vol_exr_write(&difference, VOL_EXR_ZIP, run->threads, &exr, NULL, err);
    if (!status && difference.part_count)
        status = run_write(run, &exr, true, err);
    if (!status && wanted && !difference.part_count)
        vol_warn(&run->log, "no difference image '%s': no channel could be compared", run->common->output);
    vol_bytes_free(&exr);
    vol_image_free(&image[0]);
    vol_image_free(&image[1]);
    vol_image_free(&difference);
    return status;
}

static VolStatus diff_grids(VolBytes bytes[2], const char *names[2], const VolTolerance *tolerance, VolReport *report,
                            VolError *err)
{
    VolVdb *vdb[2] = {NULL, NULL};
    VolVdbSide side[2];
    VolStatus status = VOL_OK;
    for (int i = 0; i < 2 && !status; i++) {
        side[i].bytes = bytes[i].data;
        status = vol_vdb_open(bytes[i], names[i], &vdb[i], err);
        bytes[i] = (VolBytes){0}; /* the container's now */
        side[i].vdb = vdb[i];
    }
    if (!status)
        status = vol_compare_grids(side[0], side[1], tolerance, report, err);
    for (int i = 0; i < 2; i++)
        if (vdb[i])
            vol_vdb_close(vdb[i]);
    return status;
}

static VolStatus diff(const Run *run, VolBytes bytes[2], const char *names[2], VolReport *report, VolError *err)
{
    VolTolerance tolerance;
    VolStatus status = read_tolerance(run, &tolerance, err);
    if (status)
        return status;
    VolKind kind[2] = {vol_kind(&bytes[0]), vol_kind(&bytes[1])};
    for (int i = 0; i < 2; i++)
        if (kind[i] != VOL_KIND_EXR && kind[i] != VOL_KIND_VDB)
            return run_wrong_kind("cannot compare", names[i], "VDB or EXR", &bytes[i], err);
    if (kind[0] != kind[1])
        return vol_fail(err, VOL_BAD_INPUT, "cannot compare '%s' and '%s': one is an image, the other holds grids",
                        names[0], names[1]);
    if (kind[0] == VOL_KIND_EXR)
        return diff_images(run, bytes, names, &tolerance, report, err);
    if (difference_wanted(run))
        return vol_fail(err, VOL_USAGE, "option --output: difference images are made of images, not of grids");
    return diff_grids(bytes, names, &tolerance, report, err);
}

/* The report goes to stdout, whatever -o says: that is the difference image. */
static VolStatus print_report(const Run *run, VolReport *report, VolError *err)
{
    if (run->common->quiet)
        return VOL_OK;
    bool different = report->different;
    const char *verdict = different ? "different\n" : "same\n";
    VolStatus status = vol_bytes_append(&report->text, &report->capacity, verdict, strlen(verdict), err);
    if (!status)
        status = run_write_to(run, "-", &report->text, false, err);
    return status;
}

static VolStatus diff_main(const Run *run, VolError *err)
{
    const VolTextList *operands = &run->line->operands;
    if (operands->count != 2)
        return vol_fail(err, VOL_USAGE, "two inputs are needed, not %zu", operands->count);
    const char *names[2] = {vol_input_name(operands->words[0]), vol_input_name(operands->words[1])};
    VolBytes bytes[2] = {{0}, {0}};
    VolReport report = {0};
    VolStatus status = run_read(run, operands->words[0], &bytes[0], err);
    if (!status)
        status = run_read(run, operands->words[1], &bytes[1], err);
    if (!status)
        status = diff(run, bytes, names, &report, err);
    if (!status)
        status = print_report(run, &report, err);
    if (!status && report.different)
        status = VOL_NO;
    vol_report_free(&report);
    vol_bytes_free(&bytes[0]);
    vol_bytes_free(&bytes[1]);
    return status;
}

static const Program program = {
    .name = "vol-diff", .summary = "compares two EXR images or two VDB files", .operands = "A B", .table = table,
    .rows = sizeof table / sizeof *table, .options = &options, .max_operands = 2, .reports = true,
    .main = diff_main,
};

int main(int argc, char **argv) { return program_main(&program, argc, argv); }
