/* VTK's image files: how they are told. */
#include <string.h>
#include <strings.h>

#include "import/vti.h"

static bool begins(const VolBytes *bytes, size_t at, const char *text)
{
    size_t n = strlen(text);
    return at <= bytes->size && bytes->size - at >= n && memcmp(bytes->data + at, text, n) == 0;
}

/* Behind the next `text`; the end where there is none. */
static size_t behind(const VolBytes *bytes, size_t at, const char *text)
{
    for (; at < bytes->size; at++)
        if (begins(bytes, at, text))
            return at + strlen(text);
    return bytes->size;
}

/* Behind a document type declaration that begins at `at`: quoted texts, comments and the brackets of its own
 * declarations may hold any '>'. */
static size_t skip_doctype(const VolBytes *bytes, size_t at)
{
    bool within = false;
    while (at < bytes->size) {
        char c = (char)bytes->data[at];
        char quote[2] = {c, 0};
        if (c == '>' && !within)
            return at + 1;
        if (c == '"' || c == '\'')
            at = behind(bytes, at + 1, quote);
        else if (begins(bytes, at, "<!--"))
            at = behind(bytes, at + 4, "-->");
        else
            at++;
        within = c == '[' || (within && c != ']');
    }
    return at;
}

/* Where the root element of an XML file begins: behind declarations, instructions and comments. */
static size_t find_root(const VolBytes *bytes)
{
    size_t at = begins(bytes, 0, "\xef\xbb\xbf") ? 3 : 0; /* byte order mark */
    for (;;) {
        while (at < bytes->size && vol_vtk_space(bytes->data[at]))
            at++;
        if (begins(bytes, at, "<!--"))
            at = behind(bytes, at + 4, "-->");
        else if (begins(bytes, at, "<?"))
            at = behind(bytes, at, "?>");
        else if (begins(bytes, at, "<!DOCTYPE"))
            at = skip_doctype(bytes, at);
        else
            return at;
    }
}

bool vol_is_vtk_xml(const VolBytes *bytes)
{
    static const char tag[] = "<VTKFile";
    size_t root = find_root(bytes), end = root + strlen(tag);
    return begins(bytes, root, tag) && end < bytes->size &&
           (vol_vtk_space(bytes->data[end]) || bytes->data[end] == '>' || bytes->data[end] == '/');
}

bool vol_is_vtk_legacy(const VolBytes *bytes)
{
    return bytes->size > 14 && memcmp(bytes->data, "# vtk DataFile", 14) == 0;
}

/* The value of `type` in the tag that begins at `at`. */
static void xml_type(const VolBytes *bytes, size_t at, char *type, size_t size)
{
    type[0] = 0;
    while (at < bytes->size && bytes->data[at] != '>') {
        bool named = vol_vtk_space(bytes->data[at]) && begins(bytes, at + 1, "type");
        at += named ? 5 : 1;
        while (named && at < bytes->size && (vol_vtk_space(bytes->data[at]) || bytes->data[at] == '='))
            at++;
        char quote[2] = {at < bytes->size ? (char)bytes->data[at] : 0, 0};
        if (quote[0] != '"' && quote[0] != '\'')
            continue;
        size_t end = behind(bytes, at + 1, quote), n = end - at - (end > at + 1 ? 2 : 1);
        if (named && n < size) {
            memcpy(type, bytes->data + at + 1, n);
            type[n] = 0;
            return;
        }
        at = end;
    }
}

/* The word behind DATASET, which follows two lines and ASCII or BINARY. */
static void legacy_type(const VolBytes *bytes, char *type, size_t size)
{
    size_t at = behind(bytes, behind(bytes, 0, "\n"), "\n");
    char word[16];
    type[0] = 0;
    if (vol_vtk_word(bytes, &at, word, sizeof word) && vol_vtk_word(bytes, &at, word, sizeof word) &&
        strcasecmp(word, "dataset") == 0)
        vol_vtk_word(bytes, &at, type, size);
}

const char *vol_vtk_mesh(const VolBytes *bytes)
{
    static const struct {
        const char *type, *what;
        bool legacy;
    } kinds[] = {{"UnstructuredGrid", "it is .vtu (a VTK unstructured grid)"},
                 {"PolyData", "it is .vtp (VTK polygons)"},
                 {"StructuredGrid", "it is .vts (a VTK structured grid)"},
                 {"RectilinearGrid", "it is .vtr (a VTK rectilinear grid)"},
                 {"PImageData", "it is .pvti (a VTK image in pieces)"},
                 {"PUnstructuredGrid", "it is .pvtu (a VTK unstructured grid in pieces)"},
                 {"PPolyData", "it is .pvtp (VTK polygons)"},
                 {"PStructuredGrid", "it is .pvts (a VTK structured grid in pieces)"},
                 {"PRectilinearGrid", "it is .pvtr (a VTK rectilinear grid in pieces)"},
                 {"vtkMultiBlockDataSet", "it is .vtm (VTK blocks)"},
                 {"Collection", "it is .pvd (a ParaView collection)"},
                 {"HyperTreeGrid", "it is .htg (a VTK tree grid)"},
                 {"Table", "it is .vtt (a VTK table)"},
                 {"UNSTRUCTURED_GRID", "it is legacy .vtk (an unstructured grid)", true},
                 {"POLYDATA", "it is legacy .vtk (polygons)", true},
                 {"STRUCTURED_GRID", "it is legacy .vtk (a structured grid)", true},
                 {"RECTILINEAR_GRID", "it is legacy .vtk (a rectilinear grid)", true},
                 {"FIELD", "it is legacy .vtk (a field alone)", true}};
    bool xml = vol_is_vtk_xml(bytes);
    char type[64];
    if (xml)
        xml_type(bytes, find_root(bytes), type, sizeof type);
    else if (vol_is_vtk_legacy(bytes))
        legacy_type(bytes, type, sizeof type);
    else
        return NULL;
    for (size_t i = 0; i < sizeof kinds / sizeof *kinds; i++)
        if (kinds[i].legacy != xml && (xml ? strcmp : strcasecmp)(kinds[i].type, type) == 0)
            return kinds[i].what;
    return NULL;
}

VolStatus vol_read_vtk_xml(const VolSource *source, VolSampled *out, VolError *err)
{
    Vti vti;
    *out = (VolSampled){0};
    VolStatus status = vol_vti_parse(source->bytes, source->name, &vti, err);
    if (status)
        return status;
    status = vol_vti_image(&vti, source->options, out, err);
    vol_vti_free(&vti);
    return status;
}
