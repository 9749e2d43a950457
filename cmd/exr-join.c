/* exr-join: crops of one frame become the frame. */
#include <stdlib.h>

#include "cmd/shell/program.h"
#include "io/exr.h"
#include "io/in.h"
#include "join/join.h"

static VolStatus read_crop(const Run *run, const char *path, VolImage *out, VolError *err)
{
    VolBytes bytes;
    VolStatus status = run_read(run, path, &bytes, err);
    if (status)
        return status;
    if (vol_kind(&bytes) == VOL_KIND_EXR)
        status = vol_exr_read(&bytes, vol_input_name(path), out, err);
    else
        status = run_wrong_kind("cannot join", vol_input_name(path), "an EXR image", &bytes, err);
    vol_bytes_free(&bytes);
    return status;
}

static VolStatus join(const Run *run, const VolImage *crops, const char *const *names, size_t count, VolError *err)
{
    VolImage frame;
    VolBytes bytes = {0};
    VolStatus status = vol_join_images(crops, names, count, &frame, err);
    vol_stats_stage(run->stats, "join");
    if (!status)
        status = vol_exr_write(&frame, VOL_EXR_ZIP, run->threads, &bytes, NULL, err);
    if (!status)
        status = run_write(run, &bytes, true, err);
    vol_stats_stage(run->stats, "write");
    vol_bytes_free(&bytes);
    vol_image_free(&frame);
    return status;
}

static VolStatus join_main(const Run *run, VolError *err)
{
    const char *only = "-";
    size_t count = run->line->operands.count ? run->line->operands.count : 1;
    const char **paths = run->line->operands.count ? run->line->operands.words : &only;
    VolStatus status = run_check_output(run, true, err);
    if (status)
        return status;
    run_warn_of_name(run, run->common->output, "EXR");
    VolImage *crops = vol_alloc_zero(count, sizeof *crops);
    const char **names = vol_alloc_zero(count, sizeof *names);
    if (!crops || !names)
        status = vol_fail_memory(err, count * sizeof *crops);
    for (size_t i = 0; i < count && !status; i++) {
        names[i] = vol_input_name(paths[i]);
        status = read_crop(run, paths[i], &crops[i], err);
    }
    vol_stats_stage(run->stats, "read");
    if (!status)
        status = join(run, crops, names, count, err);
    for (size_t i = 0; i < count && crops; i++)
        vol_image_free(&crops[i]);
    free(crops);
    free(names);
    return status;
}

static const Program program = {
    .name = "exr-join", .summary = "joins crops of one frame", .operands = "PART.exr ...", .max_operands = -1,
    .main = join_main,
};

int main(int argc, char **argv) { return program_main(&program, argc, argv); }
