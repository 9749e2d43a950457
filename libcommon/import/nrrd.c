/* NRRD, attached or detached (.nhdr), raw, gzip, bzip2, hexadecimal or text (the format's definition: Kindlmann,
 * teem.sourceforge.net/nrrd).
 *
 * World space is the file's own (`space` is not converted).  `space directions` and `space origin` give the
 * affine; else `spacings` or `axis mins`/`axis maxs` (with `centers`).  An axis that is not spatial holds
 * components, or time steps where its kind says so or where it is the last of several. */
#include "import/nrrd.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

bool vol_is_nrrd(const VolBytes *bytes)
{
    return bytes->size >= 8 && (memcmp(bytes->data, "NRRD000", 7) == 0 || memcmp(bytes->data, "NRRD00.0", 8) == 0);
}

/* ---- Axes ---- */

/* The direction leads through time: its fourth number is larger than its part in space. */
static bool is_time_direction(const NrrdHeader *h, int a)
{
    const double *d = h->directions[a];
    return h->directions_count && h->has_direction[a] && fabs(d[3]) > vol_length(vol_vec3(d[0], d[1], d[2]));
}

static double entry(const NrrdReals *field, int a) { return field->count > a ? field->at[a] : NAN; }

/* Whether the file says how far apart the samples are. */
static bool has_extent(const NrrdHeader *h, int a)
{
    return isfinite(entry(&h->spacings, a)) || (isfinite(entry(&h->mins, a)) && isfinite(entry(&h->maxs, a)));
}

/* At most three are marked.  Where there are more to choose from, those with a spacing are in space if they are three;
 * else those that come first. */
static void find_space(const NrrdHeader *h, bool directions, bool spatial[NRRD_AXES])
{
    int candidates = 0, extents = 0, found = 0;
    for (int a = 0; a < h->axes; a++) {
        spatial[a] = directions ? h->has_direction[a] && !is_time_direction(h, a)
                                : h->kinds[a] == NRRD_SPATIAL || h->kinds[a] == NRRD_UNKNOWN;
        candidates += spatial[a] ? 1 : 0;
        extents += spatial[a] && has_extent(h, a) ? 1 : 0;
    }
    bool choose = !directions && candidates > 3 && extents == 3;
    for (int a = 0; a < h->axes; a++) {
        spatial[a] = spatial[a] && found < 3 && (!choose || has_extent(h, a));
        found += spatial[a] ? 1 : 0;
    }
}

/* Which axes are x, y, z (in the file's order), which holds components and which time; -1: none. */
static VolStatus sort_axes(const NrrdHeader *h, bool directions, int space[3], int *components, int *time,
                           VolError *err)
{
    bool spatial[NRRD_AXES];
    int found = 0;
    find_space(h, directions, spatial);
    space[0] = space[1] = space[2] = *components = *time = -1;
    for (int a = 0; a < h->axes; a++) {
        if (spatial[a]) {
            space[found++] = a;
            continue;
        }
        if (h->sizes[a] == 1) /* makes no difference */
            continue;
        bool is_time = h->kinds[a] == NRRD_TIME || is_time_direction(h, a) ||
                       (h->kinds[a] != NRRD_COMPONENTS && a == h->axes - 1);
        int *role = is_time && *time < 0 ? time : *components < 0 ? components : time;
        if (*role >= 0)
            return vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': NRRD axis %d is one too many", h->name, a);
        *role = a;
    }
    if (found == 0)
        return vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': no axis of the NRRD is spatial", h->name);
    return VOL_OK;
}

/* ---- World space ---- */

static void fill_axis(const NrrdHeader *h, int a, int i, VolAffine *out)
{
    double min = entry(&h->mins, a), max = entry(&h->maxs, a), step = entry(&h->spacings, a);
    double steps = (double)(h->node[a] ? h->sizes[a] - 1 : h->sizes[a]);
    bool point = h->sizes[a] == 1 && min == max;
    if (!isfinite(step))
        step = isfinite(min) && isfinite(max) && steps > 0 && !point ? (max - min) / steps : 1;
    out->m[i][i] = step;
    if (isfinite(min))
        out->m[3][i] = min + (h->node[a] || point ? 0 : 0.5 * step);
}

