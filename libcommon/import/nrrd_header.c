/* The fields of a NRRD's header, as teem reads them: names and words in any case, with the old spellings. */
#include <ctype.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "import/nrrd.h"

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

/* Entries that say nothing about an axis; "nan" is one where numbers are wanted. */
static const char *const nothing = "???|none";

static char *lower_case(char *text)
{
    for (char *c = text; *c; c++)
        *c = (char)tolower((unsigned char)*c);
    return text;
}

/* Cuts the next word off; NULL: there is none. */
static char *next_word(char **text)
{
    char *word = *text + strspn(*text, " \t");
    *text = word + strcspn(word, " \t");
    if (**text)
        *(*text)++ = 0;
    return *word ? word : NULL;
}

/* ---- One value per axis ---- */

/* Calls `one` for every word; false if it refuses one or there are none or too many. */
static bool each_word(NrrdHeader *h, char *text, int *count, bool (*one)(NrrdHeader *h, int axis, const char *word))
{
    *count = 0;
    for (char *word; (word = next_word(&text)); ++*count)
        if (*count == NRRD_AXES || !one(h, *count, word))
            return false;
    return *count > 0;
}

static bool whole(int64_t *out, const char *word)
{
    char *end;
    *out = strtoll(word, &end, 10);
    return end != word && !*end && *out > INT64_MIN && *out < INT64_MAX;
}

static bool one_size(NrrdHeader *h, int axis, const char *word)
{
    return whole(&h->sizes[axis], word) && h->sizes[axis] > 0;
}

static bool one_kind(NrrdHeader *h, int axis, const char *word)
{
    h->kinds[axis] = vol_one_of(word, "domain|space") ? NRRD_SPATIAL
                     : strcmp(word, "time") == 0      ? NRRD_TIME
                     : vol_one_of(word, nothing)      ? NRRD_UNKNOWN
                                                      : NRRD_COMPONENTS;
    return true;
}

/* An axis of no centring is one of cells. */
static bool one_center(NrrdHeader *h, int axis, const char *word)
{
    h->node[axis] = strcmp(word, "node") == 0;
    return h->node[axis] || strcmp(word, "cell") == 0 || vol_one_of(word, nothing);
}

/* Numbers, NaN where nothing is said. */
static bool parse_reals(char *text, NrrdReals *out)
{
    out->count = 0;
    for (char *word; (word = next_word(&text)); out->count++) {
        char *end = word;
        if (out->count == NRRD_AXES)
            return false;
        double value = vol_one_of(word, nothing) ? (end += strlen(word), NAN) : strtod(word, &end);
        if (end == word || *end || isinf(value))
            return false;
        out->at[out->count] = value;
    }
    return out->count > 0;
}

/* ---- Vectors ---- */

/* The vector "(1,0,0.5)", which may hold blanks, or "none", at *text, which moves behind it.  `space_axes` is how many
 * numbers a vector has, or becomes so.  *given: whether there are numbers; false: this is neither. */
static bool parse_vector(char **text, int *space_axes, double out[NRRD_SPACE], bool *given)
{
    char *word = *text + strspn(*text, " \t");
    *given = false;
    if (*word != '(') {
        *text = word;
        return (word = next_word(text)) && (vol_one_of(word, nothing) || strcmp(word, "nan") == 0);
    }
    char *close = strchr(word, ')');
    if (!close)
        return false;
    *close = 0;
    *text = close + 1;
    double numbers[NRRD_SPACE] = {0};
    int count = vol_scan_reals(word + 1, numbers, NRRD_SPACE), unknown = 0;
    if (count < 1 || (*space_axes && count != *space_axes))
        return false;
    *space_axes = count;
    for (int i = 0; i < count; i++) {
        if (isinf(numbers[i]))
            return false;
        unknown += isnan(numbers[i]) ? 1 : 0;
    }
    *given = unknown == 0;
    memcpy(out, numbers, sizeof numbers);
    return unknown == 0 || unknown == count;
}

