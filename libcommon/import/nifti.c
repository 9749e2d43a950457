/* NIfTI-1 and NIfTI-2, single file (.nii; compressed files are unpacked before).
 *
 * World space is the file's own: millimetres (or what xyzt_units says), right-anterior-superior.  The sform is
 * used where there is one (it may shear), else the qform, else the spacing alone: methods 3, 2, 1 of the format.
 * Values: scl_slope v + scl_inter, unless the slope is 0. */
#include <inttypes.h>
#include <math.h>
#include <string.h>

#include "import/readers.h"

/* Where the fields lie in the two headers. */
typedef struct Layout {
    int version;
    size_t header, dim, datatype, bitpix, pixdim, vox_offset, slope, intercept, qform, sform, quatern, qoffset,
        srow;
} Layout;

static const Layout nifti1 = {1, 348, 40, 70, 72, 76, 108, 112, 116, 252, 254, 256, 268, 280};
static const Layout nifti2 = {2, 540, 16, 12, 14, 104, 168, 176, 184, 344, 348, 352, 376, 400};

typedef struct Header {
    const unsigned char *p;
    bool big;
    const Layout *at;
} Header;

static double real_at(const Header *h, size_t offset, int i)
{
    return h->at->version == 1 ? (double)vol_get_f32(h->p + offset + 4 * (size_t)i, h->big)
                               : vol_get_f64(h->p + offset + 8 * (size_t)i, h->big);
}

static int64_t dim_at(const Header *h, int i)
{
    return h->at->version == 1 ? (int16_t)vol_get_u16(h->p + h->at->dim + 2 * (size_t)i, h->big)
                               : (int64_t)vol_get_u64(h->p + h->at->dim + 8 * (size_t)i, h->big);
}

static int64_t code_at(const Header *h, size_t offset)
{
    return h->at->version == 1 ? (int16_t)vol_get_u16(h->p + offset, h->big)
                               : (int32_t)vol_get_u32(h->p + offset, h->big);
}

/* NULL where the bytes are no NIfTI header.  The first word is the header's own size, in the file's byte order. */
static const Layout *find_layout(const VolBytes *bytes, bool *big)
{
    const Layout *const layouts[] = {&nifti1, &nifti2};
    for (int l = 0; l < 2; l++)
        for (int b = 0; b < 2; b++) {
            if (bytes->size < 4 || vol_get_u32(bytes->data, b) != layouts[l]->header)
                continue;
            const char *magic = (const char *)bytes->data + (l == 0 ? 344 : 4);
            bool long_enough = bytes->size >= (l == 0 ? 348u : 8u);
            if (long_enough && magic[0] == 'n' && (magic[1] == '+' || magic[1] == 'i') && magic[2] == '1' + l)
                return *big = b, layouts[l];
        }
    return NULL;
}

bool vol_is_nifti(const VolBytes *bytes)
{
    bool big;
    return find_layout(bytes, &big) != NULL;
}

static VolStatus read_type(const Header *h, const char *name, VolSampled *out, VolError *err)
{
    static const struct {
        int64_t code;
        VolSample type;
        int components;
    } types[] = {
        {2, VOL_SAMPLE_U8, 1},      {4, VOL_SAMPLE_I16, 1},    {8, VOL_SAMPLE_I32, 1},    {16, VOL_SAMPLE_F32, 1},
        {64, VOL_SAMPLE_F64, 1},    {128, VOL_SAMPLE_U8, 3},   {256, VOL_SAMPLE_I8, 1},   {512, VOL_SAMPLE_U16, 1},
        {768, VOL_SAMPLE_U32, 1},   {1024, VOL_SAMPLE_I64, 1}, {1280, VOL_SAMPLE_U64, 1}, {2304, VOL_SAMPLE_U8, 4},
        {32, VOL_SAMPLE_F32, 2},    {1792, VOL_SAMPLE_F64, 2}, /* complex */
    };
    int64_t code = (int16_t)vol_get_u16(h->p + h->at->datatype, h->big);
    for (size_t i = 0; i < sizeof types / sizeof *types; i++)
        if (types[i].code == code) {
            out->type = types[i].type;
            out->components = types[i].components;
            return VOL_OK;
        }
    return vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': NIfTI data type %" PRId64 " is not known", name,
                    code);
}