static void fill_affine(const NrrdHeader *h, bool directions, const int space[3], VolAffine *out)
{
    *out = (VolAffine){0};
    for (int i = 0; i < 3; i++)
        if (space[i] < 0) /* a picture: one voxel of unit thickness */
            out->m[i][i] = 1;
        else if (directions)
            memcpy(out->m[i], h->directions[space[i]], sizeof out->m[i]);
        else
            fill_axis(h, space[i], i, out);
    if (directions && space[2] < 0 && space[1] >= 0) { /* a picture anywhere in space */
        const double *u = out->m[0], *v = out->m[1];
        VolVec3 normal = vol_cross(vol_vec3(u[0], u[1], u[2]), vol_vec3(v[0], v[1], v[2]));
        double length = vol_length(normal);
        const double unit[3] = {normal.x / length, normal.y / length, normal.z / length};
        if (length > 0 && isfinite(length))
            memcpy(out->m[2], unit, sizeof unit);
    }
    if (h->origin.count)
        memcpy(out->m[3], h->origin.at, sizeof out->m[3]);
}

static bool is_text(const NrrdHeader *h) { return h->encoding == NRRD_TEXT; }

static VolStatus describe(const NrrdHeader *h, VolSampled *out, uint64_t *samples, VolError *err)
{
    int space[3], components, time;
    bool directions = false;
    for (int a = 0; a < h->axes; a++)
        directions = directions || h->has_direction[a];
    VolStatus status = sort_axes(h, directions, space, &components, &time, err);
    if (status)
        return status;
    int64_t stride[NRRD_AXES + 1] = {1};
    for (int a = 0; a < h->axes; a++)
        if (__builtin_mul_overflow(stride[a], h->sizes[a], &stride[a + 1]) || stride[a + 1] > INT64_MAX / 64)
            return vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': its sizes are too large", h->name);
    *samples = (uint64_t)stride[h->axes];
    for (int i = 0; i < 3; i++) {
        out->dims[i] = space[i] >= 0 ? h->sizes[space[i]] : 1;
        out->stride[i] = space[i] >= 0 ? stride[space[i]] : 0;
    }
    out->components = components >= 0 ? h->sizes[components] : 1;
    out->component_stride = components >= 0 ? stride[components] : 0;
    out->times = time >= 0 ? h->sizes[time] : 1;
    out->time_stride = time >= 0 ? stride[time] : 0;
    fill_affine(h, directions, space, &out->index_to_world);
    out->type = h->type;
    out->big_endian = is_text(h) ? vol_machine_is_big_endian() : h->big_endian;
    if (!h->endian_given && vol_sample_size(h->type) > 1 && !is_text(h))
        return vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': NRRD field 'endian' is missing", h->name);
    return VOL_OK;
}

/* ---- Samples ---- */

/* The data of one file (or what follows the header), and how they become samples. */
typedef struct SubInterval {
    const char *name;
    VolBytes bytes; /* owned */
    size_t at;      /* where the samples begin, or what is still to be decoded */
    int64_t skip;
    uint64_t samples;
} SubInterval;

static VolStatus skip_lines(const NrrdHeader *h, SubInterval *piece, VolError *err)
{
    for (int64_t i = 0; i < h->line_skip; i++) {
        const VolBytes *bytes = &piece->bytes;
        const unsigned char *newline =
            piece->at < bytes->size ? memchr(bytes->data + piece->at, '\n', bytes->size - piece->at) : NULL;
        if (!newline)
            return vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': truncated: fewer lines than line skip",
                            piece->name);
        piece->at = (size_t)(newline - bytes->data) + 1;
    }
    return VOL_OK;
}

/* Puts `data` in the place of the piece's bytes. */
static void replace(SubInterval *piece, VolBytes data)
{
    vol_bytes_free(&piece->bytes);
    piece->bytes = data;
    piece->at = 0;
}

