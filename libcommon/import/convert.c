/* From samples to voxels. */
#include <inttypes.h>
#include <math.h>
#include <stdlib.h>

#include "base/memory.h"
#include "import/import.h"

/* What loses nothing: a float holds every integer up to 2^24 in magnitude, a double up to 2^53. */
static VolVdbStore store_of(const VolSampled *image)
{
    if (image->float_holds)
        return VOL_STORE_FLOAT;
    switch (image->type) {
    case VOL_SAMPLE_U8:
    case VOL_SAMPLE_I8:
    case VOL_SAMPLE_U16:
    case VOL_SAMPLE_I16:
    case VOL_SAMPLE_F32:
        return VOL_STORE_FLOAT;
    case VOL_SAMPLE_I32:
        return image->scaled ? VOL_STORE_DOUBLE : VOL_STORE_INT32;
    default:
        return VOL_STORE_DOUBLE;
    }
}

static double sample_at(const unsigned char *p, VolSample type, bool big, uint64_t *inexact)
{
    const double exact = 9007199254740992.0;
    double value = 0;
    switch (type) {
    case VOL_SAMPLE_U8: return *p;
    case VOL_SAMPLE_I8: return (int8_t)*p;
    case VOL_SAMPLE_U16: return vol_get_u16(p, big);
    case VOL_SAMPLE_I16: return (int16_t)vol_get_u16(p, big);
    case VOL_SAMPLE_U32: return vol_get_u32(p, big);
    case VOL_SAMPLE_I32: return (int32_t)vol_get_u32(p, big);
    case VOL_SAMPLE_F32: return (double)vol_get_f32(p, big);
    case VOL_SAMPLE_F64: return vol_get_f64(p, big);
    case VOL_SAMPLE_U64: value = (double)vol_get_u64(p, big); break;
    case VOL_SAMPLE_I64: value = (double)(int64_t)vol_get_u64(p, big); break;
    }
    *inexact += fabs(value) > exact ? 1 : 0;
    return value;
}

/* One line of voxels along x; `component` -1: the Euclidean length of all components. */
static void convert_row(const VolSampled *image, const unsigned char *p, int64_t component, double *row,
                        uint64_t *inexact)
{
    int64_t size = (int64_t)vol_sample_size(image->type);
    double slope = image->scaled ? image->slope : 1, intercept = image->scaled ? image->intercept : 0;
    for (int64_t i = 0; i < image->dims[0]; i++, p += size * image->stride[0]) {
        double value;
        if (component >= 0) {
            value = sample_at(p + size * image->component_stride * component, image->type, image->big_endian,
                              inexact);
            value = image->scaled ? slope * value + intercept : value;
        } else {
            double sum = 0;
            for (int64_t c = 0; c < image->components; c++) {
                value =
                    sample_at(p + size * image->component_stride * c, image->type, image->big_endian, inexact);
                value = image->scaled ? slope * value + intercept : value;
                sum += value * value;
            }
            value = sqrt(sum);
        }
        row[i] = value;
    }
}

static VolStatus pick(const VolSampled *image, const char *name, const VolImportOptions *options,
                      int64_t *component, VolError *err)
{
    *component = options->component;
    if (*component == VOL_COMPONENT_DEFAULT)
        *component = image->components == 1 ? 0 : VOL_COMPONENT_MAGNITUDE;
    if (*component >= image->components)
        return vol_fail(err, VOL_BAD_INPUT,
                        "cannot import '%s': there is no component %" PRId64 ": there %s %" PRId64 ", from 0",
                        name, *component, image->components == 1 ? "is" : "are", image->components);
    if (options->time_step < 0 || options->time_step >= image->times)
        return vol_fail(err, VOL_BAD_INPUT,
                        "cannot import '%s': there is no time step %" PRId64 ": there %s %" PRId64 ", from 0",
                        name, options->time_step, image->times == 1 ? "is" : "are", image->times);
    return VOL_OK;
}