/* dim[0] counts the axes: x y z, time, then components.  An axis of 0 is taken as 1, as others do. */
static VolStatus read_dims(const Header *h, const char *name, VolSampled *out, VolError *err)
{
    int64_t axes = dim_at(h, 0), n[8] = {0, 1, 1, 1, 1, 1, 1, 1};
    if (axes < 1 || axes > 7)
        return vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': %" PRId64 " dimensions are impossible", name,
                        axes);
    for (int i = 1; i <= (int)axes; i++) {
        n[i] = dim_at(h, i) == 0 && i > 3 ? 1 : dim_at(h, i);
        if (n[i] < 1 || n[i] > INT32_MAX)
            return vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': dimension %d is %" PRId64, name, i, n[i]);
    }
    for (int a = 0; a < 3; a++)
        out->dims[a] = n[a + 1];
    out->times = n[4];
    vol_sampled_order(out);

    int64_t apart = 1; /* components on axes of their own: slowest */
    for (int i = 5; i <= 7; i++)
        if (__builtin_mul_overflow(apart, n[i], &apart) || apart > INT32_MAX)
            return vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': its sizes are too large", name);
    if (apart > 1 && out->components > 1)
        return vol_fail(err, VOL_BAD_INPUT,
                        "cannot import '%s': colours or complex numbers on more than four axes are not known", name);
    if (apart > 1) {
        out->components = apart;
        if (__builtin_mul_overflow(out->time_stride, out->times, &out->component_stride))
            return vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': its sizes are too large", name);
    }
    return VOL_OK;
}

/* The rotation of a unit quaternion a + b i + c j + d k, a >= 0 left out; pixdim[0] = -1 mirrors the third axis.
 */
static void affine_of_qform(const Header *h, VolAffine *out, bool made[3])
{
    double b = real_at(h, h->at->quatern, 0), c = real_at(h, h->at->quatern, 1), d = real_at(h, h->at->quatern, 2);
    double rest = 1 - (b * b + c * c + d * d), a = 0;
    if (rest > 1e-7) {
        a = sqrt(rest);
    } else {
        double length = sqrt(b * b + c * c + d * d);
        b /= length, c /= length, d /= length;
    }
    const double r[3][3] = {
        {a * a + b * b - c * c - d * d, 2 * (b * c - a * d), 2 * (b * d + a * c)},
        {2 * (b * c + a * d), a * a + c * c - b * b - d * d, 2 * (c * d - a * b)},
        {2 * (b * d - a * c), 2 * (c * d + a * b), a * a + d * d - b * b - c * c},
    };
    double mirror = real_at(h, h->at->pixdim, 0) < 0 ? -1 : 1;
    for (int axis = 0; axis < 3; axis++) {
        double step = vol_step_or_one(fabs(real_at(h, h->at->pixdim, axis + 1)), &made[axis]);
        for (int to = 0; to < 3; to++)
            out->m[axis][to] = r[to][axis] * step * (axis == 2 ? mirror : 1);
    }
    for (int to = 0; to < 3; to++)
        out->m[3][to] = real_at(h, h->at->qoffset, to);
}

static bool can_invert(const VolAffine *affine)
{
    VolAffine directions = *affine, inverse;
    memset(directions.m[3], 0, sizeof directions.m[3]);
    return vol_affine_invert(&directions, &inverse);
}

/* pixdim's, 0 where it gives none. */
static double length_at(const Header *h, int axis)
{
    bool made;
    double length = vol_step_or_one(fabs(real_at(h, h->at->pixdim, axis + 1)), &made);
    return made ? 0 : length;
}

/* An sform with no qform beside it.  Columns of zeros, or of what is no number, have a length all the same; where the
 * others are of no use either, the spacing alone is left. */
