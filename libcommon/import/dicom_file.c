/* The walk through the data elements of a DICOM file (PS3.5 section 7): tag, in explicit syntaxes the type (VR),
 * length, value.  Of sequences only the functional groups of enhanced images (PS3.3 C.7.6.16), the detectors of
 * nuclear medicine and the modality LUT are entered; the others are passed over, so that an icon's size is not taken
 * for the image's.  The pixels are the last that is read: what follows is padding, signatures, or no DICOM at all. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "import/dicom.h"

#define UNDEFINED UINT32_C(0xffffffff)
#define TAG(group, element) ((uint32_t)(group) << 16 | (element))
#define ITEM TAG(0xfffe, 0xe000)
#define ITEM_END TAG(0xfffe, 0xe00d)
#define SEQUENCE_END TAG(0xfffe, 0xe0dd)

typedef struct Cursor {
    const unsigned char *data;
    size_t size, at;
    bool explicit_vr, big;
    const char *name;
} Cursor;

typedef struct Element {
    uint32_t tag;
    char vr[3]; /* "" in implicit syntax */
    uint32_t length;
    const unsigned char *value;
} Element;

static VolStatus truncated(const Cursor *c, VolError *err)
{
    return vol_fail(err, VOL_BAD_INPUT,
                    "cannot import '%s': truncated: a DICOM element at byte %zu ends beyond the file", c->name,
                    c->at);
}

/* Reads tag, type and length; the cursor moves to the value. */
static VolStatus read_head(Cursor *c, Element *e, VolError *err)
{
    if (c->size - c->at < 8)
        return truncated(c, err);
    const unsigned char *p = c->data + c->at;
    e->tag = TAG(vol_get_u16(p, c->big), vol_get_u16(p + 2, c->big));
    e->vr[0] = 0;
    size_t head = 8;
    bool item = e->tag >> 16 == 0xfffe; /* items and delimiters have no type */
    if (c->explicit_vr && !item) {
        memcpy(e->vr, p + 4, 2);
        e->vr[2] = 0;
        const char *const wide[] = {"OB", "OD", "OF", "OL", "OV", "OW", "SQ", "SV", "UC", "UN", "UR", "UT", "UV"};
        bool long_form = false;
        for (size_t i = 0; i < sizeof wide / sizeof *wide; i++)
            long_form = long_form || memcmp(e->vr, wide[i], 2) == 0;
        head = long_form ? 12 : 8;
        if (c->size - c->at < head)
            return truncated(c, err);
        e->length = long_form ? vol_get_u32(p + 8, c->big) : vol_get_u16(p + 6, c->big);
    } else {
        e->length = vol_get_u32(p + 4, c->big);
    }
    c->at += head;
    e->value = c->data + c->at;
    return VOL_OK;
}

/* What was of unknown type is nested in implicit little endian form, whatever is around it (PS3.5 6.2.2). */
static void enter(Cursor *c, const Element *e)
{
    if (strcmp(e->vr, "UN") == 0)
        c->explicit_vr = c->big = false;
}

/* Moves over a value of undefined length: nested elements up to the delimiter that closes it. */
static VolStatus skip_undefined(Cursor *c, const Element *outer, VolError *err)
{
    Cursor around[64]; /* how the elements around are written */
    int depth = 0;
    around[depth++] = *c;
    enter(c, outer);
    while (depth > 0) {
        Element e;
        VolStatus status = read_head(c, &e, err);
        if (status)
            return status;
        if (e.tag == SEQUENCE_END || e.tag == ITEM_END) {
            depth--;
            c->explicit_vr = around[depth].explicit_vr;
            c->big = around[depth].big;
        } else if (e.length == UNDEFINED) {
            if (depth == 64)
                return vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': DICOM sequences are nested too deeply",
                                c->name);
            around[depth++] = *c;
            enter(c, &e);
        } else if (e.length > c->size - c->at) {
            return truncated(c, err);
        } else {
            c->at += e.length; /* an element, or an item of known length with all that is in it */
        }
    }
    return VOL_OK;
}

static VolStatus skip_value(Cursor *c, const Element *e, VolError *err)
{
    if (e->length == UNDEFINED)
        return skip_undefined(c, e, err);
    if (e->length > c->size - c->at)
        return truncated(c, err);
    c->at += e->length;
    return VOL_OK;
}