double vol_step_or_one(double step, bool *made)
{
    *made = !isfinite(step) || step == 0;
    return *made ? 1 : step;
}

static VolVec3 unit(VolVec3 v) { return vol_scale(v, 1 / vol_length(v)); }

/* The direction of index axis a, which the file does not give: perpendicular to the axes that it gives, and as near
 * to world axis a as that allows. */
static VolVec3 missing_direction(const VolVec3 axis[3], const bool missing[3], int a)
{
    int b = (a + 1) % 3, c = (a + 2) % 3;
    const VolVec3 worlds[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    if (missing[b] && missing[c])
        return worlds[a];
    if (!missing[b] && !missing[c]) {
        VolVec3 normal = vol_cross(unit(axis[b]), unit(axis[c]));
        if (!(vol_length(normal) > 0))
            return worlds[a]; /* the others are parallel: nothing helps */
        return unit(vol_dot(normal, worlds[a]) < 0 ? vol_scale(normal, -1) : normal);
    }
    int given = missing[b] ? c : b;
    VolVec3 along = unit(axis[given]);
    VolVec3 across = vol_along(worlds[a], -vol_dot(worlds[a], along), along);
    if (vol_length(across) < 0.5) /* the given axis took its place: change places */
        across = vol_along(worlds[given], -vol_dot(worlds[given], along), along);
    return unit(across);
}

/* Every axis gets a length: --spacing's, the file's, or 1 where neither gives any. */
static void place_axes(const VolSampled *image, const VolImportOptions *options, VolAffine *out, bool made[3])
{
    const double spacing[3] = {options->spacing.x, options->spacing.y, options->spacing.z};
    VolVec3 axis[3];
    bool missing[3];
    for (int a = 0; a < 3; a++) {
        axis[a] = vol_vec3(out->m[a][0], out->m[a][1], out->m[a][2]);
        double length = vol_length(axis[a]);
        missing[a] = !(length > 0 && isfinite(length));
        made[a] = !options->spacing_given && (missing[a] ? !(image->lengths[a] > 0) : image->spacing_made[a]);
    }
    for (int a = 0; a < 3; a++) {
        bool replaced = missing[a];
        if (missing[a])
            axis[a] = missing_direction(axis, missing, a);
        missing[a] = false;
        if (!replaced && !options->spacing_given)
            continue;
        double length = vol_length(axis[a]);
        double wanted = options->spacing_given ? spacing[a] : image->lengths[a] > 0 ? image->lengths[a] : 1;
        const double direction[3] = {axis[a].x / length, axis[a].y / length, axis[a].z / length};
        for (int c = 0; c < 3; c++)
            out->m[a][c] = direction[c] * wanted;
    }
}

/* --spacing sets the lengths of the index axes and keeps their directions; --origin places voxel (0, 0, 0). */
static VolStatus place(const VolSampled *image, const char *name, const VolImportOptions *options,
                       VolImported *imported, VolError *err)
{
    VolAffine *out = &imported->index_to_world, inverse;
    *out = image->index_to_world;
    place_axes(image, options, out, imported->spacing_made);
    if (options->origin_given) {
        out->m[3][0] = options->origin.x;
        out->m[3][1] = options->origin.y;
        out->m[3][2] = options->origin.z;
    }
    for (int c = 0; c < 3; c++)
        if (!isfinite(out->m[3][c]))
            return vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': its origin along %c is %g (give --origin)",
                            name, "xyz"[c], out->m[3][c]);
    if (!vol_affine_invert(out, &inverse))
        return vol_fail(err, VOL_BAD_INPUT,
                        "cannot import '%s': its orientation cannot be inverted: the axes are x (%g %g %g), "
                        "y (%g %g %g), z (%g %g %g)",
                        name, out->m[0][0], out->m[0][1], out->m[0][2], out->m[1][0], out->m[1][1], out->m[1][2],
                        out->m[2][0], out->m[2][1], out->m[2][2]);
    return VOL_OK;
}

