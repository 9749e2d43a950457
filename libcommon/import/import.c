/* A file, several or a folder: who reads them. */
#include "import/import.h"

#include <string.h>
#include <sys/stat.h>

#include "import/formats.h"
#include "io/in.h"

/* What has no names for its arrays; VTK and DICOM have. */
static VolStatus refuse_array(const VolSource *source, const char *format, VolError *err)
{
    if (!source->options->array)
        return VOL_OK;
    return vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': there is no array '%s': %s holds one, without a name",
                    source->name, source->options->array, format);
}

/* Unpacks gzip or bzip2 and hands the bytes to the reader of their format. */
static VolStatus open_bytes(const VolSource *source, VolSampled *out, VolError *err)
{
    VolBytes *bytes = source->bytes;
    VolStatus status = vol_unpack(bytes, source->name, err);
    if (status)
        return status;
    if (bytes->size == 0)
        return vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': it is empty", source->name);
    const VolFormat *format = vol_format_of(bytes);
    if (format && !format->named)
        status = refuse_array(source, format->name, err);
    if (format)
        return status ? status : format->read(source, out, err);
    return vol_refuse_unread(bytes, source->name, err);
}

static VolStatus open_one(const char *path, const VolSource *source, VolSampled *out, VolError *err)
{
    VolBytes bytes = {0};
    VolSource one = *source;
    one.bytes = &bytes;
    VolStatus status = source->files->read(source->files->user, path, &bytes, err);
    if (!status)
        status = open_bytes(&one, out, err);
    vol_bytes_free(&bytes);
    return status;
}

VolStatus vol_import_open(const char *const *paths, size_t count, const VolImportOptions *options,
                          const VolImportFiles *files, const VolLog *log, VolSampled *out, VolError *err)
{
    VolSource source = {
        .name = strcmp(paths[0], "-") == 0 ? "stdin" : paths[0], .options = options, .files = files, .log = log};
    struct stat info;
    *out = (VolSampled){0};
    VolStatus status;
    if (options->raw)
        status = vol_read_raw(&source, paths, count, out, err);
    else if (count > 1)
        status = vol_read_dicom_files(paths, count, &source, out, err);
    else if (strcmp(paths[0], "-") != 0 && stat(paths[0], &info) == 0 && S_ISDIR(info.st_mode))
        status = vol_read_dicom_folder(paths[0], &source, out, err);
    else
        status = open_one(paths[0], &source, out, err);
    if (status)
        vol_sampled_free(out);
    return status;
}