/* Text of a value without the padding. */
static void copy_text(const Element *e, char *out, size_t size)
{
    size_t n = e->length < size - 1 ? e->length : size - 1, skip = 0;
    while (skip < n && e->value[skip] == ' ')
        skip++;
    while (n > skip && (e->value[n - 1] == ' ' || e->value[n - 1] == 0))
        n--;
    memcpy(out, e->value + skip, n - skip);
    out[n - skip] = 0;
}

/* The number at *at, which moves behind the backslash that ends it; false: none. */
static bool next_decimal(const unsigned char **at, const unsigned char *end, double *out)
{
    const unsigned char *stop = memchr(*at, '\\', (size_t)(end - *at));
    Element one = {.value = *at, .length = (uint32_t)((stop ? stop : end) - *at)};
    char text[64], *rest;
    copy_text(&one, text, sizeof text);
    *out = strtod(text, &rest);
    *at = stop ? stop + 1 : end;
    return rest != text && isfinite(*out);
}

/* "1.5\2.25": whether there are `count` numbers; `out` is left alone where there are not. */
static bool decimals(const Element *e, double *out, int count)
{
    double numbers[6];
    const unsigned char *at = e->value, *end = e->value + e->length;
    for (int i = 0; i < count; i++)
        if (!next_decimal(&at, end, &numbers[i]))
            return false;
    memcpy(out, numbers, (size_t)count * sizeof *out);
    return true;
}

/* "0\3\6 ...": any number of them. */
static VolStatus decimal_list(const Element *e, double **out, size_t *count, VolError *err)
{
    const unsigned char *at = e->value, *end = e->value + e->length;
    free(*out);
    *out = NULL;
    *count = 0;
    if (at == end)
        return VOL_OK;
    size_t most = 1;
    for (size_t i = 0; i < e->length; i++)
        most += at[i] == '\\' ? 1 : 0;
    *out = vol_alloc(most, sizeof **out);
    if (!*out)
        return vol_fail_memory(err, most * sizeof **out);
    while (*count < most && next_decimal(&at, end, &(*out)[*count]))
        (*count)++;
    return VOL_OK;
}

static uint32_t short_of(const Cursor *c, const Element *e)
{
    return e->length >= 2 ? vol_get_u16(e->value, c->big && strcmp(e->vr, "UN") != 0) : 0;
}

static int64_t whole_of(const Element *e)
{
    double number;
    return decimals(e, &number, 1) && number > -1e9 && number < 1e9 ? (int64_t)number : 0;
}

/* What may be said once or frame by frame. */
static void take_place(const Cursor *c, const Element *e, DicomPlace *out)
{
    const size_t most = sizeof out->dimension / sizeof *out->dimension;
    bool big = c->big && strcmp(e->vr, "UN") != 0;
    switch (e->tag) {
    case TAG(0x0018, 0x0050): decimals(e, &out->thickness, 1); break;
    case TAG(0x0018, 0x0088): decimals(e, &out->between, 1); break;
    case TAG(0x0020, 0x0032):
    case TAG(0x0020, 0x9301): out->has_position = decimals(e, out->position, 3); break;
    case TAG(0x0020, 0x0037):
    case TAG(0x0020, 0x9302): decimals(e, out->orientation, 6); break;
    case TAG(0x0020, 0x0100): out->time = whole_of(e); break;
    case TAG(0x0020, 0x9056): copy_text(e, out->stack, sizeof out->stack); break;
    case TAG(0x0020, 0x9128): out->time = e->length >= 4 ? vol_get_u32(e->value, big) : 0; break;
    case TAG(0x0020, 0x9157):
        for (size_t i = 0; i < most; i++)
            out->dimension[i] = e->length >= 4 * i + 4 ? vol_get_u32(e->value + 4 * i, big) : 0;
        break;
    case TAG(0x0028, 0x0030): decimals(e, out->spacing, 2); break;
    case TAG(0x0028, 0x1052): decimals(e, &out->intercept, 1); break;
    case TAG(0x0028, 0x1053): decimals(e, &out->slope, 1); break;
    case TAG(0x3004, 0x000e): decimals(e, &out->slope, 1); break; /* Dose Grid Scaling */
    default: break;
    }
}

