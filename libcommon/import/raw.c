/* Samples without a header, described by options, and Inviwo's .dat, a description beside raw samples. */
#include <inttypes.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "import/readers.h"

/* The one file of an image, if it is packed.  Sizes too large are vol_sampled_check's to refuse. */
static VolStatus unpack(VolSampled *out, const char *name, VolError *err)
{
    uint64_t wanted = vol_sample_size(out->type) * (uint64_t)out->components;
    bool fits = true;
    for (int a = 0; a < 3; a++)
        fits = fits && !__builtin_mul_overflow(wanted, (uint64_t)out->dims[a], &wanted);
    fits = fits && !__builtin_add_overflow(wanted, out->offset, &wanted);
    return fits ? vol_unpack_samples(&out->bytes, wanted, name, err) : VOL_OK;
}

/* One file holds all samples and nothing else; several hold one slice each. */
VolStatus vol_read_raw(const VolSource *source, const char *const *names, size_t count, VolSampled *out,
                       VolError *err)
{
    const VolImportOptions *options = source->options;
    *out = (VolSampled){.type = options->type, .big_endian = options->big_endian, .components = 1, .times = 1};
    for (int a = 0; a < 3; a++) {
        out->dims[a] = options->dims[a];
        out->index_to_world.m[a][a] = 1;
    }
    if (out->dims[2] == 0)
        out->dims[2] = (int64_t)count;
    if (count > 1 && out->dims[2] != (int64_t)count)
        return vol_fail(err, VOL_USAGE, "option --dims: %" PRId64 " slices, but %zu files", out->dims[2], count);
    vol_sampled_order(out);

    VolStatus status = VOL_OK;
    if (count > 1) {
        uint64_t share;
        if (__builtin_mul_overflow((uint64_t)out->dims[0], (uint64_t)out->dims[1], &share) ||
            __builtin_mul_overflow(share, vol_sample_size(out->type), &share))
            return vol_fail(err, VOL_USAGE, "option --dims: the sizes are too large");
        status = vol_read_slices(source, names, count, (size_t)share, options->header, false, &out->bytes, err);
    } else {
        status = source->files->read(source->files->user, names[0], &out->bytes, err);
        out->offset = (size_t)options->header;
        if (!status)
            status = unpack(out, source->name, err);
    }
    return status ? status : vol_sampled_check(out, source->name, true, err);
}

/* ---- Inviwo .dat ---- */

typedef struct Dat {
    const char *name;
    char *raw_file;
    double resolution[3], spacing[3], basis[9], offset[3], byte_offset;
    bool resolution_given, spacing_given, basis_given[3], offset_given, type_given, big_endian;
    VolSample type;
    int64_t components;
} Dat;

/* The word before the first colon of a line, lower case; false: the line has none. */
static bool split_colon(char *line, char **key, char **value)
{
    char *colon = strchr(line, ':');
    if (!colon)
        return false;
    *colon = 0;
    *key = vol_trim(line);
    *value = vol_trim(colon + 1);
    for (char *c = *key; *c; c++)
        if (*c >= 'A' && *c <= 'Z')
            *c = (char)(*c - 'A' + 'a');
    return true;
}

bool vol_is_inviwo_dat(const VolBytes *bytes)
{
    bool file = false, resolution = false, format = false;
    VolBytes head = *bytes;
    if (head.size > 1 << 16 || memchr(head.data, 0, head.size))
        return false;
    size_t at = 0;
    char *line;
    while (!vol_next_line(&head, &at, &line, NULL) && line) {
        char *key, *value;
        if (split_colon(line, &key, &value)) {
            file = file || vol_one_of(key, "objectfilename|rawfile");
            resolution = resolution || strcmp(key, "resolution") == 0;
            format = format || strcmp(key, "format") == 0;
        }
        free(line);
    }
    return file && resolution && format;
}

/* Types as Voreen (UCHAR) and as Inviwo (Vec3UINT8) write them. */
static const char *const spellings[VOL_SAMPLE_F64 + 1] = {
    [VOL_SAMPLE_U8] = "UCHAR|UINT8",    [VOL_SAMPLE_I8] = "CHAR|INT8",      [VOL_SAMPLE_U16] = "USHORT|UINT16",
    [VOL_SAMPLE_I16] = "SHORT|INT16",   [VOL_SAMPLE_U32] = "UINT|UINT32",   [VOL_SAMPLE_I32] = "INT|INT32",
    [VOL_SAMPLE_U64] = "UINT64",        [VOL_SAMPLE_I64] = "INT64",         [VOL_SAMPLE_F32] = "FLOAT|FLOAT32",
    [VOL_SAMPLE_F64] = "DOUBLE|FLOAT64",
};

