/* NRRD, attached or detached (.nhdr), raw, gzip or text (the format's definition: Kindlmann,
 * teem.sourceforge.net/nrrd).
 *
 * World space is the file's own (`space` is not converted).  `space directions` and `space origin` give the
 * affine; else `spacings` or `axis mins`/`axis maxs` (with `centers`).  An axis that is not spatial holds
 * components, or time steps where its kind says so or where it is the last of several. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "import/readers.h"

enum { AXES = 8 };

typedef enum AxisKind { KIND_UNKNOWN, KIND_SPACE, KIND_COMPONENTS, KIND_TIME } AxisKind;

typedef struct Header {
    const char *name;
    int axes, space_dims;
    int64_t sizes[AXES];
    AxisKind kinds[AXES];
    bool cell[AXES];
    double spacings[AXES], mins[AXES], maxs[AXES];
    double directions[AXES][3];
    bool has_direction[AXES], directions_given;
    double origin[3];
    bool origin_given, type_given, sizes_given, endian_given, big_endian;
    VolSample type;
    char encoding[16];
    int64_t line_skip, byte_skip;
    char *data_file;     /* NULL: attached */
    char **list;         /* LIST: the names */
    size_t list_count;
    uint64_t samples;    /* of all axes; wrapped around if too many, which vol_sampled_check finds */
} Header;

bool vol_is_nrrd(const VolBytes *bytes) { return bytes->size >= 8 && memcmp(bytes->data, "NRRD000", 7) == 0; }

static VolStatus bad_field(const Header *h, const char *field, const char *value, VolError *err)
{
    return vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': NRRD field '%s: %s' is not understood", h->name,
                    field, value);
}

static const char *const spellings[VOL_SAMPLE_F64 + 1] = {
    [VOL_SAMPLE_U8] = "uchar|unsigned char|uint8|uint8_t",
    [VOL_SAMPLE_I8] = "signed char|int8|int8_t",
    [VOL_SAMPLE_U16] = "ushort|unsigned short|unsigned short int|uint16|uint16_t",
    [VOL_SAMPLE_I16] = "short|short int|signed short|signed short int|int16|int16_t",
    [VOL_SAMPLE_U32] = "uint|unsigned int|uint32|uint32_t",
    [VOL_SAMPLE_I32] = "int|signed int|int32|int32_t",
    [VOL_SAMPLE_U64] = "ulonglong|unsigned long long|unsigned long long int|uint64|uint64_t",
    [VOL_SAMPLE_I64] = "longlong|long long|long long int|signed long long|signed long long int|int64|int64_t",
    [VOL_SAMPLE_F32] = "float",
    [VOL_SAMPLE_F64] = "double",
};

static AxisKind kind_of(const char *word)
{
    if (vol_one_of(word, "domain|space"))
        return KIND_SPACE;
    if (strcmp(word, "time") == 0)
        return KIND_TIME;
    return vol_one_of(word, "???|none") ? KIND_UNKNOWN : KIND_COMPONENTS;
}

/* Calls `one` for every word; false if it refuses one or there are more than AXES. */
static bool each_word(Header *h, char *text, bool (*one)(Header *h, int axis, const char *word))
{
    for (int axis = 0;; axis++) {
        char *word = text + strspn(text, " \t");
        if (!*word)
            return axis > 0;
        text = word + strcspn(word, " \t");
        if (*text)
            *text++ = 0;
        if (axis == AXES || !one(h, axis, word))
            return false;
    }
}

/* A whole number of at least `least`. */
static bool one_whole(int64_t *out, const char *word, int64_t least)
{
    char *end;
    *out = strtoll(word, &end, 10);
    return end != word && !*end && *out >= least;
}

static bool one_size(Header *h, int axis, const char *word) { return one_whole(&h->sizes[axis], word, 1); }

static bool one_kind(Header *h, int axis, const char *word) { return h->kinds[axis] = kind_of(word), true; }
static bool one_center(Header *h, int axis, const char *word)
{
    h->cell[axis] = strcmp(word, "cell") == 0;
    return true;
}

static bool one_real(double *out, const char *word)
{
    char *end;
    *out = strtod(word, &end);
    return end != word && !*end;
}

static bool one_spacing(Header *h, int axis, const char *word) { return one_real(&h->spacings[axis], word); }
static bool one_min(Header *h, int axis, const char *word) { return one_real(&h->mins[axis], word); }
static bool one_max(Header *h, int axis, const char *word) { return one_real(&h->maxs[axis], word); }

