#include "cmd/shell/outputs.h"

VolStatus outputs_add(Outputs *outputs, const char *path, VolBytes *bytes, VolOutOptions options, VolError *err)
{
    VolStatus status = VOL_OK;
    if (outputs->count == sizeof outputs->items / sizeof *outputs->items)
        status = vol_fail(err, VOL_IO, "cannot write '%s': too many files at once", path);
    else
        status = vol_output_prepare(&outputs->items[outputs->count].output, path, bytes->data, bytes->size, options, err);
    if (status || !outputs->items[outputs->count].output.target.direct)
        vol_bytes_free(bytes);
    if (!status)
        outputs->items[outputs->count++].bytes = *bytes;
    *bytes = (VolBytes){0};
    return status;
}

bool outputs_some_are_direct(const Outputs *outputs)
{
    bool direct = false;
    for (size_t i = 0; i < outputs->count; i++)
        direct |= outputs->items[i].output.target.direct;
    return direct;
}

static VolStatus commit(Outputs *outputs, bool direct, VolError *err)
{
    VolStatus status = VOL_OK;
    for (size_t i = 0; i < outputs->count && !status; i++)
        if (outputs->items[i].output.target.direct == direct)
            status = vol_output_commit(&outputs->items[i].output, err);
    return status;
}

VolStatus outputs_commit_direct(Outputs *outputs, VolError *err) { return commit(outputs, true, err); }

VolStatus outputs_commit_files(Outputs *outputs, VolError *err) { return commit(outputs, false, err); }

void outputs_drop(Outputs *outputs)
{
    for (size_t i = 0; i < outputs->count; i++) {
        vol_output_free(&outputs->items[i].output);
        vol_bytes_free(&outputs->items[i].bytes);
    }
    outputs->count = 0;
}
