/* VTK's legacy files with structured points, word by word as VTK reads them. */
#include <ctype.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "import/vti.h"

enum { NAME_SIZE = 256, TYPE_BIT = -1, TYPE_TEXT = -2, TYPE_VARIANT = -3 }; /* beside the VolSamples */

typedef struct Array {
    char name[NAME_SIZE];
    bool cells, scalars; /* scalars: the first of these are the active ones */
    bool colors;         /* as text, from 0 to 1, to become bytes */
    int type;            /* a VolSample, or one of the above */
    int64_t components, tuples;
    size_t begin; /* of the data */
} Array;

typedef struct Legacy {
    const VolBytes *bytes;
    const char *file;
    size_t at;
    bool binary;
    int64_t extent[6];
    double origin[3], spacing[3];
    bool placed; /* the extent is known */
    Array *arrays;
    size_t count, capacity;
    VolError *err;
} Legacy;

/* Words of upper and lower case are the same; VTK compares beginnings. */
static bool starts(const char *word, const char *with)
{
    for (; *with; word++, with++)
        if (tolower((unsigned char)*word) != *with)
            return false;
    return true;
}

static VolStatus fail_at(const Legacy *f, const char *what)
{
    return vol_fail(f->err, VOL_BAD_INPUT, "cannot import '%s': damaged at byte %zu: %s", f->file, f->at, what);
}

static VolStatus fail_truncated(const Legacy *f, const char *what)
{
    return vol_fail(f->err, VOL_BAD_INPUT, "cannot import '%s': truncated after %zu bytes: %s", f->file,
                    f->bytes->size, what);
}

/* ---- Words, numbers, lines ---- */

static bool get_word(Legacy *f, char *word) { return vol_vtk_word(f->bytes, &f->at, word, NAME_SIZE); }

static void skip_line(Legacy *f)
{
    const unsigned char *begin = f->bytes->data + f->at;
    const unsigned char *newline = memchr(begin, '\n', f->bytes->size - f->at);
    f->at = newline ? (size_t)(newline - f->bytes->data) + 1 : f->bytes->size;
}

static VolStatus get_integer(Legacy *f, int64_t *out, const char *what)
{
    char word[NAME_SIZE];
    uint64_t bits;
    if (!get_word(f, word))
        return fail_truncated(f, what);
    if (!vol_vtk_number(word, VOL_SAMPLE_I64, &bits))
        return fail_at(f, what);
    *out = (int64_t)bits;
    return VOL_OK;
}

static VolStatus get_integers(Legacy *f, int64_t *out, int count, const char *what)
{
    VolStatus status = VOL_OK;
    for (int n = 0; !status && n < count; n++) {
        status = get_integer(f, &out[n], what);
        if (!status && (out[n] < INT32_MIN || out[n] > INT32_MAX))
            status = fail_at(f, what);
    }
    return status;
}

static VolStatus get_reals(Legacy *f, double out[3], const char *what)
{
    char word[NAME_SIZE];
    uint64_t bits;
    for (int n = 0; n < 3; n++) {
        if (!get_word(f, word))
            return fail_truncated(f, what);
        if (!vol_vtk_number(word, VOL_SAMPLE_F64, &bits))
            return fail_at(f, what);
        memcpy(&out[n], &bits, sizeof bits);
    }
    return VOL_OK;
}

/* Names have blanks and the like as %20. */
static void decode_name(char *name)
{
    char *to = name;
    for (const char *from = name; *from; from++) {
        char digits[3] = {from[0] == '%' ? from[1] : 0, 0, 0}, *end;
        if (digits[0])
            digits[1] = from[2];
        long code = strtol(digits, &end, 16);
        bool coded = digits[0] && digits[1] && !*end && isxdigit((unsigned char)digits[0]);
        *to++ = coded ? (char)code : *from;
        from += coded ? 2 : 0;
    }
    *to = 0;
}

/* ---- Arrays ---- */

