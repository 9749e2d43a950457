/* MetaImage (.mha, and .mhd with its data apart): "Key = Value" lines, ElementDataFile the last.
 *
 * World space is the file's own (ITK writes left-posterior-superior).  Row i of TransformMatrix is the direction
 * of index axis i; ElementSpacing its step; Offset the place of voxel (0, 0, 0). */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "import/readers.h"

typedef struct Header {
    const char *name;
    int axes;
    double sizes[4], spacing[4], size[4], offset[4], matrix[16];
    bool sizes_given, spacing_given, size_given, offset_given, matrix_given, type_given;
    VolSample type;
    bool text, big_endian, compressed;
    double channels, header_size;
    char *data_file;
} Header;

/* Among the first lines the keys that every MetaImage has; they may stand in any order. */
bool vol_is_metaimage(const VolBytes *bytes)
{
    const char *const firsts[] = {"ObjectType", "NDims", "Comment", "ObjectSubType", "TransformType"};
    bool first = false;
    for (size_t i = 0; i < sizeof firsts / sizeof *firsts; i++)
        first =
            first || (bytes->size > strlen(firsts[i]) && memcmp(bytes->data, firsts[i], strlen(firsts[i])) == 0);
    if (!first)
        return false;
    const char key[] = "ElementDataFile";
    for (size_t at = 0; at + sizeof key < bytes->size && at < 1 << 16; at++)
        if (memcmp(bytes->data + at, key, sizeof key - 1) == 0)
            return true;
    return false;
}

static const char *const spellings[VOL_SAMPLE_F64 + 1] = {
    [VOL_SAMPLE_U8] = "MET_UCHAR",           [VOL_SAMPLE_I8] = "MET_CHAR|MET_ASCII_CHAR",
    [VOL_SAMPLE_U16] = "MET_USHORT",         [VOL_SAMPLE_I16] = "MET_SHORT",
    [VOL_SAMPLE_U32] = "MET_UINT|MET_ULONG", [VOL_SAMPLE_I32] = "MET_INT|MET_LONG",
    [VOL_SAMPLE_U64] = "MET_ULONG_LONG",     [VOL_SAMPLE_I64] = "MET_LONG_LONG",
    [VOL_SAMPLE_F32] = "MET_FLOAT",          [VOL_SAMPLE_F64] = "MET_DOUBLE",
};

static bool truth(const char *value) { return value[0] == 'T' || value[0] == 't' || value[0] == '1'; }

static VolStatus parse_key(Header *h, const char *key, const char *value, VolError *err)
{
    bool good = true;
    double axes;
    if (strcmp(key, "NDims") == 0) {
        good = vol_scan_reals(value, &axes, 1) == 1 && (axes == 2 || axes == 3 || axes == 4);
        h->axes = good ? (int)axes : 0;
    } else if (strcmp(key, "DimSize") == 0) {
        good = h->sizes_given = vol_scan_reals(value, h->sizes, 4) == h->axes;
    } else if (strcmp(key, "ElementSpacing") == 0) {
        good = h->spacing_given = vol_scan_reals(value, h->spacing, 4) == h->axes;
    } else if (strcmp(key, "ElementSize") == 0) {
        good = h->size_given = vol_scan_reals(value, h->size, 4) == h->axes;
    } else if (vol_one_of(key, "Offset|Position|Origin")) {
        good = h->offset_given = vol_scan_reals(value, h->offset, 4) == h->axes;
    } else if (vol_one_of(key, "TransformMatrix|Rotation|Orientation")) {
        good = h->matrix_given = vol_scan_reals(value, h->matrix, 16) == h->axes * h->axes;
    } else if (strcmp(key, "ElementType") == 0) {
        good = h->type_given = vol_sample_spelt(value, spellings, &h->type);
    } else if (strcmp(key, "ElementNumberOfChannels") == 0) {
        good = vol_scan_reals(value, &h->channels, 1) == 1 && h->channels >= 1 && h->channels <= 65536;
    } else if (strcmp(key, "HeaderSize") == 0) {
        good = vol_scan_reals(value, &h->header_size, 1) == 1 && h->header_size >= -1 && h->header_size < 1e15;
    } else if (strcmp(key, "BinaryData") == 0) {
        h->text = !truth(value);
    } else if (vol_one_of(key, "BinaryDataByteOrderMSB|ElementByteOrderMSB")) {
        h->big_endian = truth(value);
    } else if (strcmp(key, "CompressedData") == 0) {
        h->compressed = truth(value);
    } else if (strcmp(key, "ElementDataFile") == 0) {
        free(h->data_file);
        h->data_file = vol_copy_text(value);
        return h->data_file ? VOL_OK : vol_fail_memory(err, strlen(value));
    }
    if (!good)
        return vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': MetaImage key '%s = %s' is not understood",
                        h->name, key, value);
    return VOL_OK;
}

/* *at ends behind the line of ElementDataFile, where LOCAL data begin. */
static VolStatus parse_header(Header *h, const VolBytes *bytes, size_t *at, VolError *err)
{
    VolStatus status = VOL_OK;
    while (!status && !h->data_file) {
        char *line;
        status = vol_next_line(bytes, at, &line, err);
        if (status || !line)
            break;
        char *equals = strchr(line, '=');
        if (equals) {
            *equals = 0;
            status = parse_key(h, vol_trim(line), vol_trim(equals + 1), err);
        }
        free(line);
    }
    if (status)
        return status;
    const char *missing = !h->axes ? "NDims" : !h->sizes_given ? "DimSize" : !h->type_given ? "ElementType"
                          : !h->data_file ? "ElementDataFile" : NULL;
    if (missing)
        return vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': MetaImage key '%s' is missing", h->name, missing);
    for (int a = 0; a < h->axes; a++)
        if (!(h->sizes[a] >= 1 && h->sizes[a] <= INT32_MAX && h->sizes[a] == floor(h->sizes[a])))
            return vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': size %g is impossible", h->name, h->sizes[a]);
    return VOL_OK;
}

