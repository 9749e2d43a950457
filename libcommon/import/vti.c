/* The elements of a .vti. */
#include "import/vti.h"

#include <expat.h>
#include <limits.h>
#include <stdlib.h>
#include <string.h>

#include "base/refusals.h"

#define CHUNK ((size_t)1 << 20)

typedef struct Parser {
    XML_Parser expat;
    Vti *vti;
    int depth;
    bool in_image, image_seen, in_piece; /* inside the first ImageData, one of its pieces */
    bool in_set, cells;                  /* inside PointData or CellData */
    int set_depth;
    bool finished; /* at the appended data */
    bool refused;  /* err says why */
    VolStatus status;
    VolError *err;
} Parser;

int vol_vti_integers(const char *text, int64_t *out, int max)
{
    for (int n = 0; n < max; n++) {
        char *end;
        long long value = strtoll(text, &end, 10);
        if (end == text || value < INT_MIN || value > INT_MAX)
            return n;
        out[n] = value;
        text = end;
    }
    return max;
}

int vol_vti_reals(const char *text, double *out, int max)
{
    for (int n = 0; n < max; n++) {
        char *end;
        double value = strtod(text, &end);
        if (end == text)
            return n;
        if (out)
            out[n] = value;
        text = end;
    }
    return max;
}

static void fail(Parser *p, VolStatus status)
{
    if (!p->refused)
        p->status = status;
    p->refused = true;
    XML_StopParser(p->expat, XML_FALSE);
}

static const char *attribute(const char **attributes, const char *key)
{
    for (size_t i = 0; attributes[i]; i += 2)
        if (strcmp(attributes[i], key) == 0)
            return attributes[i + 1];
    return NULL;
}

static bool is(const char *text, const char *word) { return text && strcmp(text, word) == 0; }

/* A copy that is NULL where `text` is; want of memory stops the parser. */
static char *keep(Parser *p, const char *text)
{
    char *copy = text ? vol_copy_text(text) : NULL;
    if (text && !copy)
        fail(p, vol_fail_memory(p->err, strlen(text) + 1));
    return copy;
}

static size_t tag_end(const Parser *p)
{
    size_t end = (size_t)XML_GetCurrentByteIndex(p->expat) + (size_t)XML_GetCurrentByteCount(p->expat);
    return end < p->vti->bytes->size ? end : p->vti->bytes->size;
}

/* ---- The elements, from the outermost ---- */

static void start_file(Parser *p, const char **attributes)
{
    Vti *vti = p->vti;
    const char *kind = attribute(attributes, "type");
    if (!is(kind, "ImageData")) {
        fail(p, kind ? vol_fail(p->err, VOL_BAD_INPUT,
                                "cannot import '%s': VTK files of kind '%.60s' are "
                                "not read in this version (ImageData are)",
                                vti->file, kind)
                     : vol_fail(p->err, VOL_BAD_INPUT,
                                "cannot import '%s': the VTKFile element does not "
                                "say what it holds: it has no type",
                                vti->file));
        return;
    }
    const char *order = attribute(attributes, "byte_order"), *header = attribute(attributes, "header_type");
    const char *packing = attribute(attributes, "compressor");
    const uint16_t one = 1;
    vti->big_endian = order ? is(order, "BigEndian") : *(const unsigned char *)&one == 0;
    vti->word = is(header, "UInt64") ? 8 : 4;
    vti->packing = is(packing, "vtkZLibDataCompressor")   ? VTI_ZLIB
                   : is(packing, "vtkLZ4DataCompressor")  ? VTI_LZ4
                   : is(packing, "vtkLZMADataCompressor") ? VTI_LZMA
                                                          : VTI_PLAIN;
    const char *key = order && !vti->big_endian && !is(order, "LittleEndian") ? "byte_order"
                      : header && vti->word == 4 && !is(header, "UInt32")     ? "header_type"
                      : packing && vti->packing == VTI_PLAIN                  ? "compressor"
                                                                              : NULL;
    if (key)
        fail(p, vol_fail(p->err, VOL_BAD_INPUT, "cannot import '%s': %s=\"%.60s\" is not known", vti->file, key,
                         attribute(attributes, key)));
}

static void start_image(Parser *p, const char **attributes)
{
    Vti *vti = p->vti;
    const char *extent = attribute(attributes, "WholeExtent"), *origin = attribute(attributes, "Origin");
    const char *spacing = attribute(attributes, "Spacing"), *direction = attribute(attributes, "Direction");
    const char *times = attribute(attributes, "TimeValues");
    p->in_image = p->image_seen = true;
    if (!extent || vol_vti_integers(extent, vti->whole.extent, 6) != 6) {
        fail(p, vol_fail(p->err, VOL_BAD_INPUT,
                         "cannot import '%s': the WholeExtent of ImageData is not "
                         "six numbers",
                         vti->file));
        return;
    }
    vti->whole.placed = true;
    for (int n = 0; n < 9; n++)
        vti->direction[n] = n % 4 == 0;
    for (int a = 0; a < 3; a++)
        vti->origin[a] = 0, vti->spacing[a] = 1;
    /* As VTK has it, what is not whole counts for nothing. */
    double given[9];
    if (origin && vol_vti_reals(origin, given, 3) == 3)
        memcpy(vti->origin, given, sizeof vti->origin);
    if (spacing && vol_vti_reals(spacing, given, 3) == 3)
        memcpy(vti->spacing, given, sizeof vti->spacing);
    if (direction && vol_vti_reals(direction, given, 9) == 9)
        memcpy(vti->direction, given, sizeof vti->direction);
    vti->times = times ? vol_vti_reals(times, NULL, INT_MAX) : 0;
}