/* "(1,0,0) none (0,1,0.5)": vectors may hold spaces. */
static bool parse_directions(Header *h, const char *text)
{
    for (int axis = 0;; axis++) {
        text += strspn(text, " \t");
        if (!*text)
            return axis > 0;
        if (axis == AXES)
            return false;
        if (strncmp(text, "none", 4) == 0) {
            text += 4;
            continue;
        }
        const char *close = strchr(text, ')');
        char vector[256];
        if (*text != '(' || !close || (size_t)(close - text) >= sizeof vector)
            return false;
        memcpy(vector, text, (size_t)(close - text));
        vector[close - text] = 0;
        if (vol_scan_reals(vector, h->directions[axis], 3) < 1)
            return false;
        h->has_direction[axis] = true;
        text = close + 1;
    }
}

/* Adds a name to the list; takes it over.  NULL: out of memory. */
static VolStatus add_to_list(Header *h, char *name, VolError *err)
{
    char **longer = name ? vol_resize(h->list, h->list_count + 1, sizeof *h->list) : NULL;
    if (!longer) {
        free(name);
        return vol_fail_memory(err, (h->list_count + 1) * sizeof *h->list);
    }
    h->list = longer;
    h->list[h->list_count++] = name;
    return VOL_OK;
}

/* "LIST": the names follow, one per line, to the end. */
static VolStatus parse_name_list(Header *h, const VolBytes *bytes, size_t *at, VolError *err)
{
    for (;;) {
        char *line;
        VolStatus status = vol_next_line(bytes, at, &line, err);
        if (status || !line)
            return status;
        const char *name = vol_trim(line);
        if (*name)
            status = add_to_list(h, vol_copy_text(name), err);
        free(line);
        if (status)
            return status;
    }
}

/* "slice%03d.raw 1 93 1": a pattern with the first and last number and the step. */
static VolStatus parse_name_pattern(Header *h, const char *pattern, const double *range, VolError *err)
{
    double steps = (range[1] - range[0]) / range[2];
    if (!(steps >= 0 && steps < 1e6 && fabs(range[0]) < 1e9))
        return bad_field(h, "data file", pattern, err);
    for (int i = 0; i <= (int)steps; i++) {
        char *name = NULL;
        VolStatus status = vol_fill_slice_number(pattern, (int64_t)(range[0] + i * range[2]), &name, err);
        if (status)
            return vol_fail_within(err, VOL_BAD_INPUT, "cannot import '%s'", h->name);
        status = add_to_list(h, name, err);
        if (status)
            return status;
    }
    return VOL_OK;
}

/* The three forms of `data file`: "LIST", a pattern with numbers, a name. */
static VolStatus parse_data_file(Header *h, char *value, const VolBytes *bytes, size_t *at, VolError *err)
{
    if (strncmp(value, "LIST", 4) == 0 && (value[4] == 0 || value[4] == ' '))
        return parse_name_list(h, bytes, at, err);
    size_t word = strcspn(value, " \t");
    double range[4];
    if (memchr(value, '%', word) && vol_scan_reals(value + word, range, 4) >= 3) {
        value[word] = 0;
        return parse_name_pattern(h, value, range, err);
    }
    free(h->data_file);
    h->data_file = vol_copy_text(value);
    return h->data_file ? VOL_OK : vol_fail_memory(err, strlen(value));
}

static VolStatus parse_field(Header *h, const char *field, char *value, const VolBytes *bytes, size_t *at,
                             VolError *err)
{
    bool good = true;
    if (strcmp(field, "type") == 0) {
        good = h->type_given = vol_sample_spelt(value, spellings, &h->type);
    } else if (strcmp(field, "dimension") == 0) {
        int64_t axes;
        good = one_whole(&axes, value, 1) && axes <= AXES;
        h->axes = good ? (int)axes : 0;
    } else if (strcmp(field, "sizes") == 0) {
        good = h->sizes_given = each_word(h, value, one_size);
    } else if (strcmp(field, "kinds") == 0) {
        good = each_word(h, value, one_kind);
    } else if (vol_one_of(field, "centers|centerings")) {
        good = each_word(h, value, one_center);
    } else if (strcmp(field, "spacings") == 0) {
        good = each_word(h, value, one_spacing);
    } else if (vol_one_of(field, "axis mins|axismins")) {
        good = each_word(h, value, one_min);
    } else if (vol_one_of(field, "axis maxs|axismaxs")) {
        good = each_word(h, value, one_max);
    } else if (strcmp(field, "space directions") == 0) {
        good = h->directions_given = parse_directions(h, value);
    } else if (strcmp(field, "space origin") == 0) {
        good = h->origin_given = vol_scan_reals(value, h->origin, 3) >= 1;
    } else if (strcmp(field, "endian") == 0) {
        h->endian_given = good = strcmp(value, "big") == 0 || strcmp(value, "little") == 0;
        h->big_endian = value[0] == 'b';
    } else if (strcmp(field, "encoding") == 0) {
        snprintf(h->encoding, sizeof h->encoding, "%s", value);
    } else if (vol_one_of(field, "line skip|lineskip")) {
        good = one_whole(&h->line_skip, value, 0);
    } else if (vol_one_of(field, "byte skip|byteskip")) {
        good = one_whole(&h->byte_skip, value, -1);
    } else if (vol_one_of(field, "data file|datafile")) {
        return parse_data_file(h, value, bytes, at, err);
    }
    return good ? VOL_OK : bad_field(h, field, value, err);
}