static bool parse_format(const char *text, VolSample *type, int64_t *components)
{
    *components = 1;
    if (strncmp(text, "Vec", 3) == 0 && text[3] >= '2' && text[3] <= '4') {
        *components = text[3] - '0';
        text += 4;
    }
    return vol_sample_spelt(text, spellings, type);
}

static VolStatus parse_dat_line(Dat *dat, const char *key, const char *value, VolError *err)
{
    bool good = true;
    if (vol_one_of(key, "objectfilename|rawfile")) {
        free(dat->raw_file);
        dat->raw_file = vol_copy_text(value);
        return dat->raw_file ? VOL_OK : vol_fail_memory(err, strlen(value));
    } else if (strcmp(key, "resolution") == 0) {
        good = dat->resolution_given = vol_scan_reals(value, dat->resolution, 3) == 3;
    } else if (strcmp(key, "format") == 0) {
        good = dat->type_given = parse_format(value, &dat->type, &dat->components);
    } else if (vol_one_of(key, "slicethickness|spacing")) {
        good = dat->spacing_given = vol_scan_reals(value, dat->spacing, 3) == 3;
    } else if (strncmp(key, "basisvector", 11) == 0 && key[11] >= '1' && key[11] <= '3' && !key[12]) {
        int i = key[11] - '1';
        good = dat->basis_given[i] = vol_scan_reals(value, dat->basis + 3 * i, 3) == 3;
    } else if (strcmp(key, "offset") == 0) {
        good = dat->offset_given = vol_scan_reals(value, dat->offset, 3) == 3;
    } else if (strcmp(key, "byteoffset") == 0) {
        good =
            vol_scan_reals(value, &dat->byte_offset, 1) == 1 && dat->byte_offset >= 0 && dat->byte_offset < 1e15;
    } else if (strcmp(key, "byteorder") == 0) {
        dat->big_endian = strcmp(value, "BigEndian") == 0;
    }
    if (!good)
        return vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': '%s: %s' is not understood", dat->name, key,
                        value);
    return VOL_OK;
}

/* Basis vectors span the volume with its half voxels at the faces; then Offset is the corner of the first voxel.
 * Spacing alone counts from voxel (0, 0, 0). */
static void dat_affine(const Dat *dat, VolAffine *out)
{
    *out = (VolAffine){0};
    bool basis = dat->basis_given[0] && dat->basis_given[1] && dat->basis_given[2];
    for (int a = 0; a < 3; a++)
        for (int to = 0; to < 3; to++)
            out->m[a][to] = basis ? dat->basis[3 * a + to] / dat->resolution[a]
                            : a == to ? (dat->spacing_given ? dat->spacing[a] : 1) : 0;
    for (int to = 0; to < 3; to++) {
        out->m[3][to] = dat->offset_given ? dat->offset[to] : 0;
        for (int a = 0; basis && dat->offset_given && a < 3; a++)
            out->m[3][to] += 0.5 * out->m[a][to];
    }
}

static VolStatus parse_dat(Dat *dat, const VolBytes *bytes, VolError *err)
{
    VolStatus status = VOL_OK;
    size_t at = 0;
    char *line, *key, *value;
    while (!status && !(status = vol_next_line(bytes, &at, &line, err)) && line) {
        if (*vol_trim(line) != '#' && split_colon(line, &key, &value))
            status = parse_dat_line(dat, key, value, err);
        free(line);
    }
    if (!status && !(dat->raw_file && dat->resolution_given && dat->type_given))
        status = vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': file name, resolution or format is missing",
                          dat->name);
    for (int a = 0; !status && a < 3; a++)
        if (!(dat->resolution[a] >= 1 && dat->resolution[a] <= INT32_MAX &&
              dat->resolution[a] == floor(dat->resolution[a])))
            status = vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': size %g is impossible", dat->name,
                              dat->resolution[a]);
    return status;
}

VolStatus vol_read_inviwo_dat(const VolSource *source, VolSampled *out, VolError *err)
{
    Dat dat = {.name = source->name};
    *out = (VolSampled){.times = 1};
    VolStatus status = parse_dat(&dat, source->bytes, err);
    if (!status) {
        for (int a = 0; a < 3; a++)
            out->dims[a] = (int64_t)dat.resolution[a];
        out->type = dat.type;
        out->components = dat.components;
        out->big_endian = dat.big_endian;
        out->offset = (size_t)dat.byte_offset;
        vol_sampled_order(out);
        dat_affine(&dat, &out->index_to_world);
        status = vol_read_beside(source, dat.raw_file, &out->bytes, err);
    }
    if (!status)
        status = unpack(out, dat.raw_file, err);
    if (!status)
        status = vol_sampled_check(out, dat.raw_file, true, err);
    free(dat.raw_file);
    return status;
}