/* The vectors of nuclear medicine say what a frame is of; only that of slices may count up. */
static void take_vector(const Cursor *c, const Element *e, DicomFile *out)
{
    const struct {
        uint32_t tag;
        const char *what;
    } vectors[] = {{TAG(0x0054, 0x0010), "energy windows"},  {TAG(0x0054, 0x0020), "detectors"},
                   {TAG(0x0054, 0x0030), "phases"},          {TAG(0x0054, 0x0050), "rotations"},
                   {TAG(0x0054, 0x0060), "R-R intervals"},   {TAG(0x0054, 0x0070), "time slots"},
                   {TAG(0x0054, 0x0090), "angular views"},   {TAG(0x0054, 0x0100), "time slices"},
                   {TAG(0x0054, 0x0080), "slices in an order of their own"}};
    const size_t count = sizeof vectors / sizeof *vectors;
    bool big = c->big && strcmp(e->vr, "UN") != 0;
    for (size_t v = 0; v < count; v++) {
        uint32_t step = v + 1 == count ? 1 : 0;
        for (size_t i = 1; vectors[v].tag == e->tag && i < e->length / 2; i++)
            if (vol_get_u16(e->value + 2 * i, big) != vol_get_u16(e->value + 2 * i - 2, big) + step)
                out->varies = vectors[v].what;
    }
}

/* Siemens: many slices as one picture. */
static void take_mosaic(const Cursor *c, const Element *e, DicomFile *out)
{
    char text[256];
    copy_text(e, text, sizeof text);
    if (e->tag == TAG(0x0008, 0x0008))
        out->mosaic = out->mosaic || strstr(text, "MOSAIC") != NULL;
    else if (e->tag >> 16 == 0x0019 && (e->tag & 0xff00) == 0 && strcmp(text, "SIEMENS MR HEADER") == 0)
        out->private_block = (e->tag & 0xff) << 8;
    else if (out->private_block && e->tag == TAG(0x0019, out->private_block | 0x0a))
        out->mosaic = out->mosaic || short_of(c, e) > 1;
}

static void take_frame_pointer(const Cursor *c, const Element *e, DicomFile *out)
{
    bool big = c->big && strcmp(e->vr, "UN") != 0;
    for (size_t i = 0; i + 4 <= e->length; i += 4) {
        uint32_t group = vol_get_u16(e->value + i, big), element = vol_get_u16(e->value + i + 2, big);
        uint32_t tag = TAG(group, element);
        out->cine = out->cine || tag == TAG(0x0018, 0x1063) || tag == TAG(0x0018, 0x1065);
    }
}

static VolStatus take_element(const Cursor *c, const Element *e, DicomFile *out, VolError *err)
{
    double number;
    take_place(c, e, &out->common);
    if (e->tag >> 16 == 0x0054)
        take_vector(c, e, out);
    if (e->tag >> 16 == 0x0019 || e->tag == TAG(0x0008, 0x0008))
        take_mosaic(c, e, out);
    switch (e->tag) {
    case TAG(0x0008, 0x0016): copy_text(e, out->kind, sizeof out->kind); break;
    case TAG(0x0008, 0x103e): copy_text(e, out->description, sizeof out->description); break;
    case TAG(0x0020, 0x000e): copy_text(e, out->series, sizeof out->series); break;
    case TAG(0x0020, 0x0011): copy_text(e, out->number, sizeof out->number); break;
    case TAG(0x0020, 0x0013):
        out->instance = whole_of(e);
        out->has_instance = decimals(e, &number, 1);
        break;
    case TAG(0x0028, 0x0002): out->samples = short_of(c, e); break;
    case TAG(0x0028, 0x0004): copy_text(e, out->photometric, sizeof out->photometric); break;
    case TAG(0x0028, 0x0008):
        out->frames = decimals(e, &number, 1) && number >= 1 && number < 1e6 ? (uint32_t)number : 0;
        break;
    case TAG(0x0028, 0x0009): take_frame_pointer(c, e, out); break;
    case TAG(0x0028, 0x0010): out->rows = short_of(c, e); break;
    case TAG(0x0028, 0x0011): out->columns = short_of(c, e); break;
    case TAG(0x0028, 0x0100): out->bits_allocated = short_of(c, e); break;
    case TAG(0x0028, 0x0101): out->bits_stored = short_of(c, e); break;
    case TAG(0x0028, 0x0102): out->high_bit = short_of(c, e); break;
    case TAG(0x0028, 0x0103): out->is_signed = short_of(c, e) == 1; break;
    case TAG(0x3004, 0x000c): return decimal_list(e, &out->offsets, &out->offset_count, err);
    default: break;
    }
    return VOL_OK;
}