/* Fields to the empty line (attached) or the end (detached).  `key:=value` pairs and comments say nothing to us.
 */
static VolStatus parse_header(Header *h, const VolBytes *bytes, size_t *at, VolError *err)
{
    VolStatus status = VOL_OK;
    for (int n = 0; !status; n++) {
        char *line;
        status = vol_next_line(bytes, at, &line, err);
        if (status || !line || !*line) {
            free(line);
            break;
        }
        char *colon = strstr(line, ": ");
        if (n > 0 && *line != '#' && !strstr(line, ":=") && colon) {
            *colon = 0;
            status = parse_field(h, vol_trim(line), vol_trim(colon + 2), bytes, at, err);
        }
        free(line);
    }
    if (status)
        return status;
    if (!h->type_given || !h->axes || !h->sizes_given || !h->encoding[0])
        return vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': NRRD field '%s' is missing or not known", h->name,
                        !h->type_given ? "type" : !h->axes ? "dimension" : !h->sizes_given ? "sizes" : "encoding");
    for (int a = 0; a < h->axes; a++)
        if (h->sizes[a] < 1)
            return vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': NRRD has fewer sizes than dimensions",
                            h->name);
    return VOL_OK;
}

/* Which axes are x, y, z (in the file's order), which holds components and which time; -1: none. */
static VolStatus sort_axes(const Header *h, int space[3], int *components, int *time, VolError *err)
{
    int spatial = 0, others = 0, other[AXES];
    space[0] = space[1] = space[2] = -1;
    *components = *time = -1;
    for (int a = 0; a < h->axes; a++) {
        bool is_space = h->directions_given ? h->has_direction[a]
                        : h->axes <= 3      ? h->kinds[a] == KIND_SPACE || h->kinds[a] == KIND_UNKNOWN
                                       : h->kinds[a] == KIND_SPACE || (h->kinds[a] == KIND_UNKNOWN && spatial < 3);
        if (is_space && spatial < 3)
            space[spatial++] = a;
        else
            other[others++] = a;
    }
    for (int i = 0; i < others; i++) {
        int a = other[i];
        bool is_time = h->kinds[a] == KIND_TIME || (h->kinds[a] != KIND_COMPONENTS && a == h->axes - 1);
        int *role = is_time && *time < 0 ? time : *components < 0 ? components : time;
        if (*role >= 0)
            return vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': NRRD axis %d is one too many", h->name, a);
        *role = a;
    }
    if (spatial == 0)
        return vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': no axis of the NRRD is spatial", h->name);
    return VOL_OK;
}

static void fill_affine(const Header *h, const int space[3], VolAffine *out)
{
    *out = (VolAffine){0};
    for (int i = 0; i < 3; i++) {
        int a = space[i];
        if (a < 0) { /* a picture: one voxel of unit thickness */
            out->m[i][i] = 1;
        } else if (h->directions_given) {
            memcpy(out->m[i], h->directions[a], sizeof out->m[i]);
        } else {
            double steps = (double)(h->cell[a] ? h->sizes[a] : h->sizes[a] - 1);
            bool bounded = isfinite(h->mins[a]) && isfinite(h->maxs[a]) && steps > 0;
            double step = isfinite(h->spacings[a]) ? h->spacings[a]
                          : bounded                ? (h->maxs[a] - h->mins[a]) / steps
                                                   : 1;
            out->m[i][i] = step;
            if (isfinite(h->mins[a]))
                out->m[3][i] = h->mins[a] + (h->cell[a] ? 0.5 * step : 0);
        }
    }
    if (h->origin_given)
        memcpy(out->m[3], h->origin, sizeof h->origin);
}

static VolStatus skip_lines(const Header *h, const VolBytes *bytes, size_t *at, VolError *err)
{
    for (int64_t i = 0; i < h->line_skip; i++) {
        const unsigned char *newline =
            *at < bytes->size ? memchr(bytes->data + *at, '\n', bytes->size - *at) : NULL;
        if (!newline)
            return vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': truncated: fewer lines than line skip",
                            h->name);
        *at = (size_t)(newline - bytes->data) + 1;
    }
    return VOL_OK;
}