static bool type_named(const char *word, int *type)
{
    static const struct {
        const char *name;
        int type;
    } types[] = {{"bit", TYPE_BIT},
                 {"char", VOL_SAMPLE_I8},
                 {"signed_char", VOL_SAMPLE_I8},
                 {"unsigned_char", VOL_SAMPLE_U8},
                 {"short", VOL_SAMPLE_I16},
                 {"unsigned_short", VOL_SAMPLE_U16},
                 {"vtkidtype", VOL_SAMPLE_I32}, /* written as int, whatever it is in memory */
                 {"int", VOL_SAMPLE_I32},
                 {"unsigned_int", VOL_SAMPLE_U32},
                 {"long", VOL_SAMPLE_I64},
                 {"unsigned_long", VOL_SAMPLE_U64},
                 {"vtktypeint64", VOL_SAMPLE_I64},
                 {"vtktypeuint64", VOL_SAMPLE_U64},
                 {"float", VOL_SAMPLE_F32},
                 {"double", VOL_SAMPLE_F64},
                 {"string", TYPE_TEXT},
                 {"utf8_string", TYPE_TEXT},
                 {"variant", TYPE_VARIANT}};
    for (size_t i = 0; i < sizeof types / sizeof *types; i++)
        if (starts(word, types[i].name))
            return *type = types[i].type, true;
    return false;
}

static VolStatus fail_short(const Legacy *f, const Array *array, int64_t have)
{
    char what[NAME_SIZE + 100];
    snprintf(what, sizeof what, "array '%.80s' holds %" PRId64 " of its %" PRId64 " values", array->name, have,
             array->components * array->tuples);
    return fail_truncated(f, what);
}

/* Passes over `count` words; how many there were. */
static int64_t skip_words(Legacy *f, int64_t count)
{
    int64_t n = 0;
    char word[NAME_SIZE];
    while (n < count && get_word(f, word))
        n++;
    return n;
}

/* Texts have a line each or, in binary files, their length before them: the top two bits of its first byte say how
 * many bytes it has. */
static int64_t skip_texts(Legacy *f, int64_t count)
{
    for (int64_t n = 0; n < count; n++) {
        size_t left = f->bytes->size - f->at;
        if (left == 0)
            return n;
        if (!f->binary) {
            skip_line(f);
            continue;
        }
        const unsigned char *p = f->bytes->data + f->at;
        size_t bytes = (size_t)8 >> (p[0] >> 6);
        uint64_t length = p[0] & (bytes == 8 ? 0xff : 0x3f);
        for (size_t i = 1; i < bytes && i < left; i++)
            length = length << 8 | p[i];
        if (left < bytes || length > left - bytes)
            return n;
        f->at += bytes + (size_t)length;
    }
    return count;
}

/* Passes over the data, which must all be there. */
static VolStatus skip_data(Legacy *f, const Array *array)
{
    int64_t values = array->components * array->tuples, left;
    if (values == 0)
        return VOL_OK;
    if (array->type == TYPE_VARIANT) {
        int64_t words = skip_words(f, 2 * values);
        return words < 2 * values ? fail_short(f, array, words / 2) : VOL_OK;
    }
    if (array->type == TYPE_TEXT) {
        int64_t texts = skip_texts(f, values);
        return texts < values ? fail_short(f, array, texts) : VOL_OK;
    }
    if (!f->binary) {
        int64_t words = skip_words(f, values);
        return words < values ? fail_short(f, array, words) : VOL_OK;
    }
    left = (int64_t)(f->bytes->size - f->at);
    if (array->type == TYPE_BIT) {
        if (left < values / 8 + (values % 8 != 0))
            return fail_short(f, array, 8 * left);
        f->at += (size_t)(values / 8 + (values % 8 != 0));
        return VOL_OK;
    }
    int64_t size = (int64_t)vol_sample_size((VolSample)array->type);
    if (values > left / size)
        return fail_short(f, array, left / size);
    f->at += (size_t)(values * size);
    return VOL_OK;
}

/* METADATA may follow an array: lines up to an empty one, but the names of components may be empty. */
static void skip_metadata(Legacy *f, int64_t components)
{
    char word[NAME_SIZE];
    size_t before = f->at;
    if (!get_word(f, word) || !starts(word, "metadata")) {
        f->at = before;
        return;
    }
    skip_line(f);
    while (f->at < f->bytes->size) {
        size_t line = f->at;
        skip_line(f);
        const unsigned char *p = f->bytes->data + line;
        size_t length = f->at - line;
        if (p[0] == '\n' || (p[0] == '\r' && length > 1 && p[1] == '\n'))
            return;
        snprintf(word, sizeof word, "%.*s", length < 20 ? (int)length : 20, (const char *)p);
        for (int64_t n = 0; starts(word, "component_names") && n < components && f->at < f->bytes->size; n++)
            skip_line(f);
    }
}

