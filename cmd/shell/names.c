/* Names of outputs that promise what is not in them. */
#include <stdio.h>
#include <string.h>
#include <strings.h>

#include "cmd/shell/program.h"

/* The format that a file's name ends with; NULL: none that we know. */
static const char *format_of_name(const char *path)
{
    static const char *const endings[][2] = {
        {"bmp", "BMP"},   {"csv", "CSV"},   {"dcm", "DICOM"}, {"exr", "EXR"},   {"gif", "GIF"},        {"gz", "gzip"},
        {"hdr", "HDR"},   {"jpeg", "JPEG"}, {"jpg", "JPEG"},  {"json", "JSON"}, {"mha", "MetaImage"},  {"mhd", "MetaImage"},
        {"mrc", "MRC"},   {"nii", "NIfTI"}, {"nrrd", "NRRD"}, {"nvdb", "NanoVDB"}, {"pdf", "PDF"},     {"pfm", "PFM"},
        {"png", "PNG"},   {"ppm", "PPM"},   {"raw", "bare samples"}, {"svg", "SVG"}, {"tga", "TGA"},   {"tif", "TIFF"},
        {"tiff", "TIFF"}, {"txt", "text"},  {"vdb", "VDB"},   {"vti", "VTK"},   {"vtk", "VTK"},        {"webp", "WebP"}};
    const char *dot = strrchr(path, '.');
    for (size_t i = 0; dot && i < sizeof endings / sizeof *endings; i++)
        if (strcasecmp(dot + 1, endings[i][0]) == 0)
            return endings[i][1];
    return NULL;
}

void run_warn_of_name(const Run *run, const char *path, const char *format)
{
    const char *promised = format_of_name(path);
    if (!promised || strcmp(promised, format) == 0)
        return;
    bool picture = strcmp(format, "EXR") == 0 && strcmp(promised, "PNG") == 0;
    vol_warn(&run->log, "what is written to '%s' is %s, not %s%s", path, format, promised,
             picture ? ": vol-info --plot makes a PNG of it" : "");
}