static bool is_text(const Header *h)
{
    return vol_one_of(h->encoding, "ascii|text|txt");
}

/* Unpacks, skips and leaves the samples in `out->bytes` from `out->offset`. */
static VolStatus find_samples(const Header *h, VolBytes *bytes, size_t at, VolSampled *out, VolError *err)
{
    VolStatus status = skip_lines(h, bytes, &at, err);
    if (status)
        return status;
    bool gzip = vol_one_of(h->encoding, "gzip|gz");
    if (!is_text(h) && !gzip && strcmp(h->encoding, "raw") != 0)
        return vol_fail(err, VOL_BAD_INPUT,
                        "cannot import '%s': NRRD encoding '%s' is not read (raw, gzip, ascii are)", h->name,
                        h->encoding);
    if (gzip) {
        status = vol_gunzip(bytes->data + at, bytes->size - at, h->name, &out->bytes, err);
        at = 0;
    } else {
        out->bytes = *bytes;
        *bytes = (VolBytes){0};
    }
    if (status)
        return status;
    if (h->byte_skip >= 0) {
        out->offset = at + (size_t)h->byte_skip;
    } else { /* -1: the samples are what the file ends with */
        uint64_t wanted = h->samples * vol_sample_size(out->type);
        out->offset = wanted < out->bytes.size ? out->bytes.size - (size_t)wanted : 0;
    }
    return is_text(h) ? vol_sampled_from_text(out, h->name, err) : VOL_OK;
}

static VolStatus find_detached(const Header *h, const VolSource *source, VolSampled *out, VolError *err)
{
    VolBytes bytes = {0};
    VolStatus status = VOL_OK;
    if (!h->list) {
        status = vol_read_beside(source, h->data_file, &bytes, err);
        if (!status)
            status = find_samples(h, &bytes, 0, out, err);
    } else {
        uint64_t total = (uint64_t)vol_sample_size(out->type);
        for (int a = 0; a < h->axes; a++)
            if (__builtin_mul_overflow(total, (uint64_t)h->sizes[a], &total))
                return vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': its sizes are too large", h->name);
        if (strcmp(h->encoding, "raw") != 0 || h->line_skip || h->list_count == 0 || total % h->list_count)
            return vol_fail(err, VOL_BAD_INPUT,
                            "cannot import '%s': a NRRD in %zu files is read only as raw slices", h->name,
                            h->list_count);
        status = vol_read_slices(source, (const char *const *)h->list, h->list_count,
                                 (size_t)(total / h->list_count), h->byte_skip, true, &out->bytes, err);
    }
    vol_bytes_free(&bytes);
    return status;
}

static VolStatus describe(Header *h, VolSampled *out, VolError *err)
{
    int space[3], components, time;
    VolStatus status = sort_axes(h, space, &components, &time, err);
    if (status)
        return status;
    uint64_t stride[AXES + 1] = {1};
    for (int a = 0; a < h->axes; a++)
        stride[a + 1] = stride[a] * (uint64_t)h->sizes[a];
    h->samples = stride[h->axes];
    for (int i = 0; i < 3; i++) {
        out->dims[i] = space[i] >= 0 ? h->sizes[space[i]] : 1;
        out->stride[i] = space[i] >= 0 ? (int64_t)stride[space[i]] : 0;
    }
    out->components = components >= 0 ? h->sizes[components] : 1;
    out->component_stride = components >= 0 ? (int64_t)stride[components] : 0;
    out->times = time >= 0 ? h->sizes[time] : 1;
    out->time_stride = time >= 0 ? (int64_t)stride[time] : 0;
    fill_affine(h, space, &out->index_to_world);
    out->type = h->type;
    out->big_endian = h->big_endian;
    if (!h->endian_given && vol_sample_size(h->type) > 1 && !is_text(h))
        return vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': NRRD field 'endian' is missing", h->name);
    return VOL_OK;
}

VolStatus vol_read_nrrd(const VolSource *source, VolSampled *out, VolError *err)
{
    Header h = {.name = source->name};
    for (int a = 0; a < AXES; a++)
        h.spacings[a] = h.mins[a] = h.maxs[a] = NAN;
    size_t at = 0;
    *out = (VolSampled){0};
    VolStatus status = parse_header(&h, source->bytes, &at, err);
    if (!status)
        status = describe(&h, out, err);
    if (!status)
        status = h.data_file || h.list ? find_detached(&h, source, out, err)
                                       : find_samples(&h, source->bytes, at, out, err);
    if (!status)
        status = vol_sampled_check(out, source->name, false, err);
    for (size_t i = 0; i < h.list_count; i++)
        free(h.list[i]);
    free(h.list);
    free(h.data_file);
    return status;
}