static bool parse_directions(NrrdHeader *h, char *text)
{
    h->directions_count = 0;
    while (text += strspn(text, " \t"), *text) {
        int axis = h->directions_count++;
        if (axis == NRRD_AXES ||
            !parse_vector(&text, &h->space_axes, h->directions[axis], &h->has_direction[axis]))
            return false;
    }
    return h->directions_count > 0;
}

static bool parse_origin(NrrdHeader *h, char *text)
{
    bool given;
    if (!parse_vector(&text, &h->space_axes, h->origin.at, &given))
        return false;
    h->origin.count = given ? h->space_axes : 0;
    return !text[strspn(text, " \t")];
}

/* ---- Data files ---- */

/* Adds a name to the list. */
static VolStatus add_file(NrrdFiles *files, const char *name, int64_t skip, VolError *err)
{
    char **names = vol_resize(files->names, files->count + 1, sizeof *names);
    if (names)
        files->names = names;
    int64_t *skips = vol_resize(files->skips, files->count + 1, sizeof *skips);
    if (skips)
        files->skips = skips;
    char *copy = vol_copy_text(name);
    if (!names || !skips || !copy) {
        free(copy);
        return vol_fail_memory(err, (files->count + 1) * sizeof *names);
    }
    files->skips[files->count] = skip;
    files->names[files->count++] = copy;
    return VOL_OK;
}

/* "LIST": the names follow, one per line, to the end; "SKIPLIST": each after a number of bytes. */
static VolStatus parse_name_list(NrrdHeader *h, bool skips, const VolBytes *bytes, size_t *at, VolError *err)
{
    VolStatus status = VOL_OK;
    h->files.several = true;
    while (!status) {
        char *line;
        status = vol_next_line(bytes, at, &line, err);
        if (status || !line)
            break;
        char *name = vol_trim(line);
        int64_t skip = 0;
        if (*name && skips) {
            char *number = next_word(&name);
            name = vol_trim(name);
            if (!whole(&skip, number) || !*name)
                status = vol_fail(err, VOL_BAD_INPUT,
                                  "cannot import '%s': NRRD: SKIPLIST wants a number of bytes and a file name in "
                                  "every line",
                                  h->name);
        }
        if (!status && *name)
            status = add_file(&h->files, name, skip, err);
        free(line);
    }
    if (!status && !skips) {
        free(h->files.skips);
        h->files.skips = NULL;
    }
    return status;
}

/* "5 11 2 [dimension]" after a pattern of names: the first and last number and the step. */
static bool parse_range(NrrdFiles *files, char *text)
{
    int64_t numbers[4] = {0, 0, 0, 0}, last;
    int count = 0;
    for (char *word; (word = next_word(&text)); count++)
        if (count == 4 || !whole(&numbers[count], word) || llabs(numbers[count]) > INT32_MAX)
            return false;
    files->first = numbers[0];
    last = numbers[1];
    files->step = numbers[2];
    if (count < 3 || files->step == 0 || (last - files->first) / files->step < 0 ||
        ((last > files->first) != (files->step > 0) && last != files->first))
        return false;
    files->count = (size_t)((last - files->first) / files->step) + 1;
    files->axes = (int)numbers[3];
    return count == 3 || numbers[3] > 0;
}

static bool list_word(char **text, const char *word, int *axes)
{
    size_t n = strlen(word);
    if (strncasecmp(*text, word, n) != 0 || ((*text)[n] && !strchr(" \t", (*text)[n])))
        return false;
    int64_t number = 0;
    char *rest = vol_trim(*text + n);
    if (*rest && !(whole(&number, rest) && number >= 1 && number <= NRRD_AXES))
        return false;
    *axes = (int)number;
    return true;
}

/* The forms of `data file`: lists, a pattern with numbers, a name. */
static VolStatus parse_data_file(NrrdHeader *h, char *value, const VolBytes *bytes, size_t *at, VolError *err)
{
    NrrdFiles *files = &h->files;
    if (!*value)
        return vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': NRRD field 'data file' is empty", h->name);
    bool skips = list_word(&value, "skiplist", &files->axes);
    if (skips || list_word(&value, "list", &files->axes))
        return parse_name_list(h, skips, bytes, at, err);
    size_t word = strcspn(value, " \t");
    const char *percent = memchr(value, '%', word);
    if (!percent || !value[word] || percent[1 + strspn(percent + 1, "0123456789")] != 'd') {
        VolStatus status = add_file(files, value, 0, err);
        free(files->skips);
        files->skips = NULL;
        return status;
    }
    value[word] = 0;
    files->several = true;
    if (!parse_range(files, value + word + 1))
        return vol_fail(err, VOL_BAD_INPUT,
                        "cannot import '%s': NRRD field 'data file: %s' wants the first and last number and the step",
                        h->name, value);
    files->pattern = vol_copy_text(value);
    return files->pattern ? VOL_OK : vol_fail_memory(err, word);
}