static void convert_voxels(const VolSampled *image, int64_t component, int64_t time, double *row, VolImported *out)
{
    size_t size = vol_sample_size(image->type), n = (size_t)image->dims[0], at = 0;
    for (int64_t k = 0; k < image->dims[2]; k++)
        for (int64_t j = 0; j < image->dims[1]; j++, at += n) {
            int64_t first = time * image->time_stride + k * image->stride[2] + j * image->stride[1];
            const unsigned char *p = image->bytes.data + image->offset + (size_t)first * size;
            convert_row(image, p, component, row, &out->inexact);
            for (size_t i = 0; i < n; i++) {
                if (!isfinite(row[i]))
                    out->non_finite++;
                else
                    out->largest = fmax(out->largest, fabs(row[i]));
                if (out->single)
                    out->single[at + i] = (float)row[i];
                else
                    out->twice[at + i] = row[i];
            }
        }
}

/* Converted samples beside those of the file, then the tree beside the converted ones. */
static VolStatus foresee(const VolSampled *image, const char *name, VolVdbStore store, VolError *err)
{
    double voxels = (double)image->dims[0] * (double)image->dims[1] * (double)image->dims[2];
    double bytes = voxels * (store == VOL_STORE_FLOAT ? 4 : 8), tree = voxels * (store == VOL_STORE_DOUBLE ? 8 : 4);
    bytes += fmax(0, tree - (double)image->bytes.size);
    VolStatus status = bytes > VOL_WORTH_A_CHECK ? vol_check_memory(bytes, err) : VOL_OK;
    return status ? vol_fail_within(err, status, "cannot import '%s'", name) : VOL_OK;
}

VolStatus vol_import_convert(VolSampled *image, const char *name, const VolImportOptions *options,
                             VolImported *out, VolError *err)
{
    *out = (VolImported){0};
    int64_t component;
    VolStatus status = pick(image, name, options, &component, err);
    if (!status)
        status = place(image, name, options, out, err);
    if (status)
        return status;

    out->store = store_of(image);
    if (component == VOL_COMPONENT_MAGNITUDE && out->store == VOL_STORE_INT32)
        out->store = VOL_STORE_DOUBLE;
    status = foresee(image, name, out->store, err);
    if (status)
        return status;
    size_t voxels = (size_t)image->dims[0] * (size_t)image->dims[1] * (size_t)image->dims[2];
    double *row = vol_alloc((size_t)image->dims[0], sizeof *row);
    for (int a = 0; a < 3; a++)
        out->dims[a] = (int32_t)image->dims[a];
    if (out->store == VOL_STORE_FLOAT)
        out->single = vol_alloc(voxels, sizeof *out->single);
    else
        out->twice = vol_alloc(voxels, sizeof *out->twice);
    if (!row || (!out->single && !out->twice)) {
        free(row);
        vol_imported_free(out);
        return vol_fail_memory(err, voxels * sizeof(double));
    }
    convert_voxels(image, component, options->time_step, row, out);
    free(row);
    vol_sampled_free(image);
    return VOL_OK;
}

void vol_imported_free(VolImported *imported)
{
    free(imported->single);
    free(imported->twice);
    imported->single = NULL;
    imported->twice = NULL;
}

VolStatus vol_import_write(const VolImported *imported, const char *grid_name, const VolVdbMetaList *grid_meta,
                           VolVdbWriter *writer, VolError *err)
{
    const int32_t origin[3] = {0, 0, 0};
    VolVdbNewGrid grid = {.name = grid_name, .store = imported->store, .index_to_world = imported->index_to_world};
    VolStatus status = vol_meta_copy(&grid.meta, grid_meta, err);
    if (!status)
        status = vol_vdb_begin_grid(writer, &grid, err);
    vol_meta_free(&grid.meta);
    if (!status && imported->single)
        status = vol_vdb_put_dense(writer, origin, imported->dims, imported->single, err);
    else if (!status)
        status = vol_vdb_put_dense_double(writer, origin, imported->dims, imported->twice, err);
    if (!status)
        status = vol_vdb_end_grid(writer, err);
    return status;
}