/* An array whose name and shape are known: its type, a lookup table's name where there is one, its data. */
static VolStatus add_array(Legacy *f, const Array *described, const char *type)
{
    if (f->count == f->capacity) {
        size_t capacity = f->capacity ? 2 * f->capacity : 8;
        Array *longer = vol_resize(f->arrays, capacity, sizeof *longer);
        if (!longer)
            return vol_fail_memory(f->err, capacity * sizeof *longer);
        f->arrays = longer;
        f->capacity = capacity;
    }
    Array *array = &f->arrays[f->count];
    *array = *described;
    decode_name(array->name);
    int64_t values, bytes;
    if (!type_named(type, &array->type))
        return vol_fail(f->err, VOL_BAD_INPUT, "cannot import '%s': array '%.80s': type '%.40s' is not known",
                        f->file, array->name, type);
    if (array->components < 0 || array->tuples < 0 ||
        __builtin_mul_overflow(array->components, array->tuples, &values) ||
        __builtin_mul_overflow(values, (int64_t)64, &bytes))
        return vol_fail(f->err, VOL_BAD_INPUT,
                        "cannot import '%s': array '%.80s': %" PRId64 " times %" PRId64 " values are impossible",
                        f->file, array->name, array->tuples, array->components);
    bool lines = f->binary || array->type == TYPE_TEXT;
    if (lines && values > 0 && array->type != TYPE_VARIANT)
        skip_line(f); /* the rest of the line with the type */
    array->begin = f->at;
    VolStatus status = skip_data(f, array);
    if (!status)
        skip_metadata(f, array->components);
    return status;
}

/* NAME TYPE, or NAME COMPONENTS TYPE where components is 0. */
static VolStatus read_array(Legacy *f, Array *array)
{
    static const char what[] = "an array is to have a name and a type";
    char type[NAME_SIZE];
    if (!get_word(f, array->name))
        return fail_truncated(f, what);
    if (array->components == 0) {
        VolStatus status = get_integer(f, &array->components, "number of components expected");
        if (status)
            return status;
    }
    if (array->colors)
        snprintf(type, sizeof type, f->binary ? "unsigned_char" : "float");
    else if (!get_word(f, type))
        return fail_truncated(f, what);
    array->colors = array->colors && !f->binary;
    VolStatus status = add_array(f, array, type);
    f->count += status == VOL_OK;
    return status;
}

/* SCALARS NAME TYPE [COMPONENTS] LOOKUP_TABLE NAME */
static VolStatus read_scalars(Legacy *f, Array *array)
{
    static const char what[] = "SCALARS are to have a name, a type and a LOOKUP_TABLE";
    char type[NAME_SIZE], word[NAME_SIZE];
    array->scalars = true;
    array->components = 1;
    if (!get_word(f, array->name) || !get_word(f, type) || !get_word(f, word))
        return fail_truncated(f, what);
    if (!starts(word, "lookup_table")) {
        uint64_t bits;
        if (!vol_vtk_number(word, VOL_SAMPLE_I64, &bits) || (int64_t)bits < 1)
            return fail_at(f, what);
        array->components = (int64_t)bits;
        if (!get_word(f, word))
            return fail_truncated(f, what);
    }
    if (!starts(word, "lookup_table"))
        return fail_at(f, what);
    if (!get_word(f, word))
        return fail_truncated(f, what);
    VolStatus status = add_array(f, array, type);
    f->count += status == VOL_OK;
    return status;
}