/* ---- Fields ---- */

/* "axis mins" is "axismins" in old files. */
static bool field_is(const char *field, const char *name)
{
    for (; *name; name++) {
        if (*name == ' ' && *field != ' ')
            continue;
        if (*field++ != *name)
            return false;
    }
    return !*field;
}

static NrrdEncoding encoding_of(const char *word)
{
    static const char *const names[] = {[NRRD_RAW] = "raw",      [NRRD_TEXT] = "ascii|text|txt", [NRRD_HEX] = "hex",
                                        [NRRD_GZIP] = "gzip|gz", [NRRD_BZIP2] = "bzip2|bz2"};
    for (int n = NRRD_RAW; n <= NRRD_BZIP2; n++)
        if (vol_one_of(word, names[n]))
            return (NrrdEncoding)n;
    return NRRD_NONE;
}

/* Fields of one number or word; those not known say nothing about the volume. */
static bool parse_plain(NrrdHeader *h, const char *field, const char *value)
{
    int64_t number = 0;
    if (field_is(field, "type"))
        return h->type_given = vol_sample_spelt(value, spellings, &h->type);
    if (field_is(field, "encoding"))
        return (h->encoding = encoding_of(value)) != NRRD_NONE;
    if (field_is(field, "endian")) {
        h->big_endian = strcmp(value, "big") == 0;
        return h->endian_given = h->big_endian || strcmp(value, "little") == 0;
    }
    bool good = whole(&number, value);
    if (field_is(field, "dimension")) {
        h->axes = (int)number;
        return good && number >= 1 && number <= NRRD_AXES;
    }
    if (field_is(field, "space dimension")) {
        h->space_axes = (int)number;
        return good && number >= 1 && number <= NRRD_SPACE;
    }
    if (field_is(field, "line skip")) {
        h->line_skip = number;
        return good && number >= 0;
    }
    if (field_is(field, "byte skip")) {
        h->byte_skip = number;
        return good;
    }
    return true;
}

static bool parse_per_axis(NrrdHeader *h, const char *field, char *value)
{
    if (field_is(field, "sizes"))
        return each_word(h, value, &h->sizes_count, one_size);
    if (field_is(field, "kinds"))
        return each_word(h, value, &h->kinds_count, one_kind);
    if (vol_one_of(field, "centers|centerings"))
        return each_word(h, value, &h->centers_count, one_center);
    if (field_is(field, "spacings"))
        return parse_reals(value, &h->spacings);
    if (field_is(field, "axis mins"))
        return parse_reals(value, &h->mins);
    if (field_is(field, "axis maxs"))
        return parse_reals(value, &h->maxs);
    if (field_is(field, "space directions"))
        return parse_directions(h, value);
    if (field_is(field, "space origin"))
        return parse_origin(h, value);
    return true;
}

/* teem's fields.  Those with one entry per axis are read by the number of axes, which must be known by then. */
static const struct {
    const char *name;
    bool per_axis;
} known_fields[] = {{"content"}, {"number"}, {"type"}, {"block size"}, {"dimension"}, {"space"}, {"space dimension"},
                    {"sizes", true}, {"spacings", true}, {"thicknesses", true}, {"axis mins", true}, {"axis maxs", true},
                    {"space directions", true}, {"centers", true}, {"kinds", true}, {"labels", true}, {"units", true},
                    {"min"}, {"max"}, {"old min"}, {"old max"}, {"endian"}, {"encoding"}, {"line skip"}, {"byte skip"},
                    {"sample units"}, {"space units"}, {"space origin"}, {"measurement frame"}, {"data file"}};
