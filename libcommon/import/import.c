/* What a file is, its first bytes tell; where they tell nothing, options must. */
#include "import/import.h"

#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "import/dicom.h"
#include "import/readers.h"
#include "io/in.h"

static VolStatus read_one_dicom(const VolSource *source, VolSampled *out, VolError *err)
{
    VolBytes bytes = *source->bytes;
    *source->bytes = (VolBytes){0};
    size_t images;
    return vol_read_dicom(&bytes, &source->name, 1, source, out, &images, err);
}

static const struct {
    const char *name;
    bool (*is)(const VolBytes *bytes);
    VolStatus (*read)(const VolSource *source, VolSampled *out, VolError *err);
    bool named; /* the file gives its arrays names */
} formats[] = {
    {"NIfTI", vol_is_nifti, vol_read_nifti},
    {"NRRD", vol_is_nrrd, vol_read_nrrd},
    {"MetaImage", vol_is_metaimage, vol_read_metaimage},
    {".vti", vol_is_vtk_xml, vol_read_vtk_xml, true},
    {"legacy .vtk", vol_is_vtk_legacy, vol_read_vtk_legacy, true},
    {"MRC", vol_is_mrc, vol_read_mrc},
    {"DICOM", vol_is_dicom, read_one_dicom, true},
    {"Inviwo .dat", vol_is_inviwo_dat, vol_read_inviwo_dat},
};

const char *vol_import_format(const VolBytes *bytes)
{
    unsigned char head[1 << 16]; /* comments may come before what tells */
    VolBytes seen = *bytes;
    if (vol_is_packed(bytes))
        seen = (VolBytes){head, vol_unpack_head(bytes, head, sizeof head)};
    for (size_t i = 0; i < sizeof formats / sizeof *formats; i++)
        if (seen.size && formats[i].is(&seen))
            return vol_vtk_mesh(&seen) ? NULL : formats[i].name;
    return NULL;
}

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
    for (size_t i = 0; i < sizeof formats / sizeof *formats; i++)
        if (formats[i].is(bytes)) {
            status = formats[i].named ? VOL_OK : refuse_array(source, formats[i].name, err);
            return status ? status : formats[i].read(source, out, err);
        }
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