static void mend_sform(const Header *h, const VolSource *source, VolSampled *out)
{
    VolAffine *affine = &out->index_to_world, filled = *affine;
    int zeros = 0;
    for (int a = 0; a < 3; a++) {
        double *l = affine->m[a];
        const double *m = affine->m[(a + 1) % 3], *n = affine->m[(a + 2) % 3];
        bool finite = isfinite(l[0]) && isfinite(l[1]) && isfinite(l[2]);
        if (finite && (l[0] != 0 || l[1] != 0 || l[2] != 0))
            continue;
        memset(l, 0, sizeof affine->m[a]);
        VolVec3 across = vol_cross(vol_vec3(m[0], m[1], m[2]), vol_vec3(n[0], n[1], n[2]));
        filled.m[a][0] = across.x, filled.m[a][1] = across.y, filled.m[a][2] = across.z;
        out->lengths[a] = length_at(h, a);
        zeros++;
    }
    bool holds = zeros == 2 || (zeros == 1 && can_invert(&filled)); /* what is missing is put across the others */
    for (int a = 0; !holds && a < 3; a++) {
        memset(affine->m[a], 0, sizeof affine->m[a]);
        affine->m[a][a] = vol_step_or_one(length_at(h, a), &out->spacing_made[a]);
    }
    vol_warn(source->log, "'%s': the sform cannot be inverted; %s", source->name,
             holds ? "the axes that it leaves out are put across the others" : "the spacing alone is taken");
}

static VolStatus read_affine(const Header *h, const VolSource *source, VolSampled *out, VolError *err)
{
    VolAffine *affine = &out->index_to_world;
    bool sform = code_at(h, h->at->sform) > 0, qform = code_at(h, h->at->qform) > 0;
    for (int to = 0; to < 3; to++)
        for (int axis = 0; axis < 4; axis++)
            affine->m[axis][to] = real_at(h, h->at->srow, 4 * to + axis);
    if (sform && can_invert(affine))
        return VOL_OK;
    if (sform && !qform) {
        mend_sform(h, source, out);
        return VOL_OK;
    }
    *affine = (VolAffine){0};
    if (qform) {
        for (int i = 0; i < 3; i++)
            if (!isfinite(real_at(h, h->at->quatern, i)))
                return vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': the quaternion of its qform is not finite",
                                source->name);
        if (sform)
            vol_warn(source->log, "'%s': the sform cannot be inverted; the qform is taken", source->name);
        affine_of_qform(h, affine, out->spacing_made);
        return VOL_OK;
    }
    for (int axis = 0; axis < 3; axis++)
        affine->m[axis][axis] = vol_step_or_one(length_at(h, axis), &out->spacing_made[axis]);
    return VOL_OK;
}

static VolStatus read_offset(const Header *h, const char *name, size_t *out, VolError *err)
{
    double offset = h->at->version == 1 ? (double)vol_get_f32(h->p + h->at->vox_offset, h->big)
                                        : (double)(int64_t)vol_get_u64(h->p + h->at->vox_offset, h->big);
    if (offset == 0)
        offset = h->at->version == 1 ? 352 : 544;
    if (!(offset >= (double)h->at->header && offset < 4503599627370496.0))
        return vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': the data begin at byte %g, inside the header",
                        name, offset);
    *out = (size_t)offset;
    return VOL_OK;
}

VolStatus vol_read_nifti(const VolSource *source, VolSampled *out, VolError *err)
{
    Header h = {.p = source->bytes->data};
    h.at = find_layout(source->bytes, &h.big);
    if (source->bytes->size < h.at->header)
        return vol_fail(err, VOL_BAD_INPUT,
                        "cannot import '%s': truncated: the header is %zu bytes, there are %zu", source->name,
                        h.at->header, source->bytes->size);
    if (h.p[h.at->version == 1 ? 345 : 5] == 'i')
        return vol_fail(err, VOL_BAD_INPUT,
                        "cannot import '%s': NIfTI in two files (.hdr and .img) is not read; convert it to .nii",
                        source->name);
    *out = (VolSampled){.big_endian = h.big};
    VolStatus status = read_type(&h, source->name, out, err);
    if (!status)
        status = read_dims(&h, source->name, out, err);
    if (!status)
        status = read_offset(&h, source->name, &out->offset, err);
    if (!status)
        status = read_affine(&h, source, out, err);
    if (status)
        return status;
    double slope = real_at(&h, h.at->slope, 0), intercept = real_at(&h, h.at->intercept, 0);
    out->scaled = isfinite(slope) && isfinite(intercept) && slope != 0 && (slope != 1 || intercept != 0);
    out->slope = slope;
    out->intercept = intercept;
    out->bytes = *source->bytes;
    *source->bytes = (VolBytes){0};
    return vol_sampled_check(out, source->name, false, err);
}