/* FIELD NAME N, then N times NAME COMPONENTS TUPLES TYPE.  Outside POINT_DATA and CELL_DATA it is passed over. */
static VolStatus read_field(Legacy *f, bool cells, bool kept)
{
    char word[NAME_SIZE];
    int64_t count = 0;
    if (!get_word(f, word))
        return fail_truncated(f, "FIELD is to have a name");
    VolStatus status = get_integer(f, &count, "FIELD is to have a number of arrays");
    for (int64_t n = 0; !status && n < count; n++) {
        Array array = {.cells = cells};
        if (!get_word(f, array.name))
            return fail_truncated(f, "arrays of a FIELD are missing");
        if (strcmp(array.name, "NULL_ARRAY") == 0)
            continue;
        status = get_integer(f, &array.components, "number of components expected");
        if (!status)
            status = get_integer(f, &array.tuples, "number of tuples expected");
        if (!status && !get_word(f, word))
            status = fail_truncated(f, "type expected");
        if (!status)
            status = add_array(f, &array, word);
        f->count += !status && kept;
    }
    return status;
}

/* LOOKUP_TABLE NAME SIZE: colours, which are passed over. */
static VolStatus read_lookup_table(Legacy *f)
{
    Array table = {.components = 4};
    if (!get_word(f, table.name))
        return fail_truncated(f, "LOOKUP_TABLE is to have a name");
    VolStatus status = get_integer(f, &table.tuples, "LOOKUP_TABLE is to have a size");
    return status ? status : add_array(f, &table, f->binary ? "unsigned_char" : "float");
}

/* ---- The parts of the file ---- */

/* One attribute of points or cells, whose keyword has been read. */
static VolStatus read_attribute(Legacy *f, const char *word, bool cells, int64_t tuples)
{
    static const struct {
        const char *keyword;
        int64_t components; /* 0: the file says */
    } kinds[] = {
        {"vectors", 3},    {"tensors6", 6},     {"tensors", 9},   {"normals", 3}, {"texture_coordinates", 0},
        {"global_ids", 1}, {"pedigree_ids", 1}, {"edge_flags", 1}};
    Array array = {.cells = cells, .tuples = tuples};
    if (starts(word, "scalars"))
        return read_scalars(f, &array);
    if (starts(word, "color_scalars")) {
        array.scalars = array.colors = true;
        return read_array(f, &array);
    }
    if (starts(word, "lookup_table"))
        return read_lookup_table(f);
    if (starts(word, "field"))
        return read_field(f, cells, true);
    for (size_t i = 0; i < sizeof kinds / sizeof *kinds; i++)
        if (starts(word, kinds[i].keyword)) {
            array.components = kinds[i].components;
            return read_array(f, &array);
        }
    char what[80];
    snprintf(what, sizeof what, "'%.40s' is no attribute of %s", word, cells ? "cells" : "points");
    return fail_at(f, what);
}

static VolStatus read_geometry(Legacy *f, const char *word)
{
    int64_t n[6];
    VolStatus status = VOL_OK;
    if (starts(word, "dimensions")) {
        status = get_integers(f, n, 3, "DIMENSIONS are to be three numbers");
        for (int a = 0; !status && a < 3; a++) {
            f->extent[2 * a] = 0;
            f->extent[2 * a + 1] = n[a] - 1;
        }
        f->placed = true;
    } else if (starts(word, "extent")) {
        status = get_integers(f, n, 6, "EXTENT is to be six numbers");
        if (!status && !f->placed)
            memcpy(f->extent, n, sizeof n);
        f->placed = true;
    } else if (starts(word, "spacing") || starts(word, "aspect_ratio")) {
        status = get_reals(f, f->spacing, "SPACING is to be three numbers");
    } else if (starts(word, "origin")) {
        status = get_reals(f, f->origin, "ORIGIN is to be three numbers");
    } else if (starts(word, "field")) {
        status = read_field(f, false, false);
    } else {
        char what[80];
        snprintf(what, sizeof what, "'%.40s' is no keyword of STRUCTURED_POINTS", word);
        status = fail_at(f, what);
    }
    return status;
}

static VolStatus read_parts(Legacy *f)
{
    char word[NAME_SIZE];
    VolStatus status = VOL_OK;
    bool cells = false, attributes = false;
    int64_t tuples = 0;
    while (!status && get_word(f, word)) {
        if (starts(word, "point_data") || starts(word, "cell_data")) {
            cells = starts(word, "cell_data");
            attributes = true;
            status = get_integer(f, &tuples, "the number of points or cells is expected");
        } else if (attributes) {
            status = read_attribute(f, word, cells, tuples);
        } else {
            status = read_geometry(f, word);
        }
    }
    return status;
}