static void describe(const Header *h, VolSampled *out)
{
    const double *step = h->spacing_given ? h->spacing : h->size_given ? h->size : NULL;
    for (int a = 0; a < 3; a++) {
        bool there = a < h->axes;
        double length = there && step ? vol_step_or_one(step[a], &out->spacing_made[a]) : 1;
        out->dims[a] = there ? (int64_t)h->sizes[a] : 1;
        for (int to = 0; to < 3; to++) {
            double direction = there && to < h->axes && h->matrix_given ? h->matrix[a * h->axes + to] : a == to;
            out->index_to_world.m[a][to] = direction * length;
        }
        out->index_to_world.m[3][a] = there && h->offset_given ? h->offset[a] : 0;
    }
    out->times = h->axes > 3 ? (int64_t)h->sizes[3] : 1;
    out->components = (int64_t)h->channels;
    out->type = h->type;
    out->big_endian = h->big_endian;
    vol_sampled_order(out);
}

/* "LIST [2]" (names follow in the header) or "slice%03d.raw 1 93 1": one slice per file. */
static VolStatus read_many(const Header *h, const VolSource *source, size_t at, VolSampled *out, VolError *err)
{
    size_t count = (size_t)out->dims[2], have = 0;
    uint64_t slice = (uint64_t)out->dims[0] * (uint64_t)out->dims[1], share;
    if (h->axes > 3 || h->compressed || h->text ||
        __builtin_mul_overflow(slice, (uint64_t)out->components * vol_sample_size(out->type), &share))
        return vol_fail(err, VOL_BAD_INPUT,
                        "cannot import '%s': a MetaImage in several files is read only as raw slices",
                        source->name);
    if (count > 1 << 20)
        return vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': %zu slices are too many files", source->name,
                        count);
    char **names = vol_alloc_zero(count, sizeof *names);
    VolStatus status = names ? VOL_OK : vol_fail_memory(err, count * sizeof *names);
    size_t word = strcspn(h->data_file, " \t");
    double range[3] = {1, 0, 1};
    if (!status && memchr(h->data_file, '%', word)) {
        char *pattern = vol_format_text("%.*s", (int)word, h->data_file);
        if (!pattern || vol_scan_reals(h->data_file + word, range, 3) < 0)
            status = vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': data file '%s' is not understood",
                              source->name, h->data_file);
        for (; !status && have < count; have += !status)
            status =
                vol_fill_slice_number(pattern, (int64_t)(range[0] + (double)have * range[2]), &names[have], err);
        if (status == VOL_USAGE)
            status = vol_fail_within(err, VOL_BAD_INPUT, "cannot import '%s'", source->name);
        free(pattern);
    } else {
        char *line = NULL;
        while (!status && have < count && !(status = vol_next_line(source->bytes, &at, &line, err)) && line) {
            if (*vol_trim(line) && !(names[have++] = vol_copy_text(vol_trim(line))))
                status = vol_fail_memory(err, strlen(line));
            free(line);
        }
    }
    if (!status && have < count)
        status = vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': %zu slices, but %zu files", source->name, count,
                          have);
    if (!status)
        status = vol_read_slices(source, (const char *const *)names, count, (size_t)share, (int64_t)h->header_size,
                                 true, &out->bytes, err);
    for (size_t i = 0; names && i < count; i++)
        free(names[i]);
    free(names);
    return status;
}

static VolStatus read_samples(const Header *h, const VolSource *source, size_t at, VolSampled *out, VolError *err)
{
    bool local = strcmp(h->data_file, "LOCAL") == 0 || strcmp(h->data_file, "Local") == 0;
    VolBytes bytes = {0};
    VolStatus status = VOL_OK;
    if (local) {
        bytes = *source->bytes;
        *source->bytes = (VolBytes){0};
    } else {
        status = vol_read_beside(source, h->data_file, &bytes, err);
        at = h->header_size > 0 ? (size_t)h->header_size : 0;
    }
    if (!status && h->compressed) {
        at = at > bytes.size ? bytes.size : at;
        status = vol_gunzip(bytes.data + at, bytes.size - at, source->name, &out->bytes, err);
        vol_bytes_free(&bytes);
        at = 0;
    } else {
        out->bytes = bytes;
    }
    if (status)
        return status;
    out->offset = at;
    if (h->header_size < 0 && !local) { /* the samples are what the file ends with */
        uint64_t wanted = (uint64_t)out->time_stride * (uint64_t)out->times * vol_sample_size(out->type);
        out->offset = wanted < out->bytes.size ? out->bytes.size - (size_t)wanted : 0;
    }
    return h->text ? vol_sampled_from_text(out, source->name, err) : VOL_OK;
}

VolStatus vol_read_metaimage(const VolSource *source, VolSampled *out, VolError *err)
{
    Header h = {.name = source->name, .channels = 1};
    size_t at = 0;
    *out = (VolSampled){0};
    VolStatus status = parse_header(&h, source->bytes, &at, err);
    if (!status) {
        describe(&h, out);
        bool many = strncmp(h.data_file, "LIST", 4) == 0 || strpbrk(h.data_file, "%");
        status = many ? read_many(&h, source, at, out, err) : read_samples(&h, source, at, out, err);
    }
    if (!status)
        status = vol_sampled_check(out, source->name, false, err);
    free(h.data_file);
    return status;
}