/* What the items of a sequence are. */
typedef enum Level { SHARED_GROUPS, FRAME_GROUPS, MACRO, DETECTOR, MODALITY_LUT } Level;

static void take_lut(const Cursor *c, const Element *e, DicomLut *out)
{
    bool big = c->big && strcmp(e->vr, "UN") != 0;
    out->there = true;
    if (e->tag == TAG(0x0028, 0x3002) && e->length >= 6) {
        out->described = true;
        out->entries = vol_get_u16(e->value, big);
        out->first = vol_get_u16(e->value + 2, big);
        out->bits = vol_get_u16(e->value + 4, big);
        out->is_signed = strcmp(e->vr, "SS") == 0;
    } else if (e->tag == TAG(0x0028, 0x3006)) {
        out->data = e->value;
        out->size = e->length;
        out->big = big;
        out->swapped = big && strcmp(e->vr, "OW") == 0;
    }
}

static bool is_sequence(const Element *e)
{
    return !e->vr[0] || strcmp(e->vr, "SQ") == 0 || strcmp(e->vr, "UN") == 0;
}

static bool is_macro(uint32_t tag)
{
    const uint32_t macros[] = {TAG(0x0020, 0x9111),  /* Frame Content */
                               TAG(0x0020, 0x9113),  /* Plane Position (Patient) */
                               TAG(0x0020, 0x9116),  /* Plane Orientation (Patient) */
                               TAG(0x0020, 0x930e),  /* Plane Position (Volume) */
                               TAG(0x0020, 0x930f),  /* Plane Orientation (Volume) */
                               TAG(0x0028, 0x9110),  /* Pixel Measures */
                               TAG(0x0028, 0x9145)}; /* Pixel Value Transformation */
    for (size_t i = 0; i < sizeof macros / sizeof *macros; i++)
        if (macros[i] == tag)
            return true;
    return false;
}

static VolStatus read_items(Cursor *c, const Element *e, Level level, DicomFile *file, DicomPlace *place,
                            VolError *err);

/* The elements of an item, which ends with the cursor's bytes or (`open`) with a delimiter. */
static VolStatus read_item(Cursor *c, bool open, Level level, DicomFile *file, DicomPlace *place, VolError *err)
{
    while (c->at < c->size) {
        Element e;
        VolStatus status = read_head(c, &e, err);
        if (status)
            return status;
        if (open && e.tag == ITEM_END)
            return VOL_OK;
        bool groups = level == SHARED_GROUPS || level == FRAME_GROUPS;
        file->real_world = file->real_world || e.tag == TAG(0x0040, 0x9096);
        if (groups && is_macro(e.tag) && is_sequence(&e))
            status = read_items(c, &e, MACRO, file, place, err);
        else
            status = skip_value(c, &e, err);
        if (status)
            return status;
        if (groups || e.length == UNDEFINED)
            continue;
        if (level == MODALITY_LUT) {
            if (place == &file->common) /* the first item */
                take_lut(c, &e, &file->lut);
            continue;
        }
        bool position = e.tag == TAG(0x0020, 0x0032) || e.tag == TAG(0x0020, 0x9301);
        if (level == MACRO || position || e.tag == TAG(0x0020, 0x0037))
            take_place(c, &e, place);
        file->groups_placed = file->groups_placed || (level == MACRO && position);
        file->frames_placed = file->frames_placed || file->groups_placed;
    }
    return open ? truncated(c, err) : VOL_OK;
}

/* Item n of the groups of frames is frame n's, which starts from what holds for all. */
static VolStatus next_frame(const Cursor *c, size_t n, DicomFile *file, VolError *err)
{
    if (n >= file->frames)
        return vol_fail(err, VOL_BAD_INPUT,
                        "cannot import '%s': functional groups of more frames than the %u that there are", c->name,
                        (unsigned)file->frames);
    if ((n & (n - 1)) == 0) {
        DicomPlace *longer = vol_resize(file->each, n ? 2 * n : 1, sizeof *longer);
        if (!longer)
            return vol_fail_memory(err, 2 * n * sizeof *longer);
        file->each = longer;
    }
    file->each[n] = file->common;
    file->each_count = n + 1;
    return VOL_OK;
}

