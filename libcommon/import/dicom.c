/* DICOM: a series of slices, one file each (or one file of several frames), uncompressed (PS3.5 implicit and
 * explicit little endian, explicit big endian; PS3.10 files).
 *
 * World space is the patient's, left-posterior-superior millimetres, as stored.  Index i runs along a row (the
 * first three cosines of Image Orientation) in steps of the column spacing, j along a column, k from slice to
 * slice; the step of k is the difference of the slices' positions, so that a tilted gantry's shear is kept (PS3.3
 * C.7.6.2). */
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "import/dicom.h"

bool vol_is_dicom(const VolBytes *bytes)
{
    size_t start;
    return vol_dicom_start(bytes, &start);
}

/* The series: the one that --array names (by UID, number or description), or the only one. */
static VolStatus choose_series(DicomFile *files, size_t *count, const char *wanted, const char *name,
                               VolError *err)
{
    const DicomFile *chosen = NULL;
    char list[512] = "";
    size_t used = 0, series = 0;
    for (size_t i = 0; i < *count; i++) {
        const DicomFile *s = &files[i];
        bool seen = false;
        for (size_t k = 0; k < i && !seen; k++)
            seen = strcmp(files[k].series, s->series) == 0;
        if (seen)
            continue;
        series++;
        if (wanted && !chosen && (strcmp(wanted, s->series) == 0 || strcmp(wanted, s->number) == 0 ||
                                  strcmp(wanted, s->description) == 0))
            chosen = s;
        int n = snprintf(list + used, sizeof list - used, "%s%s '%s' (%s)", used ? ", " : "", s->number,
                         s->description, s->series);
        used = n > 0 && used + (size_t)n < sizeof list ? used + (size_t)n : sizeof list - 1;
    }
    if (wanted && !chosen)
        return vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': there is no DICOM series '%s': there are %s",
                        name, wanted, list);
    if (!wanted && series > 1)
        return vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': %zu DICOM series, choose one by --array: %s",
                        name, series, list);
    char uid[sizeof files->series];
    memcpy(uid, chosen ? chosen->series : files->series, sizeof uid);
    size_t kept = 0;
    for (size_t i = 0; i < *count; i++)
        if (strcmp(files[i].series, uid) == 0) {
            DicomFile file = files[i]; /* the others are kept behind these, for their memory */
            files[i] = files[kept];
            files[kept++] = file;
        }
    *count = kept;
    return VOL_OK;
}

/* One stored sample: BitsStored bits that end at HighBit, signed or not (PS3.5 8.1.1). */
static double stored_value(const DicomFile *f, uint64_t n)
{
    if (f->sample == DICOM_FLOAT)
        return (double)vol_get_f32(f->pixels + 4 * n, f->big_endian);
    if (f->sample == DICOM_DOUBLE)
        return vol_get_f64(f->pixels + 8 * n, f->big_endian);
    if (f->bits_allocated == 1)
        return f->pixels[n / 8] >> n % 8 & 1;
    const unsigned char *p = f->pixels + (f->swapped ? n ^ 1 : n) * (size_t)(f->bits_allocated / 8);
    uint32_t raw = f->bits_allocated == 8    ? *p
                   : f->bits_allocated == 16 ? vol_get_u16(p, f->big_endian)
                                             : vol_get_u32(p, f->big_endian);
    raw = raw >> (f->high_bit + 1 - f->bits_stored);
    if (f->bits_stored == 32)
        return f->is_signed ? (double)(int32_t)raw : (double)raw;
    uint32_t span = UINT32_C(1) << f->bits_stored;
    raw &= span - 1;
    return f->is_signed && raw >= span / 2 ? (double)raw - (double)span : (double)raw;
}

/* Values are rescaled slice by slice, since slope and intercept may differ between slices (PET).  Where slices are
 * missing there are NaNs. */
static VolStatus join_slices(const DicomStack *stack, const char *name, VolSampled *out, VolError *err)
{
    const DicomFile *first = stack->slices[0].file;
    *out = (VolSampled){.type = VOL_SAMPLE_F64, .components = 1, .times = (int64_t)stack->times};
    out->dims[0] = first->columns;
    out->dims[1] = first->rows;
    out->dims[2] = stack->slots;
    out->float_holds = first->sample == DICOM_INTEGER ? first->bits_stored <= 16 : first->sample == DICOM_FLOAT;
    vol_sampled_order(out);

    size_t area = (size_t)first->columns * first->rows, slots = (size_t)stack->slots * stack->times;
    double bytes = (double)area * (double)slots * sizeof(double);
    VolStatus status = bytes > VOL_WORTH_A_CHECK ? vol_check_memory(bytes, err) : VOL_OK;
    if (status)
        return vol_fail_within(err, status, "cannot import '%s'", name);
    double *values = vol_alloc(slots, area * sizeof *values);
    if (!values)
        return vol_fail_memory(err, slots * area * sizeof *values);
    for (size_t n = 0; (size_t)stack->slots != stack->count && n < slots * area; n++)
        values[n] = NAN;
    for (size_t i = 0; i < stack->count * stack->times; i++) {
        const DicomSlice *s = &stack->slices[i];
        double *to = values + area * (i / stack->count * (size_t)stack->slots + (size_t)s->slot);
        for (size_t n = 0; n < area; n++) {
            double stored = stored_value(s->file, area * s->frame + n);
            to[n] = s->file->lut.there ? vol_dicom_mapped(s->file, stored)
                                       : s->place->slope * stored + s->place->intercept;
        }
    }
    const uint16_t one = 1;
    out->big_endian = *(const unsigned char *)&one == 0;
    out->bytes = (VolBytes){(unsigned char *)values, slots * area * sizeof *values};
    return vol_sampled_check(out, name, true, err);
}