/* Two lines, the second of which is a title of any words, then ASCII or BINARY, then DATASET and its kind. */
static VolStatus read_head(Legacy *f)
{
    char coding[NAME_SIZE], keyword[NAME_SIZE], kind[NAME_SIZE];
    skip_line(f);
    skip_line(f);
    if (!get_word(f, coding) || !get_word(f, keyword) || !get_word(f, kind))
        return fail_truncated(f, "the VTK file does not say what it holds");
    f->binary = starts(coding, "binary");
    if (!f->binary && !starts(coding, "ascii"))
        return vol_fail(f->err, VOL_BAD_INPUT,
                        "cannot import '%s': the VTK file is '%.40s', neither ASCII nor BINARY", f->file, coding);
    for (char *c = starts(keyword, "dataset") ? kind : keyword; *c; c++)
        *c = (char)toupper((unsigned char)*c);
    if (!starts(keyword, "dataset"))
        return vol_fail(f->err, VOL_BAD_INPUT,
                        "cannot import '%s': VTK files of kind '%.40s' are not read in this version (DATASET "
                        "STRUCTURED_POINTS are)",
                        f->file, keyword);
    if (!starts(kind, "structured_points"))
        return vol_fail(
            f->err, VOL_BAD_INPUT,
            "cannot import '%s': VTK files of kind '%.40s' are not read in this version (STRUCTURED_POINTS "
            "are)",
            f->file, kind);
    return VOL_OK;
}

/* ---- The image ---- */

/* Whether a later array of the same name replaces this one. */
static bool replaced(const Legacy *f, size_t index)
{
    const Array *array = &f->arrays[index];
    for (size_t i = index + 1; i < f->count; i++)
        if (f->arrays[i].cells == array->cells && strcmp(f->arrays[i].name, array->name) == 0)
            return true;
    return false;
}

static bool is_number(const Array *array) { return array->type >= TYPE_BIT; }

/* The named array, of points first; without a name the first scalars, else the only array there is.  `list`
 * becomes what there is. */
static const Array *choose(const Legacy *f, const char *name, char *list, size_t list_size)
{
    const Array *only = NULL;
    size_t count = 0, length = 0;
    snprintf(list, list_size, "none");
    for (int cells = 0; cells < 2; cells++)
        for (size_t i = 0; i < f->count; i++) {
            const Array *array = &f->arrays[i];
            if (array->cells != cells || !is_number(array) || (count < 100 && replaced(f, i)))
                continue;
            if (name ? strcmp(array->name, name) == 0 : array->scalars)
                return array;
            if (length < list_size) {
                int n = snprintf(list + length, list_size - length, "%s%s (%" PRId64 ", %s)", count ? ", " : "",
                                 array->name[0] ? array->name : "(unnamed)", array->components,
                                 cells ? "cells" : "points");
                length += n > 0 ? (size_t)n : 0;
            }
            only = array;
            count++;
        }
    return !name && count == 1 ? only : NULL;
}

/* Samples of cells lie in the middle between the points. */
static VolStatus place(const Legacy *f, const Array *array, VolSampled *out)
{
    int64_t count = 1;
    for (int a = 0; a < 3; a++) {
        int64_t points = f->extent[2 * a + 1] - f->extent[2 * a] + 1;
        bool between = array->cells && points > 1;
        out->dims[a] = between ? points - 1 : points;
        if (!f->placed || points < 1)
            return vol_fail(f->err, VOL_BAD_INPUT, "cannot import '%s': it holds no image: its DIMENSIONS are %s",
                            f->file, f->placed ? "not positive" : "missing");
        if (__builtin_mul_overflow(count, out->dims[a], &count))
            count = -1;
        out->index_to_world.m[a][a] = f->spacing[a];
        out->index_to_world.m[3][a] =
            f->origin[a] + f->spacing[a] * ((double)f->extent[2 * a] + (between ? 0.5 : 0.0));
    }
    if (count != array->tuples)
        return vol_fail(f->err, VOL_BAD_INPUT,
                        "cannot import '%s': array '%.80s' has %" PRId64 " values, the image %" PRId64
                        " x %" PRId64 " x %" PRId64 " %s",
                        f->file, array->name, array->tuples, out->dims[0], out->dims[1], out->dims[2],
                        array->cells ? "cells" : "points");
    return VOL_OK;
}

