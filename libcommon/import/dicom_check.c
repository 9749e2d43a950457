/* What of DICOM cannot be read as a volume, and what to do about it. */
#include <inttypes.h>
#include <string.h>

#include "import/dicom.h"

static bool begins(const char *text, const char *head) { return strncmp(text, head, strlen(head)) == 0; }

typedef struct Syntax {
    const char *head;  /* what its UID begins with */
    const char *name, *remedy;
} Syntax;

#define JPEG "1.2.840.10008.1.2.4."
static const char jpeg[] = "decompress the files with dcmdjpeg first", jpls[] = "decompress them with dcmdjpls first",
                  raw[] = "decompress the files with gdcmconv --raw first", video[] = "a video is no volume";

/* The first that fits counts. */
static const Syntax syntaxes[] = {
    {"1.2.840.10008.1.2.5", "RLE", "decompress the files with dcmdrle first"},
    {JPEG "80", "JPEG-LS", jpls},
    {JPEG "81", "JPEG-LS", jpls},
    {JPEG "90", "JPEG 2000", raw},
    {JPEG "91", "JPEG 2000", raw},
    {JPEG "92", "JPEG 2000", raw},
    {JPEG "93", "JPEG 2000", raw},
    {JPEG "94", "JPIP", "the pixels lie on a server"},
    {JPEG "95", "JPIP", "the pixels lie on a server"},
    {JPEG "201", "HTJ2K", raw},
    {JPEG "202", "HTJ2K", raw},
    {JPEG "203", "HTJ2K", raw},
    {JPEG "204", "JPIP HTJ2K", "the pixels lie on a server"},
    {JPEG "205", "JPIP HTJ2K", "the pixels lie on a server"},
    {JPEG "10", "MPEG or HEVC", video},
    {JPEG "11", "JPEG XL", "have them decompressed by a program that knows it"},
    {JPEG "5", "JPEG", jpeg},
    {JPEG "6", "JPEG", jpeg},
    {JPEG "70", "JPEG lossless", jpeg},
    {"1.2.840.10008.1.2.7.", "SMPTE ST 2110", video},
    {"1.2.840.10008.1.2.8.", "deflated frames", "have them decompressed by a program that knows it"},
    {"1.2.840.10008.1.2.1.98", "encapsulated", "unpack the files with gdcmconv --raw first"},
};

static VolStatus check_syntax(const DicomFile *f, VolError *err)
{
    const char *const plain[] = {"1.2.840.10008.1.2", "1.2.840.10008.1.2.1", "1.2.840.10008.1.2.2",
                                 "1.2.840.10008.1.2.1.99"}; /* the last: deflated, which is unpacked by now */
    for (size_t i = 0; i < sizeof plain / sizeof *plain; i++)
        if (strcmp(f->syntax, plain[i]) == 0) {
            if (!f->encapsulated)
                return VOL_OK;
            return vol_fail(err, VOL_BAD_INPUT,
                            "cannot import '%s': the DICOM pixels are compressed, which transfer syntax %s denies; "
                            "try gdcmconv --raw",
                            f->name, f->syntax);
        }
    for (size_t i = 0; i < sizeof syntaxes / sizeof *syntaxes; i++)
        if (begins(f->syntax, syntaxes[i].head))
            return vol_fail(err, VOL_BAD_INPUT,
                            "cannot import '%s': DICOM transfer syntax %s (%s) is compressed: %s", f->name,
                            f->syntax, syntaxes[i].name, syntaxes[i].remedy);
    return vol_fail(err, VOL_BAD_INPUT,
                    "cannot import '%s': DICOM transfer syntax %s is unknown; convert the files to explicit little "
                    "endian first (dcmconv, gdcmconv --raw)",
                    f->name, f->syntax);
}

static VolStatus check_kind(const DicomFile *f, VolError *err)
{
    if (f->mosaic)
        return vol_fail(err, VOL_BAD_INPUT,
                        "cannot import '%s': a Siemens mosaic, in which all slices are one picture: convert it to "
                        "NIfTI first (dcm2niix)",
                        f->name);
    if (f->samples != 1)
        return vol_fail(err, VOL_BAD_INPUT,
                        "cannot import '%s': DICOM with %u samples per pixel (%s) is not grey: make it grey first",
                        f->name, (unsigned)f->samples, f->photometric[0] ? f->photometric : "colour");
    if (f->photometric[0] && !begins(f->photometric, "MONOCHROME"))
        return vol_fail(err, VOL_BAD_INPUT,
                        "cannot import '%s': DICOM with photometric interpretation %s is not grey: its samples are "
                        "no measured values",
                        f->name, f->photometric);
    if (f->varies && f->frames > 1 && !f->frames_placed)
        return vol_fail(err, VOL_BAD_INPUT,
                        "cannot import '%s': its %u frames are of several %s, not one slice each of a volume",
                        f->name, (unsigned)f->frames, f->varies);
    return VOL_OK;
}

static VolStatus check_bits(const DicomFile *f, VolError *err)
{
    unsigned bits = f->bits_allocated;
    if (f->sample != DICOM_INTEGER) {
        unsigned wanted = f->sample == DICOM_FLOAT ? 32 : 64;
        if (bits == wanted)
            return VOL_OK;
        return vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': DICOM floats of %u bits, not %u", f->name, bits,
                        wanted);
    }
    if (bits != 1 && bits != 8 && bits != 16 && bits != 32)
        return vol_fail(err, VOL_BAD_INPUT,
                        "cannot import '%s': DICOM with %u bits allocated to a sample: only 1, 8, 16 and 32 are "
                        "read",
                        f->name, bits);
    if (f->bits_stored < 1 || f->bits_stored > bits || f->high_bit >= bits || f->high_bit + 1 < f->bits_stored)
        return vol_fail(err, VOL_BAD_INPUT,
                        "cannot import '%s': DICOM bits are impossible: %u stored up to bit %u of %u", f->name,
                        (unsigned)f->bits_stored, (unsigned)f->high_bit, bits);
    if (bits == 1 && f->big_endian)
        return vol_fail(err, VOL_BAD_INPUT,
                        "cannot import '%s': single bits in big-endian DICOM are not read: convert it to little "
                        "endian first (dcmconv +te)",
                        f->name);
    return VOL_OK;
}

VolStatus vol_dicom_check(const DicomFile *f, VolError *err)
{
    VolStatus status = check_syntax(f, err);
    if (!status)
        status = check_kind(f, err);
    if (!status && (!f->rows || !f->columns || !f->frames))
        status = vol_fail(err, VOL_BAD_INPUT,
                          "cannot import '%s': DICOM size is impossible: %u rows, %u columns, %u frames", f->name,
                          (unsigned)f->rows, (unsigned)f->columns, (unsigned)f->frames);
    if (!status)
        status = check_bits(f, err);
    if (!status)
        status = vol_dicom_check_lut(f, err);
    if (status)
        return status;
    uint64_t wanted = ((uint64_t)f->rows * f->columns * f->frames * f->bits_allocated + 7) / 8;
    wanted += f->swapped ? wanted & 1 : 0;
    if (f->pixel_bytes < wanted)
        return vol_fail(err, VOL_BAD_INPUT,
                        "cannot import '%s': truncated: the pixels are %" PRIu64 " bytes, there are %zu", f->name,
                        wanted, f->pixel_bytes);
    if (f->each && f->each_count != f->frames)
        return vol_fail(err, VOL_BAD_INPUT,
                        "cannot import '%s': functional groups of %zu frames, but there are %u frames", f->name,
                        f->each_count, (unsigned)f->frames);
    return VOL_OK;
}
