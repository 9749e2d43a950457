/* The modality LUT: a table of what stored samples mean, where no slope and intercept tell (PS3.3 C.11.1). */
#include "import/dicom.h"

static uint32_t entries_of(const DicomLut *lut) { return lut->entries ? lut->entries : 65536; }

/* Entries of 8 bits lie in bytes, but some programs give each a word. */
static bool is_wide(const DicomLut *lut) { return lut->bits > 8 || lut->size >= 2 * (size_t)entries_of(lut); }

VolStatus vol_dicom_check_lut(const DicomFile *f, VolError *err)
{
    const DicomLut *lut = &f->lut;
    if (!lut->there)
        return VOL_OK;
    if (f->sample != DICOM_INTEGER)
        return vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': a modality LUT is no table of floats", f->name);
    if (!lut->described)
        return vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': a modality LUT without a descriptor of three numbers",
                        f->name);
    if (lut->bits < 8 || lut->bits > 16)
        return vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': a modality LUT of %u bits: 8 to 16 are read", f->name,
                        (unsigned)lut->bits);
    size_t wanted = (size_t)entries_of(lut) * (lut->bits > 8 ? 2 : 1);
    if (lut->size < wanted)
        return vol_fail(err, VOL_BAD_INPUT,
                        "cannot import '%s': its modality LUT has %zu bytes, not the %zu of %u entries of %u bits", f->name,
                        lut->size, wanted, (unsigned)entries_of(lut), (unsigned)lut->bits);
    return VOL_OK;
}

double vol_dicom_mapped(const DicomFile *f, double stored)
{
    const DicomLut *lut = &f->lut;
    double first = f->is_signed || lut->is_signed ? (double)(int16_t)lut->first : lut->first;
    double last = (double)entries_of(lut) - 1, at = stored - first;
    size_t n = (size_t)(at < 0 ? 0 : at > last ? last : at);
    uint32_t value = is_wide(lut)   ? vol_get_u16(lut->data + 2 * n, lut->big)
                     : lut->swapped ? lut->data[n ^ 1]
                                    : lut->data[n];
    return value & ((UINT32_C(1) << lut->bits) - 1);
}
