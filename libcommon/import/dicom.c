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

#include "import/dicom.h"

bool vol_is_dicom(const VolBytes *bytes)
{
    return bytes->size >= 132 && memcmp(bytes->data + 128, "DICM", 4) == 0;
}

typedef struct Series {
    DicomSlice *slices; /* of the chosen series, sorted */
    size_t count;
} Series;

static VolStatus same_shape(const DicomSlice *a, const DicomSlice *b, VolError *err)
{
    bool same = a->rows == b->rows && a->columns == b->columns && a->bits_allocated == b->bits_allocated &&
                a->is_signed == b->is_signed && a->frames == b->frames;
    for (int i = 0; same && i < 6; i++)
        same = fabs(a->orientation[i] - b->orientation[i]) < 1e-4;
    for (int i = 0; same && i < 2; i++)
        same = fabs(a->spacing[i] - b->spacing[i]) <= 1e-4 * fabs(a->spacing[i]);
    if (!same)
        return vol_fail(err, VOL_BAD_INPUT,
                        "cannot import '%s': its size, type, spacing or orientation is not that of '%s'", b->name,
                        a->name);
    return VOL_OK;
}

/* The series: the one that --array names (by UID, number or description), or the only one. */
static VolStatus choose_series(DicomSlice *slices, size_t *count, const char *wanted, const char *name,
                               VolError *err)
{
    const DicomSlice *chosen = NULL;
    char list[512] = "";
    size_t used = 0, series = 0;
    for (size_t i = 0; i < *count; i++) {
        const DicomSlice *s = &slices[i];
        bool seen = false;
        for (size_t k = 0; k < i && !seen; k++)
            seen = strcmp(slices[k].series, s->series) == 0;
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
    char uid[sizeof slices->series];
    memcpy(uid, chosen ? chosen->series : slices->series, sizeof uid);
    size_t kept = 0;
    for (size_t i = 0; i < *count; i++)
        if (strcmp(slices[i].series, uid) == 0)
            slices[kept++] = slices[i];
    *count = kept;
    return VOL_OK;
}

static VolVec3 row_of(const DicomSlice *s)
{
    return vol_vec3(s->orientation[0], s->orientation[1], s->orientation[2]);
}
static VolVec3 column_of(const DicomSlice *s)
{
    return vol_vec3(s->orientation[3], s->orientation[4], s->orientation[5]);
}
static VolVec3 place_of(const DicomSlice *s) { return vol_vec3(s->position[0], s->position[1], s->position[2]); }

static int by_depth(const void *a, const void *b)
{
    const DicomSlice *s = a, *t = b;
    if (s->depth != t->depth)
        return s->depth < t->depth ? -1 : 1;
    return s->instance < t->instance ? -1 : s->instance > t->instance ? 1 : strcmp(s->name, t->name);
}

/* Along the normal where all slices have positions, else by their numbers. */
static VolStatus sort_slices(DicomSlice *slices, size_t count, bool *placed, VolError *err)
{
    *placed = true;
    VolStatus status = VOL_OK;
    for (size_t i = 0; i < count; i++) {
        *placed = *placed && slices[i].has_position;
        status = status ? status : same_shape(&slices[0], &slices[i], err);
    }
    VolVec3 normal = vol_cross(row_of(&slices[0]), column_of(&slices[0]));
    for (size_t i = 0; i < count; i++)
        slices[i].depth = *placed ? vol_dot(place_of(&slices[i]), normal) : (double)slices[i].instance;
    qsort(slices, count, sizeof *slices, by_depth);
    for (size_t i = 1; !status && i < count; i++)
        if (slices[i].depth == slices[i - 1].depth)
            status = vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': it has the same place as '%s'",
                              slices[i].name, slices[i - 1].name);
    return status;
}