_Static_assert(sizeof known_fields / sizeof *known_fields <= NRRD_FIELDS, "lines of all fields");

/* As in teem a field is there once, and where it wants the number of axes, that comes first: of two types or sizes nobody
 * can say which is meant. */
static VolStatus check_place(NrrdHeader *h, const char *field, int line, VolError *err)
{
    for (size_t n = 0; n < sizeof known_fields / sizeof *known_fields; n++) {
        bool centers = strcmp(known_fields[n].name, "centers") == 0 && field_is(field, "centerings");
        if (!centers && !field_is(field, known_fields[n].name))
            continue;
        if (h->lines[n])
            return vol_fail(err, VOL_BAD_INPUT,
                            "cannot import '%s': line %d: NRRD field '%s' is there twice, in line %d too",
                            h->name, line, field, h->lines[n]);
        if (known_fields[n].per_axis && !h->axes)
            return vol_fail(err, VOL_BAD_INPUT,
                            "cannot import '%s': line %d: NRRD field '%s' comes before 'dimension'", h->name,
                            line, field);
        h->lines[n] = line;
    }
    return VOL_OK;
}

static VolStatus parse_field(NrrdHeader *h, const char *field, char *value, int line, const VolBytes *bytes, size_t *at,
                             VolError *err)
{
    VolStatus status = check_place(h, field, line, err);
    if (status || field_is(field, "data file"))
        return status ? status : parse_data_file(h, value, bytes, at, err);
    char *scratch = vol_copy_text(value);
    if (!scratch)
        return vol_fail_memory(err, strlen(value));
    lower_case(scratch);
    bool good = parse_plain(h, field, scratch) && parse_per_axis(h, field, scratch);
    free(scratch);
    return good ? VOL_OK
                : vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': line %d: NRRD field '%s: %s' is not understood%s",
                           h->name, line, field, value,
                           field_is(field, "encoding") ? " (raw, gzip, bzip2, hex and ascii are)" : "");
}

/* Every field that lists axes lists all. */
static VolStatus check_counts(const NrrdHeader *h, VolError *err)
{
    const struct {
        const char *name;
        int count;
    } fields[] = {{"sizes", h->sizes_count},
                  {"kinds", h->kinds_count},
                  {"centers", h->centers_count},
                  {"spacings", h->spacings.count},
                  {"axis mins", h->mins.count},
                  {"axis maxs", h->maxs.count},
                  {"space directions", h->directions_count}};
    if (!h->type_given || !h->axes || !h->sizes_count || !h->encoding)
        return vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': NRRD field '%s' is missing or not known", h->name,
                        !h->type_given    ? "type"
                        : !h->axes        ? "dimension"
                        : !h->sizes_count ? "sizes"
                                          : "encoding");
    for (size_t i = 0; i < sizeof fields / sizeof *fields; i++)
        if (fields[i].count && fields[i].count != h->axes)
            return vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': NRRD has %s %s than dimensions (%d, not %d)",
                            h->name, fields[i].count < h->axes ? "fewer" : "more", fields[i].name, fields[i].count,
                            h->axes);
    if (h->files.several && h->files.count == 0)
        return vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': the NRRD's list of data files is empty", h->name);
    return VOL_OK;
}

/* Fields to the empty line (attached) or the end (detached).  `key:=value` pairs and comments say nothing to us. */
VolStatus vol_nrrd_parse(NrrdHeader *h, const VolBytes *bytes, size_t *at, VolError *err)
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
        if (!colon)
            colon = strchr(line, ':');
        if (n > 0 && *line != '#' && colon && colon[1] != '=') {
            *colon = 0;
            status = parse_field(h, lower_case(vol_trim(line)), vol_trim(colon + 1), n + 1, bytes, at, err);
        }
        free(line);
    }
    return status ? status : check_counts(h, err);
}

void vol_nrrd_header_free(NrrdHeader *h)
{
    for (size_t i = 0; h->files.names && i < h->files.count; i++)
        free(h->files.names[i]);
    free(h->files.names);
    free(h->files.skips);
    free(h->files.pattern);
    h->files = (NrrdFiles){0};
}