static void start_piece(Parser *p, const char **attributes)
{
    Vti *vti = p->vti;
    if (vti->piece_count == vti->piece_capacity) {
        size_t capacity = vti->piece_capacity ? 2 * vti->piece_capacity : 16;
        VtiPiece *longer = vol_resize(vti->pieces, capacity, sizeof *longer);
        if (!longer) {
            fail(p, vol_fail_memory(p->err, capacity * sizeof *longer));
            return;
        }
        vti->pieces = longer;
        vti->piece_capacity = capacity;
    }
    VtiPiece *piece = &vti->pieces[vti->piece_count++];
    const char *extent = attribute(attributes, "Extent");
    *piece = (VtiPiece){.first_array = vti->array_count};
    piece->placed = extent && vol_vti_integers(extent, piece->extent, 6) == 6;
    p->in_piece = true;
}

/* PointData or CellData of a piece, or of an image without pieces. */
static void start_set(Parser *p, bool cells, const char **attributes)
{
    Vti *vti = p->vti;
    VtiPiece *piece = p->in_piece ? &vti->pieces[vti->piece_count - 1] : &vti->whole;
    p->in_set = true;
    p->set_depth = p->depth;
    p->cells = cells;
    free(piece->scalars[cells]);
    piece->scalars[cells] = keep(p, attribute(attributes, "Scalars"));
}

static void start_array(Parser *p, const char **attributes)
{
    Vti *vti = p->vti;
    if (vti->array_count == vti->array_capacity) {
        size_t capacity = vti->array_capacity ? 2 * vti->array_capacity : 16;
        VtiArray *longer = vol_resize(vti->arrays, capacity, sizeof *longer);
        if (!longer) {
            fail(p, vol_fail_memory(p->err, capacity * sizeof *longer));
            return;
        }
        vti->arrays = longer;
        vti->array_capacity = capacity;
    }
    VtiArray *array = &vti->arrays[vti->array_count++];
    const char *name = attribute(attributes, "Name"), *type = attribute(attributes, "type");
    const char *components = attribute(attributes, "NumberOfComponents");
    const char *offset = attribute(attributes, "offset");
    *array = (VtiArray){.piece = p->in_piece ? vti->piece_count - 1 : SIZE_MAX,
                        .cells = p->cells,
                        .components = 1,
                        .binary = is(attribute(attributes, "format"), "binary"),
                        .appended = offset != NULL,
                        .begin = tag_end(p)};
    array->name = keep(p, name ? name : "");
    array->type = keep(p, type ? type : "");
    array->steps = keep(p, attribute(attributes, "TimeStep"));
    if (components && vol_vti_integers(components, &array->components, 1) != 1)
        array->components = 1;
    if (offset)
        array->offset = strtoll(offset, NULL, 10);
}

static void XMLCALL on_start(void *user, const char *name, const char **attributes)
{
    Parser *p = user;
    if (p->refused || p->finished)
        return;
    int depth = ++p->depth;
    if (strcmp(name, "AppendedData") == 0) {
        p->vti->has_appended = p->finished = true;
        p->vti->appended = tag_end(p);
        p->vti->appended_raw = is(attribute(attributes, "encoding"), "raw");
        XML_StopParser(p->expat, XML_FALSE); /* what follows may be no XML */
    } else if (depth == 1) {
        start_file(p, attributes);
    } else if (depth == 2 && !p->image_seen && strcmp(name, "ImageData") == 0) {
        start_image(p, attributes);
    } else if (depth == 3 && p->in_image && strcmp(name, "Piece") == 0) {
        start_piece(p, attributes);
    } else if (depth == (p->in_piece ? 4 : 3) && p->in_image && strcmp(name, "PointData") == 0) {
        start_set(p, false, attributes);
    } else if (depth == (p->in_piece ? 4 : 3) && p->in_image && strcmp(name, "CellData") == 0) {
        start_set(p, true, attributes);
    } else if (p->in_set && depth == p->set_depth + 1) {
        start_array(p, attributes);
    }
}

static void XMLCALL on_end(void *user, const char *name)
{
    Parser *p = user;
    (void)name;
    int depth = p->depth--;
    if (p->in_set && depth == p->set_depth)
        p->in_set = false;
    if (depth == 3)
        p->in_piece = false;
    if (depth == 2)
        p->in_image = false;
}

