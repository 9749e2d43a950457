/* What a file is, its first bytes tell. */
#include "import/formats.h"

#include "import/sampled.h"

static VolStatus read_one_dicom(const VolSource *source, VolSampled *out, VolError *err)
{
    VolBytes bytes = *source->bytes;
    *source->bytes = (VolBytes){0};
    size_t images;
    return vol_read_dicom(&bytes, &source->name, 1, source, out, &images, err);
}

static const VolFormat formats[] = {
    {"NIfTI", vol_is_nifti, vol_read_nifti},
    {"NRRD", vol_is_nrrd, vol_read_nrrd},
    {"MetaImage", vol_is_metaimage, vol_read_metaimage},
    {".vti", vol_is_vtk_xml, vol_read_vtk_xml, true},
    {"legacy .vtk", vol_is_vtk_legacy, vol_read_vtk_legacy, true},
    {"MRC", vol_is_mrc, vol_read_mrc},
    {"DICOM", vol_is_dicom, read_one_dicom, true},
    {"Inviwo .dat", vol_is_inviwo_dat, vol_read_inviwo_dat},
};

const VolFormat *vol_format_of(const VolBytes *bytes)
{
    for (size_t i = 0; i < sizeof formats / sizeof *formats; i++)
        if (formats[i].is(bytes))
            return &formats[i];
    return NULL;
}

const char *vol_import_format(const VolBytes *bytes)
{
    unsigned char head[1 << 16]; /* comments may come before what tells */
    VolBytes seen = *bytes;
    if (vol_is_packed(bytes))
        seen = (VolBytes){head, vol_unpack_head(bytes, head, sizeof head)};
    const VolFormat *format = seen.size ? vol_format_of(&seen) : NULL;
    return format && !vol_vtk_mesh(&seen) ? format->name : NULL;
}
