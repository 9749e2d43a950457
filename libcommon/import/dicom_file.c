/* The walk through the data elements of a DICOM file (PS3.5 section 7): tag, in explicit syntaxes the type (VR),
 * length, value.  Sequences are passed over, so that only the image's own elements are seen. */
#include <stdlib.h>
#include <string.h>

#include "import/dicom.h"

#define UNDEFINED UINT32_C(0xffffffff)
#define TAG(group, element) ((uint32_t)(group) << 16 | (element))

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

/* Moves over a value of undefined length: nested elements up to the delimiter that closes it. */
static VolStatus skip_undefined(Cursor *c, VolError *err)
{
    for (int depth = 1; depth > 0;) {
        Element e;
        VolStatus status = read_head(c, &e, err);
        if (status)
            return status;
        if (e.tag == TAG(0xfffe, 0xe0dd) || e.tag == TAG(0xfffe, 0xe00d)) {
            depth--;
        } else if (e.length == UNDEFINED) {
            if (++depth > 64)
                return vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': DICOM sequences are nested too deeply",
                                c->name);
        } else if (e.length > c->size - c->at) {
            return truncated(c, err);
        } else {
            c->at += e.length; /* an element, or an item of known length with all that is in it */
        }
    }
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

/* "1.5\2.25": the number of values, or 0 where there are not `count`. */
static int decimals(const Element *e, double *out, int count)
{
    char text[256];
    copy_text(e, text, sizeof text);
    char *at = text;
    for (int i = 0; i < count; i++) {
        char *end;
        out[i] = strtod(at, &end);
        if (end == at || (i + 1 < count && *end != '\\'))
            return 0;
        at = end + 1;
    }
    return count;
}

static uint32_t short_of(const Cursor *c, const Element *e)
{
    return e->length >= 2 ? vol_get_u16(e->value, c->big) : 0;
}

static void take_element(const Cursor *c, const Element *e, DicomSlice *out)
{
    double number;
    switch (e->tag) {
    case TAG(0x0018, 0x0050): decimals(e, &out->thickness, 1); break;
    case TAG(0x0018, 0x0088): decimals(e, &out->between, 1); break;
    case TAG(0x0008, 0x103e): copy_text(e, out->description, sizeof out->description); break;
    case TAG(0x0020, 0x000e): copy_text(e, out->series, sizeof out->series); break;
    case TAG(0x0020, 0x0011): copy_text(e, out->number, sizeof out->number); break;
    case TAG(0x0020, 0x0013):
        out->instance = decimals(e, &number, 1) && number > -1e9 && number < 1e9 ? (int64_t)number : 0;
        break;
    case TAG(0x0020, 0x0032): out->has_position = decimals(e, out->position, 3) == 3; break;
    case TAG(0x0020, 0x0037): decimals(e, out->orientation, 6); break;
    case TAG(0x0028, 0x0002): out->samples = short_of(c, e); break;
    case TAG(0x0028, 0x0008):
        out->frames = decimals(e, &number, 1) && number >= 1 && number < 1e6 ? (uint32_t)number : 0;
        break;
    case TAG(0x0028, 0x0010): out->rows = short_of(c, e); break;
    case TAG(0x0028, 0x0011): out->columns = short_of(c, e); break;
    case TAG(0x0028, 0x0030): decimals(e, out->spacing, 2); break;
    case TAG(0x0028, 0x0100): out->bits_allocated = short_of(c, e); break;
    case TAG(0x0028, 0x0101): out->bits_stored = short_of(c, e); break;
    case TAG(0x0028, 0x0102): out->high_bit = short_of(c, e); break;
    case TAG(0x0028, 0x0103): out->is_signed = short_of(c, e) == 1; break;
    case TAG(0x0028, 0x1052): decimals(e, &out->intercept, 1); break;
    case TAG(0x0028, 0x1053): decimals(e, &out->slope, 1); break;
    case TAG(0x7fe0, 0x0010):
        out->pixels = e->value;
        out->pixel_bytes = e->length;
        break;
    default: break;
    }
}

/* Explicit little endian group 2, which names the syntax of the rest. */
static VolStatus read_file_meta(Cursor *c, VolError *err)
{
    char syntax[80] = "1.2.840.10008.1.2";
    c->explicit_vr = true;
    while (c->size - c->at >= 8 && vol_get_u16(c->data + c->at, false) == 2) {
        Element e;
        VolStatus status = read_head(c, &e, err);
        if (!status && e.length > c->size - c->at)
            status = truncated(c, err);
        if (status)
            return status;
        if (e.tag == TAG(0x0002, 0x0010))
            copy_text(&e, syntax, sizeof syntax);
        c->at += e.length;
    }
    c->explicit_vr = strcmp(syntax, "1.2.840.10008.1.2") != 0;
    c->big = strcmp(syntax, "1.2.840.10008.1.2.2") == 0;
    if (c->explicit_vr && !c->big && strcmp(syntax, "1.2.840.10008.1.2.1") != 0)
        return vol_fail(err, VOL_BAD_INPUT,
                        "cannot import '%s': DICOM transfer syntax %s is compressed; decompress the files first "
                        "(dcmdjpeg, gdcmconv --raw)",
                        c->name, syntax);
    return VOL_OK;
}

static VolStatus check_slice(const Cursor *c, const DicomSlice *s, VolError *err)
{
    if (s->samples != 1)
        return vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': DICOM with %u samples per pixel is not grey",
                        c->name, (unsigned)s->samples);
    bool bits = (s->bits_allocated == 8 || s->bits_allocated == 16 || s->bits_allocated == 32) &&
                s->bits_stored >= 1 && s->bits_stored <= s->bits_allocated && s->high_bit < s->bits_allocated &&
                s->high_bit + 1 >= s->bits_stored;
    if (!s->columns || !s->frames || !bits)
        return vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': DICOM size or bits are impossible", c->name);
    size_t wanted = (size_t)s->rows * s->columns * s->frames * (s->bits_allocated / 8);
    if (s->pixel_bytes < wanted)
        return vol_fail(err, VOL_BAD_INPUT,
                        "cannot import '%s': truncated: the pixels are %zu bytes, there are %zu", c->name, wanted,
                        s->pixel_bytes);
    return VOL_OK;
}

VolStatus vol_dicom_parse(const VolBytes *bytes, const char *name, DicomSlice *out, VolError *err)
{
    Cursor c = {.data = bytes->data, .size = bytes->size, .at = 132, .name = name};
    *out = (DicomSlice){.name = name, .frames = 1, .samples = 1, .slope = 1, .orientation = {1, 0, 0, 0, 1, 0}};
    VolStatus status = read_file_meta(&c, err);
    out->big_endian = c.big;
    while (!status && c.at < c.size) {
        Element e;
        status = read_head(&c, &e, err);
        if (status)
            break;
        if (e.tag == TAG(0x7fe0, 0x0010) && e.length == UNDEFINED)
            return vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': the DICOM pixels are compressed", name);
        if (e.length == UNDEFINED) {
            bool explicit_vr = c.explicit_vr;
            c.explicit_vr =
                explicit_vr && strcmp(e.vr, "UN") != 0; /* what was unknown is nested in implicit form */
            status = skip_undefined(&c, err);
            c.explicit_vr = explicit_vr;
        } else if (e.length > c.size - c.at) {
            status = truncated(&c, err);
        } else {
            take_element(&c, &e, out);
            c.at += e.length;
        }
    }
    if (!status && !out->pixels)
        out->rows = 0;
    return status || !out->rows ? status : check_slice(&c, out, err);
}