/* Every frame of every file is a slice. */
static VolStatus list_slices(const DicomFile *files, size_t count, DicomStack *out, VolError *err)
{
    VolStatus status = VOL_OK;
    size_t total = 0, n = 0;
    for (size_t i = 0; !status && i < count; i++) {
        status = vol_dicom_check(&files[i], err);
        total += files[i].frames;
    }
    if (status)
        return status;
    out->slices = vol_alloc_zero(total, sizeof *out->slices);
    if (!out->slices)
        return vol_fail_memory(err, total * sizeof *out->slices);
    for (size_t i = 0; i < count; i++)
        for (uint32_t k = 0; k < files[i].frames; k++)
            out->slices[n++] = (DicomSlice){.file = &files[i],
                                            .place = files[i].each ? &files[i].each[k] : &files[i].common,
                                            .frame = k};
    out->count = total;
    return VOL_OK;
}

/* What is right as it is, but may not be what it seems. */
static void remark(const DicomStack *stack, const VolSource *source)
{
    const DicomFile *first = stack->slices[0].file;
    if (stack->times > 1)
        vol_note(source->log, "'%s': %zu time steps (see --time-step)", source->name, stack->times);
    if (first->cine && first->frames > 1 && !stack->placed)
        vol_warn(source->log, "'%s': its frames follow each other in time; taken as slices", source->name);
    if (strcmp(first->photometric, "MONOCHROME1") == 0)
        vol_note(source->log, "'%s': MONOCHROME1: the smallest values are meant to be the brightest", source->name);
    if (first->real_world)
        vol_note(source->log, "'%s': its real world value mapping is not applied", source->name);
}

/* Files without pixels are reports and the like, unless they say that they are slices: then they were cut. */
static VolStatus check_lost(const DicomFile *lost, size_t lost_count, const DicomFile *files, size_t count, VolError *err)
{
    for (size_t i = 0; i < lost_count; i++) {
        const DicomFile *f = &lost[i];
        bool same = !f->series[0] || strcmp(f->series, files->series) == 0;
        bool slice = f->rows > 0 || (!f->series[0] && !f->kind[0]);
        for (size_t n = 0; f->kind[0] && !slice && n < count; n++)
            slice = strcmp(f->kind, files[n].kind) == 0;
        if (same && slice)
            return vol_fail(err, VOL_BAD_INPUT,
                            "cannot import '%s': it is a slice without pixels: truncated; replace it, or move it elsewhere",
                            f->name);
    }
    return VOL_OK;
}

/* `files` with pixels, and those without. */
static VolStatus read_series(DicomFile *files, size_t count, const DicomFile *lost, size_t lost_count,
                             const VolSource *source, VolSampled *out, VolError *err)
{
    DicomStack stack = {0};
    VolStatus status = choose_series(files, &count, source->options->array, source->name, err);
    if (!status)
        status = check_lost(lost, lost_count, files, count, err);
    if (!status)
        status = list_slices(files, count, &stack, err);
    if (!status)
        status = vol_dicom_order(&stack, source, err);
    if (!status)
        status = join_slices(&stack, source->name, out, err);
    if (!status) {
        vol_dicom_affine(&stack, source->log, &out->index_to_world);
        /* Whoever gives the spacing of such an image does not take the file's geometry: its places order the frames. */
        if (stack.slices[0].file->groups_placed && source->options->spacing_given)
            memset(out->index_to_world.m[3], 0, sizeof out->index_to_world.m[3]);
        remark(&stack, source);
    }
    free(stack.slices);
    return status;
}

VolStatus vol_read_dicom(VolBytes *bytes, const char *const *names, size_t count, const VolSource *source,
                         VolSampled *out, size_t *images, VolError *err)
{
    *out = (VolSampled){0};
    *images = 0;
    size_t lost = count; /* files with pixels from the front, the others from the back */
    DicomFile *files = vol_alloc_zero(count, sizeof *files);
    VolStatus status = files ? VOL_OK : vol_fail_memory(err, count * sizeof *files);
    for (size_t i = 0; !status && i < count; i++) {
        DicomFile file = {0};
        status = vol_dicom_unpack(&bytes[i], names[i], err);
        if (!status)
            status = vol_dicom_parse(&bytes[i], names[i], &file, err);
        if (status || file.pixels)
            files[(*images)++] = file;
        else
            files[--lost] = file;
    }
    if (!status && *images == 0)
        status = vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': no DICOM file with an image", source->name);
    if (!status)
        status = read_series(files, *images, files + lost, count - lost, source, out, err);
    for (size_t i = 0; files && i < count; i++)
        vol_dicom_free(&files[i]);
    free(files);
    for (size_t i = 0; i < count; i++)
        vol_bytes_free(&bytes[i]);
    return status;
}