static unsigned char color_byte(uint64_t bits)
{
    uint32_t word = (uint32_t)bits;
    float value;
    memcpy(&value, &word, sizeof value);
    return value >= 1 ? 255 : value > 0 ? (unsigned char)(255.0 * (double)value + 0.5) : 0;
}

static VolStatus read_text(Legacy *f, const Array *array, VolSampled *out)
{
    bool bit = array->type == TYPE_BIT;
    VolSample type = array->colors || bit ? VOL_SAMPLE_U8 : (VolSample)array->type;
    size_t size = vol_sample_size(type), count = (size_t)(array->tuples * array->components);
    double bytes = (double)count * (double)size;
    VolStatus status = bytes > VOL_WORTH_A_CHECK ? vol_check_memory(bytes, f->err) : VOL_OK;
    if (status)
        return vol_fail_within(f->err, status, "cannot import '%s'", f->file);
    unsigned char *data = vol_alloc(count, size);
    if (!data)
        return vol_fail_memory(f->err, count * size);
    out->bytes = (VolBytes){data, count * size};
    out->type = type;
    f->at = array->begin;
    for (size_t n = 0; n < count; n++) {
        char word[NAME_SIZE], what[2 * NAME_SIZE];
        uint64_t bits = 0;
        bool there = get_word(f, word); /* skip_data has counted them */
        if (!there || !vol_vtk_number(word, bit ? type : (VolSample)array->type, &bits)) {
            snprintf(what, sizeof what, "value %zu of %zu of array '%.80s', '%.30s', is no number of its type",
                     n + 1, count, array->name, word);
            return fail_at(f, what);
        }
        vol_vtk_put(data + n * size, array->colors ? color_byte(bits) : bit ? bits != 0 : bits, size, true);
    }
    return VOL_OK;
}

/* Bits become bytes; skip_data has found them there. */
static VolStatus read_bits(Legacy *f, const Array *array, VolSampled *out)
{
    size_t count = (size_t)(array->tuples * array->components), packed = count / 8 + (count % 8 != 0);
    VolStatus status = count > VOL_WORTH_A_CHECK ? vol_check_memory((double)count, f->err) : VOL_OK;
    if (status)
        return vol_fail_within(f->err, status, "cannot import '%s'", f->file);
    unsigned char *data = vol_alloc(count, 1);
    if (!data)
        return vol_fail_memory(f->err, count);
    memcpy(data, f->bytes->data + array->begin, packed);
    vol_vtk_spread_bits(data, count);
    out->type = VOL_SAMPLE_U8;
    out->bytes = (VolBytes){data, count};
    return VOL_OK;
}

static VolStatus take_array(Legacy *f, const Array *array, const VolSource *source, VolSampled *out)
{
    VolStatus status = place(f, array, out);
    if (status)
        return status;
    out->components = array->components;
    out->times = 1;
    out->big_endian = true;
    vol_sampled_order(out);
    if (!f->binary) {
        status = read_text(f, array, out);
    } else if (array->type == TYPE_BIT) {
        status = read_bits(f, array, out);
    } else {
        out->type = (VolSample)array->type;
        out->offset = array->begin;
        out->bytes = *source->bytes;
        *source->bytes = (VolBytes){0};
    }
    return status ? status : vol_sampled_check(out, f->file, false, f->err);
}

VolStatus vol_read_vtk_legacy(const VolSource *source, VolSampled *out, VolError *err)
{
    Legacy f = {.bytes = source->bytes, .file = source->name, .spacing = {1, 1, 1}, .err = err};
    const char *name = source->options->array;
    char list[600];
    *out = (VolSampled){0};
    VolStatus status = read_head(&f);
    if (!status)
        status = read_parts(&f);
    const Array *array = status ? NULL : choose(&f, name, list, sizeof list);
    if (array)
        status = take_array(&f, array, source, out);
    else if (!status && name)
        status = vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': there is no array '%s': there are %s",
                          source->name, name, list);
    else if (!status)
        status =
            vol_fail(err, VOL_BAD_INPUT,
                     "cannot import '%s': no scalars are active, and one array is to be chosen by --array: there "
                     "are %s",
                     source->name, list);
    free(f.arrays);
    return status;
}
