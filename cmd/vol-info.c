/* vol-info: what is in a stream. */
#include <stdlib.h>
#include <string.h>

#include "cmd/shell/program.h"
#include "inspect/inspect.h"
#include "inspect/picture.h"

static struct Options {
    bool json, history, metadata;
    const char *plot;
} options;

static const VolOpt table[] = {
    {.name = "json", .kind = VOL_OPT_FLAG, .offset = offsetof(struct Options, json), .help = "JSON instead of text"},
    {.name = "plot", .kind = VOL_OPT_TEXT, .offset = offsetof(struct Options, plot), .value_name = "FILE.png",
     .help = "draw the image, or a volume's histograms, with the logarithm of the counts"},
    {.letter = 'H', .name = "history", .kind = VOL_OPT_FLAG, .offset = offsetof(struct Options, history),
     .help = "print only the commands that made the file, oldest first"},
    {.name = "metadata", .kind = VOL_OPT_FLAG, .offset = offsetof(struct Options, metadata),
     .help = "decode no voxels and pixels: headers, attributes and metadata alone"},
};

static VolStatus inspect_vdb(VolBytes *bytes, const char *name, bool headers_only, VolInspection *out, VolError *err)
{
    VolVdb *vdb;
    size_t size = bytes->size;
    VolStatus status = vol_vdb_open(*bytes, name, &vdb, err);
    *bytes = (VolBytes){0}; /* the container's now */
    if (status)
        return status;
    status = vol_inspect_vdb(vdb, size, headers_only, out, err);
    vol_vdb_close(vdb);
    return status;
}

static VolStatus inspect_exr(const VolBytes *bytes, const char *name, bool headers_only, VolInspection *out, VolError *err)
{
    VolImage image;
    VolStatus status = (headers_only ? vol_exr_read_header : vol_exr_read)(bytes, name, &image, err);
    if (status)
        return status;
    status = vol_inspect_exr(&image, bytes->size, headers_only, out, err);
    vol_image_free(&image);
    return status;
}

/* `plot`: with --plot the PNG file, else empty. */
static VolStatus inspect(const Run *run, VolInspection *out, VolBytes *plot, VolError *err)
{
    const char *name = vol_input_name(run_input(run));
    bool headers_only = (options.metadata || options.history) && !options.plot;
    VolBytes bytes;
    VolStatus status = run_read(run, run_input(run), &bytes, err);
    if (status)
        return status;
    switch (vol_kind(&bytes)) {
    case VOL_KIND_VDB:
        status = inspect_vdb(&bytes, name, headers_only, out, err);
        if (!status && options.plot)
            status = vol_inspection_plot(out, plot, err);
        break;
    case VOL_KIND_EXR:
        status = inspect_exr(&bytes, name, headers_only, out, err);
        if (!status && options.plot)
            status = vol_picture_png(&bytes, name, &run->log, plot, err);
        break;
    default:
        status = run_wrong_kind("cannot inspect", name, "VDB or EXR", &bytes, err);
    }
    vol_bytes_free(&bytes);
    return status;
}

static VolStatus write_history(const Run *run, const char *history, VolError *err)
{
    if (!history) {
        vol_note(&run->log, "no history in '%s'", vol_input_name(run_input(run)));
        return run_write_text(run, vol_copy_text(""), err);
    }
    char *lines = vol_format_text("%s\n", history);
    if (!lines)
        return vol_fail_memory(err, strlen(history) + 2);
    for (char *c = lines; *c; c++) /* the file's text goes to a terminal perhaps */
        if (((unsigned char)*c < 32 && *c != '\n' && *c != '\t') || *c == 127)
            *c = '?';
    return run_write_text(run, lines, err);
}

static VolStatus info_main(const Run *run, VolError *err)
{
    if (options.plot && strcmp(options.plot, "-") == 0)
        return vol_fail(err, VOL_USAGE, "option --plot: stdout is taken by the description");
    if (options.plot)
        run_warn_of_name(run, options.plot, "PNG");
    VolInspection inspection = {0};
    VolBytes text = {0}, plot = {0};
    VolStatus status = inspect(run, &inspection, &plot, err);
    if (!status && options.plot)
        status = run_write_to(run, options.plot, &plot, true, err);
    if (!status && options.history)
        status = write_history(run, inspection.history, err);
    else if (!status) {
        status = (options.json ? vol_inspection_json : vol_inspection_text)(&inspection, &text, err);
        if (!status)
            status = run_write(run, &text, false, err);
    }
    vol_bytes_free(&text);
    vol_bytes_free(&plot);
    vol_inspection_free(&inspection);
    return status;
}

static const Program program = {
    .name = "vol-info", .summary = "tells what is in a VDB or EXR stream", .operands = "[IN]", .table = table,
    .rows = sizeof table / sizeof *table, .options = &options, .max_operands = 1,
    .also = &options.plot, .main = info_main,
};

int main(int argc, char **argv) { return program_main(&program, argc, argv); }