static void fill_affine(const DicomSlice *slices, size_t count, bool placed, const VolLog *log, VolAffine *out)
{
    const DicomSlice *first = &slices[0], *last = &slices[count - 1];
    VolVec3 i = vol_scale(row_of(first), first->spacing[1]), j = vol_scale(column_of(first), first->spacing[0]);
    VolVec3 normal = vol_cross(row_of(first), column_of(first));
    double gap = first->between > 0 ? first->between : first->thickness > 0 ? first->thickness : 0;
    VolVec3 k = vol_scale(normal, gap), place = first->has_position ? place_of(first) : vol_vec3(0, 0, 0);
    if (placed && count > 1) {
        k = vol_scale(vol_sub(place_of(last), place_of(first)), 1.0 / (double)(count - 1));
        double step = vol_length(k), worst = 0;
        for (size_t n = 1; n < count; n++)
            worst = fmax(worst, vol_length(vol_sub(place_of(&slices[n]), vol_along(place, (double)n, k))));
        if (worst > 0.01 * step)
            vol_warn(log,
                     "DICOM series '%s': slices are not evenly spaced (up to %.3g of a step off); taken as even",
                     first->series, worst / step);
    }
    const VolVec3 rows[4] = {i, j, k, place};
    for (int a = 0; a < 4; a++) {
        out->m[a][0] = rows[a].x;
        out->m[a][1] = rows[a].y;
        out->m[a][2] = rows[a].z;
    }
}

/* One stored sample: BitsStored bits that end at HighBit, signed or not (PS3.5 8.1.1). */
static double stored_value(const DicomSlice *s, uint64_t n)
{
    const unsigned char *p = s->pixels + n * (size_t)(s->bits_allocated / 8);
    uint32_t raw = s->bits_allocated == 8    ? *p
                   : s->bits_allocated == 16 ? vol_get_u16(p, s->big_endian)
                                             : vol_get_u32(p, s->big_endian);
    raw = raw >> (s->high_bit + 1 - s->bits_stored);
    if (s->bits_stored == 32)
        return s->is_signed ? (double)(int32_t)raw : (double)raw;
    uint32_t span = UINT32_C(1) << s->bits_stored;
    raw &= span - 1;
    return s->is_signed && raw >= span / 2 ? (double)raw - (double)span : (double)raw;
}

/* Values are rescaled slice by slice, since slope and intercept may differ between slices (PET). */
static VolStatus join_slices(const DicomSlice *slices, size_t count, const char *name, VolSampled *out,
                             VolError *err)
{
    const DicomSlice *first = &slices[0];
    *out = (VolSampled){.type = VOL_SAMPLE_F64, .components = 1, .times = 1};
    out->dims[0] = first->columns;
    out->dims[1] = first->rows;
    out->dims[2] = (int64_t)(count * first->frames);
    out->float_holds = first->bits_stored <= 16;
    vol_sampled_order(out);

    size_t per_slice = (size_t)first->columns * first->rows * first->frames;
    double *values = vol_alloc(count, per_slice * sizeof *values);
    if (!values)
        return vol_fail_memory(err, count * per_slice * sizeof *values);
    for (size_t i = 0; i < count; i++)
        for (size_t n = 0; n < per_slice; n++)
            values[i * per_slice + n] = slices[i].slope * stored_value(&slices[i], n) + slices[i].intercept;
    const uint16_t one = 1;
    out->big_endian = *(const unsigned char *)&one == 0;
    out->bytes = (VolBytes){(unsigned char *)values, count * per_slice * sizeof *values};
    return vol_sampled_check(out, name, true, err);
}

VolStatus vol_read_dicom(VolBytes *bytes, const char *const *names, size_t count, const VolSource *source,
                         VolSampled *out, VolError *err)
{
    *out = (VolSampled){0};
    DicomSlice *slices = vol_alloc_zero(count, sizeof *slices);
    VolStatus status = slices ? VOL_OK : vol_fail_memory(err, count * sizeof *slices);
    size_t images = 0;
    for (size_t i = 0; !status && i < count; i++) {
        status = vol_dicom_parse(&bytes[i], names[i], &slices[images], err);
        images += slices[images].rows > 0 ? 1 : 0; /* reports and directories have no pixels: passed over */
    }
    if (!status && images == 0)
        status = vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': no DICOM file with an image", source->name);
    if (!status)
        status = choose_series(slices, &images, source->options->array, source->name, err);
    bool placed = false;
    if (!status)
        status = sort_slices(slices, images, &placed, err);
    if (!status && images > 1 && slices[0].frames > 1)
        status =
            vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': several files of several frames each", source->name);
    if (!status)
        status = join_slices(slices, images, source->name, out, err);
    if (!status)
        fill_affine(slices, images, placed, source->log, &out->index_to_world);
    free(slices);
    for (size_t i = 0; i < count; i++)
        vol_bytes_free(&bytes[i]);
    return status;
}