static VolStatus unpack(const NrrdHeader *h, SubInterval *piece, VolError *err)
{
    VolBytes data = {0};
    const unsigned char *packed = piece->bytes.data + piece->at;
    size_t size = piece->bytes.size - piece->at;
    VolStatus status = h->encoding == NRRD_GZIP ? vol_gunzip(packed, size, piece->name, &data, err)
                                                : vol_bunzip2(packed, size, piece->name, &data, err);
    if (!status)
        replace(piece, data);
    return status;
}

/* Skips bytes of the unpacked data; a number below 0 counts from their end, -1 to end with the samples. */
static VolStatus skip_bytes(const NrrdHeader *h, SubInterval *piece, VolError *err)
{
    uint64_t left = piece->bytes.size - piece->at, wanted = piece->samples * vol_sample_size(h->type);
    if (piece->skip >= 0) {
        piece->at = (uint64_t)piece->skip < left ? piece->at + (size_t)piece->skip : piece->bytes.size;
        return VOL_OK;
    }
    if (is_text(h) || h->encoding == NRRD_HEX)
        return vol_fail(err, VOL_BAD_INPUT,
                        "cannot import '%s': NRRD field 'byte skip' counts from the end, which text does not have",
                        h->name);
    uint64_t behind = (uint64_t)(-(piece->skip + 1));
    if (wanted > left || behind > left - wanted)
        piece->at = piece->bytes.size; /* truncated: the next to look says so */
    else
        piece->at += (size_t)(left - wanted - behind);
    return VOL_OK;
}

static int hex_digit(unsigned char c)
{
    return c >= '0' && c <= '9' ? c - '0' : c >= 'a' && c <= 'f' ? c - 'a' + 10 : c >= 'A' && c <= 'F' ? c - 'A' + 10 : -1;
}

/* Two digits are a byte; white space may stand anywhere. */
static VolStatus decode_hex(const NrrdHeader *h, SubInterval *piece, VolError *err)
{
    uint64_t wanted = piece->samples * vol_sample_size(h->type), digits = 0;
    const unsigned char *c = piece->bytes.data + piece->at, *end = piece->bytes.data + piece->bytes.size;
    if (wanted > (uint64_t)(end - c) / 2)
        return vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': truncated: fewer hexadecimal digits than its sizes say",
                        piece->name);
    unsigned char *out = vol_alloc_zero((size_t)wanted, 1);
    if (!out)
        return vol_fail_memory(err, (size_t)wanted);
    for (; c < end && digits < 2 * wanted; c++) {
        int digit = hex_digit(*c);
        if (digit < 0 && *c && strchr(" \t\r\n\v\f", *c))
            continue;
        if (digit < 0)
            break;
        out[digits / 2] = (unsigned char)(out[digits / 2] << 4 | digit);
        digits++;
    }
    if (digits < 2 * wanted) {
        free(out);
        return vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': %s after %llu hexadecimal digits of %llu", piece->name,
                        c < end ? "no digit" : "truncated", (unsigned long long)digits, (unsigned long long)wanted * 2);
    }
    replace(piece, (VolBytes){out, (size_t)wanted});
    return VOL_OK;
}

static VolStatus decode_text(const NrrdHeader *h, SubInterval *piece, VolError *err)
{
    VolBytes values = {0};
    VolStatus status = vol_scan_samples(piece->bytes.data + piece->at, piece->bytes.size - piece->at, h->type,
                                        piece->samples, piece->name, &values, err);
    if (!status)
        replace(piece, values);
    return status;
}

/* Lines are skipped before unpacking, bytes after it, as teem does; then the samples begin at `at`. */
static VolStatus decode(const NrrdHeader *h, SubInterval *piece, VolError *err)
{
    VolStatus status = skip_lines(h, piece, err);
    if (!status && piece->at > piece->bytes.size)
        piece->at = piece->bytes.size;
    if (!status && (h->encoding == NRRD_GZIP || h->encoding == NRRD_BZIP2))
        status = unpack(h, piece, err);
    if (!status)
        status = skip_bytes(h, piece, err);
    if (!status && h->encoding == NRRD_HEX)
        status = decode_hex(h, piece, err);
    if (!status && is_text(h))
        status = decode_text(h, piece, err);
    return status;
}

/* ---- Files ---- */