/* ---- The file ---- */

/* Expat takes an int's worth at a time. */
static enum XML_Status feed(XML_Parser expat, const VolBytes *bytes)
{
    size_t at = 0;
    enum XML_Status ok = XML_STATUS_OK;
    do {
        size_t n = bytes->size - at < CHUNK ? bytes->size - at : CHUNK;
        ok = XML_Parse(expat, (const char *)bytes->data + at, (int)n, at + n == bytes->size);
        at += n;
    } while (ok == XML_STATUS_OK && at < bytes->size);
    return ok;
}

static VolStatus fail_truncated(const Vti *vti, VolError *err)
{
    return vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': truncated after %zu bytes: </VTKFile> is missing",
                    vti->file, vti->bytes->size);
}

static VolStatus judge_xml(const Parser *p, VolError *err)
{
    enum XML_Error code = XML_GetErrorCode(p->expat);
    if (code == XML_ERROR_NO_MEMORY)
        return vol_fail_memory(err, p->vti->bytes->size);
    if (code == XML_ERROR_NO_ELEMENTS || code == XML_ERROR_UNCLOSED_TOKEN || code == XML_ERROR_PARTIAL_CHAR ||
        code == XML_ERROR_UNCLOSED_CDATA_SECTION)
        return fail_truncated(p->vti, err);
    return vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': damaged: line %lu: %s", p->vti->file,
                    (unsigned long)XML_GetCurrentLineNumber(p->expat), XML_ErrorString(code));
}

/* Offsets count from behind the underscore, which white space may precede; a file that was cut lacks its last tag.
 * */
static VolStatus find_appended(Vti *vti, VolError *err)
{
    static const char tag[] = "</VTKFile>";
    const VolBytes *bytes = vti->bytes;
    bool closed = false;
    for (size_t at = bytes->size; !closed && at >= vti->appended + strlen(tag); at--)
        closed = memcmp(bytes->data + at - strlen(tag), tag, strlen(tag)) == 0;
    if (!closed)
        return fail_truncated(vti, err);
    while (vti->appended < bytes->size && vol_vtk_space(bytes->data[vti->appended]))
        vti->appended++;
    if (vti->appended < bytes->size && bytes->data[vti->appended] == '_')
        vti->appended++;
    return VOL_OK;
}

/* Without pieces the image itself is one. */
static VolStatus settle_pieces(Parser *p, VolError *err)
{
    Vti *vti = p->vti;
    if (!p->image_seen)
        return vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': the VTK file has no element ImageData",
                        vti->file);
    for (size_t i = 0; i < vti->piece_count; i++)
        if (!vti->pieces[i].placed)
            return vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': the Extent of piece %zu is not six numbers",
                            vti->file, i + 1);
    if (vti->piece_count)
        return VOL_OK;
    vti->pieces = vol_alloc(1, sizeof *vti->pieces);
    if (!vti->pieces)
        return vol_fail_memory(err, sizeof *vti->pieces);
    vti->piece_count = vti->piece_capacity = 1;
    vti->pieces[0] = vti->whole;
    vti->whole.scalars[0] = vti->whole.scalars[1] = NULL;
    for (size_t i = 0; i < vti->array_count; i++)
        vti->arrays[i].piece = 0;
    return VOL_OK;
}

VolStatus vol_vti_parse(const VolBytes *bytes, const char *file, Vti *out, VolError *err)
{
    static const XML_Memory_Handling_Suite memory = {vol_library_alloc, vol_library_resize, free};
    *out = (Vti){.bytes = bytes, .file = file, .word = 4};
    Parser p = {.expat = XML_ParserCreate_MM(NULL, &memory, NULL), .vti = out, .err = err};
    if (!p.expat)
        return vol_fail_memory(err, bytes->size);
    XML_SetUserData(p.expat, &p);
    XML_SetElementHandler(p.expat, on_start, on_end);
    VolStatus status = VOL_OK;
    if (feed(p.expat, bytes) != XML_STATUS_OK)
        status = p.refused ? p.status : p.finished ? find_appended(out, err) : judge_xml(&p, err);
    if (!status)
        status = settle_pieces(&p, err);
    XML_ParserFree(p.expat);
    if (status)
        vol_vti_free(out);
    return status;
}

void vol_vti_free(Vti *vti)
{
    for (size_t i = 0; i < vti->array_count; i++) {
        free(vti->arrays[i].name);
        free(vti->arrays[i].type);
        free(vti->arrays[i].steps);
    }
    for (size_t i = 0; i < vti->piece_count; i++) {
        free(vti->pieces[i].scalars[0]);
        free(vti->pieces[i].scalars[1]);
    }
    free(vti->whole.scalars[0]);
    free(vti->whole.scalars[1]);
    free(vti->arrays);
    free(vti->pieces);
    *vti = (Vti){0};
}