static VolStatus read_items(Cursor *c, const Element *e, Level level, DicomFile *file, DicomPlace *place,
                            VolError *err)
{
    Cursor in = *c;
    bool open = e->length == UNDEFINED;
    if (!open && e->length > c->size - c->at)
        return truncated(c, err);
    if (!open)
        in.size = c->at + e->length;
    enter(&in, e);
    for (size_t n = 0; open || in.at < in.size; n++) {
        Element item;
        VolStatus status = read_head(&in, &item, err);
        if (!status && open && item.tag == SEQUENCE_END)
            break;
        if (!status && item.tag != ITEM)
            return vol_fail(err, VOL_BAD_INPUT,
                            "cannot import '%s': at byte %zu there should be an item of a DICOM sequence", c->name,
                            in.at - 8);
        Cursor body = in;
        if (!status && item.length != UNDEFINED) {
            status = item.length > in.size - in.at ? truncated(&in, err) : VOL_OK;
            body.size = in.at + item.length;
        }
        if (!status && level == FRAME_GROUPS)
            status = next_frame(c, n, file, err);
        DicomPlace unused = {.slope = 1}; /* only the first item of a macro counts */
        DicomPlace *target = level == FRAME_GROUPS ? file->each + n : n == 0 ? place : &unused;
        if (!status)
            status = read_item(&body, item.length == UNDEFINED, level, file, target, err);
        if (status)
            return status;
        in.at = body.at;
    }
    c->at = in.at;
    return VOL_OK;
}

/* Explicit little endian group 2, which names the syntax of the rest.  All syntaxes but two are explicit little
 * endian as far as the pixels. */
static VolStatus read_file_meta(Cursor *c, DicomFile *out, VolError *err)
{
    memcpy(out->syntax, "1.2.840.10008.1.2", 18);
    c->explicit_vr = true;
    while (c->size - c->at >= 8 && vol_get_u16(c->data + c->at, false) == 2) {
        Element e;
        VolStatus status = read_head(c, &e, err);
        if (!status && e.length > c->size - c->at)
            status = truncated(c, err);
        if (status)
            return status;
        if (e.tag == TAG(0x0002, 0x0010))
            copy_text(&e, out->syntax, sizeof out->syntax);
        if (e.tag == TAG(0x0002, 0x0002))
            copy_text(&e, out->kind, sizeof out->kind);
        c->at += e.length;
    }
    c->explicit_vr = strcmp(out->syntax, "1.2.840.10008.1.2") != 0;
    c->big = strcmp(out->syntax, "1.2.840.10008.1.2.2") == 0;
    return VOL_OK;
}

bool vol_dicom_start(const VolBytes *bytes, size_t *start)
{
    const unsigned char *p = bytes->data;
    /* Group 2 begins with its length, version or class, the syntax, always in this form. */
    static const struct {
        unsigned char element;
        char vr[3];
    } first[] = {{0x00, "UL"}, {0x01, "OB"}, {0x02, "UI"}, {0x03, "UI"}, {0x10, "UI"}};
    bool marked = bytes->size >= 132 && memcmp(p + 128, "DICM", 4) == 0, bare = false;
    for (size_t i = 0; !marked && bytes->size >= 132 && i < sizeof first / sizeof *first; i++)
        bare = bare || (vol_get_u32(p, false) == TAG(first[i].element, 2) && memcmp(p + 4, first[i].vr, 2) == 0);
    *start = marked ? 132 : 0;
    return marked || bare;
}

VolStatus vol_dicom_unpack(VolBytes *bytes, const char *name, VolError *err)
{
    Cursor c = {.data = bytes->data, .size = bytes->size, .name = name};
    DicomFile file;
    vol_dicom_start(bytes, &c.at);
    VolStatus status = read_file_meta(&c, &file, err);
    if (status || strcmp(file.syntax, "1.2.840.10008.1.2.1.99") != 0)
        return status;
    VolBytes rest = {0};
    status = vol_inflate(bytes->data + c.at, bytes->size - c.at, name, &rest, err);
    unsigned char *whole = status ? NULL : vol_alloc(c.at + rest.size, 1);
    if (!status && !whole)
        status = vol_fail_memory(err, c.at + rest.size);
    if (!status) {
        memcpy(whole, bytes->data, c.at);
        if (rest.size)
            memcpy(whole + c.at, rest.data, rest.size);
        vol_bytes_free(bytes);
        *bytes = (VolBytes){whole, c.at + rest.size};
    }
    vol_bytes_free(&rest);
    return status;
}