static VolStatus read_piece(const NrrdHeader *h, const VolSource *source, size_t i, SubInterval *piece, VolError *err)
{
    const NrrdFiles *files = &h->files;
    char *made = NULL;
    VolStatus status = VOL_OK;
    if (files->pattern)
        status = vol_fill_slice_number(files->pattern, files->first + (int64_t)i * files->step, &made, err);
    if (status)
        return vol_fail_within(err, VOL_BAD_INPUT, "cannot import '%s'", h->name);
    piece->name = made ? made : files->names[i];
    piece->skip = files->skips ? files->skips[i] : h->byte_skip;
    status = vol_read_beside(source, piece->name, &piece->bytes, err);
    if (!status)
        status = decode(h, piece, err);
    uint64_t wanted = piece->samples * vol_sample_size(h->type), have = piece->bytes.size - piece->at;
    if (!status && files->several && have < wanted)
        status = vol_fail(err, VOL_BAD_INPUT,
                          "cannot import '%s': truncated: its part of '%s' is %llu bytes, there are %llu", piece->name,
                          h->name, (unsigned long long)wanted, (unsigned long long)have);
    free(made);
    piece->name = NULL;
    return status;
}

/* The files are so many as there are parts of so many axes; where nothing says how many, they are equal slabs. */
static VolStatus check_files(const NrrdHeader *h, VolError *err)
{
    const NrrdFiles *files = &h->files;
    int axes = files->axes;
    int64_t parts = 1;
    if (axes > h->axes)
        return vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': NRRD data files of %d axes, but it has %d", h->name,
                        axes, h->axes);
    for (int a = axes; axes && a < h->axes; a++)
        parts *= h->sizes[a]; /* known to fit */
    int64_t last = h->sizes[h->axes - 1];
    bool good = axes && axes < h->axes ? files->count == (uint64_t)parts
                                       : files->count <= (uint64_t)last && (uint64_t)last % files->count == 0;
    return good ? VOL_OK
                : vol_fail(err, VOL_BAD_INPUT,
                           "cannot import '%s': size does not match: its NRRD names %zu data files, %lld are wanted",
                           h->name, files->count, (long long)(axes && axes < h->axes ? parts : last));
}

/* Files of equal parts, one after the other. */
static VolStatus read_pieces(const NrrdHeader *h, const VolSource *source, uint64_t samples, VolSampled *out,
                             VolError *err)
{
    VolStatus status = check_files(h, err);
    size_t capacity = 0;
    for (size_t i = 0; !status && i < h->files.count; i++) {
        SubInterval piece = {.samples = samples / h->files.count};
        status = read_piece(h, source, i, &piece, err);
        if (!status)
            status = vol_append_unpacked(&out->bytes, &capacity, piece.bytes.data + piece.at,
                                         (size_t)piece.samples * vol_sample_size(h->type), source->name, err);
        vol_bytes_free(&piece.bytes);
    }
    return status;
}

static VolStatus find_samples(const NrrdHeader *h, const VolSource *source, size_t at, uint64_t samples,
                              VolSampled *out, VolError *err)
{
    if (h->files.several)
        return read_pieces(h, source, samples, out, err);
    VolStatus status;
    SubInterval piece = {.samples = samples};
    if (h->files.count) {
        status = read_piece(h, source, 0, &piece, err);
    } else {
        piece = (SubInterval){source->name, *source->bytes, at, h->byte_skip, samples};
        *source->bytes = (VolBytes){0};
        status = decode(h, &piece, err);
    }
    out->bytes = piece.bytes;
    out->offset = piece.at;
    return status;
}

VolStatus vol_read_nrrd(const VolSource *source, VolSampled *out, VolError *err)
{
    NrrdHeader h = {.name = source->name};
    size_t at = 0;
    uint64_t samples = 0;
    *out = (VolSampled){0};
    VolStatus status = vol_nrrd_parse(&h, source->bytes, &at, err);
    if (!status)
        status = describe(&h, out, &samples, err);
    if (!status)
        status = find_samples(&h, source, at, samples, out, err);
    if (!status)
        status = vol_sampled_check(out, source->name, false, err);
    vol_nrrd_header_free(&h);
    return status;
}