/* The pixels end the walk. */
static VolStatus take_pixels(const Cursor *c, const Element *e, DicomFile *out, VolError *err)
{
    out->encapsulated = e->length == UNDEFINED;
    if (!out->encapsulated && e->length > c->size - c->at)
        return truncated(c, err);
    out->pixels = e->value;
    out->pixel_bytes = out->encapsulated ? 0 : e->length;
    out->sample = e->tag == TAG(0x7fe0, 0x0008)   ? DICOM_FLOAT
                  : e->tag == TAG(0x7fe0, 0x0009) ? DICOM_DOUBLE
                                                  : DICOM_INTEGER;
    out->swapped = c->big && out->bits_allocated == 8 && strcmp(e->vr, "OW") == 0;
    return VOL_OK;
}

/* RT Dose: offsets of the frames along the normal from the first one, or (the first is not 0) places along z. */
static VolStatus place_offsets(DicomFile *file, VolError *err)
{
    const double *o = file->common.orientation;
    VolVec3 normal = vol_cross(vol_vec3(o[0], o[1], o[2]), vol_vec3(o[3], o[4], o[5]));
    if (file->offset_count != file->frames)
        return vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': %zu Grid Frame Offsets for %u frames", file->name,
                        file->offset_count, (unsigned)file->frames);
    bool along_z = file->offsets[0] != 0;
    if (along_z && fabs(normal.z) < 0.999)
        return vol_fail(err, VOL_BAD_INPUT,
                        "cannot import '%s': Grid Frame Offsets that do not begin with 0 are places along z, but "
                        "the frames are tilted",
                        file->name);
    file->each = vol_alloc(file->frames, sizeof *file->each);
    if (!file->each)
        return vol_fail_memory(err, file->frames * sizeof *file->each);
    file->each_count = file->frames;
    file->frames_placed = true;
    for (size_t n = 0; n < file->frames; n++) {
        DicomPlace *place = &file->each[n];
        *place = file->common;
        double by = file->offsets[n];
        place->has_position = true; /* the first is at 0, 0, 0 where nothing else is said */
        place->position[0] += along_z ? 0 : by * normal.x;
        place->position[1] += along_z ? 0 : by * normal.y;
        place->position[2] = along_z ? by : place->position[2] + by * normal.z;
    }
    return VOL_OK;
}

void vol_dicom_free(DicomFile *file)
{
    free(file->each);
    free(file->offsets);
    file->each = NULL;
    file->offsets = NULL;
}

static VolStatus read_element(Cursor *c, DicomFile *out, VolError *err)
{
    Element e;
    VolStatus status = read_head(c, &e, err);
    if (status)
        return status;
    switch (e.tag) {
    case TAG(0x7fe0, 0x0008):
    case TAG(0x7fe0, 0x0009):
    case TAG(0x7fe0, 0x0010): return take_pixels(c, &e, out, err);
    case TAG(0x5200, 0x9229):
        if (out->each)
            return vol_fail(err, VOL_BAD_INPUT,
                            "cannot import '%s': shared functional groups come after those of frames", c->name);
        return read_items(c, &e, SHARED_GROUPS, out, &out->common, err);
    case TAG(0x5200, 0x9230):
        if (out->each)
            return vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': functional groups of frames come twice",
                            c->name);
        return read_items(c, &e, FRAME_GROUPS, out, NULL, err);
    case TAG(0x0028, 0x3000): return read_items(c, &e, MODALITY_LUT, out, &out->common, err);
    case TAG(0x0054, 0x0022): return read_items(c, &e, DETECTOR, out, &out->common, err);
    default: break;
    }
    out->real_world = out->real_world || e.tag == TAG(0x0040, 0x9096);
    status = skip_value(c, &e, err);
    return status || e.length == UNDEFINED ? status : take_element(c, &e, out, err);
}

VolStatus vol_dicom_parse(const VolBytes *bytes, const char *name, DicomFile *out, VolError *err)
{
    Cursor c = {.data = bytes->data, .size = bytes->size, .name = name};
    vol_dicom_start(bytes, &c.at);
    *out = (DicomFile){.name = name,
                       .frames = 1,
                       .samples = 1,
                       .common = {.slope = 1, .orientation = {1, 0, 0, 0, 1, 0}}};
    VolStatus status = read_file_meta(&c, out, err);
    out->big_endian = c.big;
    while (!status && c.at < c.size && !out->pixels)
        status = read_element(&c, out, err);
    if (!status && out->pixels && out->offsets && !out->each && out->frames > 1)
        status = place_offsets(out, err);
    return status;
}
