#include "tf/foreign.h"

#include "tf/foreign_private.h"
#include "tf/json.h"
#include "tf/locate.h"

#include <ctype.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/number.h"

VolStatus vol_tf_split_name(const char *name, bool exists, char **file, const char **part, VolError *err)
{
    *part = NULL;
    *file = vol_copy_text(name);
    if (!*file)
        return vol_fail_memory(err, strlen(name) + 1);
    char *last = strrchr(*file, '/');
    char *mark = exists ? NULL : strchr(last ? last : *file, '#');
    if (mark && mark != *file) {
        *mark = 0;
        *part = mark + 1;
    }
    return VOL_OK;
}

/* ---- Kinds of file ---- */

/* ParaView's own collection ends its lists with a comma, which its parser takes and JSON does not allow. */
static void blank_trailing_commas(char *text, size_t size)
{
    size_t comma = size;
    bool quoted = false;
    for (size_t i = 0; i < size; i++) {
        char c = text[i];
        if (quoted) {
            i += c == '\\';
            quoted = c != '"';
            continue;
        }
        if ((c == ']' || c == '}') && comma < size)
            text[comma] = ' ';
        if (c == ',')
            comma = i;
        else if (!isspace((unsigned char)c))
            comma = size;
        quoted = c == '"';
    }
}

static VolStatus read_json(VolForeign *f, const VolBytes *bytes, size_t begin, VolTf *out, VolTfUnits *units)
{
    size_t size = bytes->size - begin;
    char *text = vol_alloc(size, 1);
    if (!text)
        return vol_fail_memory(f->err, size);
    memcpy(text, bytes->data + begin, size);
    blank_trailing_commas(text, size);
    json_t *root;
    VolStatus status = vol_json_load(text, size, JSON_DECODE_INT_AS_REAL, f->name, &root, f->err);
    free(text);
    if (status != VOL_OK)
        return status;
    if (vol_foreign_is_paraview(root)) {
        status = vol_foreign_paraview(f, root, out, units);
    } else {
        status = vol_foreign_no_parts(f);
        if (status == VOL_OK) /* ours, and as strict as it is */
            status = vol_tf_parse(bytes, f->name, out, f->log, f->err);
    }
    json_decref(root);
    return status;
}

static VolStatus read_xml(VolForeign *f, const VolBytes *bytes, VolTf *out, VolTfUnits *units)
{
    VolXml xml;
    VolStatus status = vol_xml_parse(bytes, f->name, &xml, f->err);
    if (status != VOL_OK)
        return status;
    const char *root = vol_xml_name(&xml, 0);
    if (strcmp(root, "InviwoTreeData") == 0)
        status = vol_foreign_inviwo(f, &xml, out, units);
    else if (strcmp(root, "VoreenData") == 0)
        status = vol_foreign_voreen(f, &xml, out, units);
    else if (strcmp(root, "MRML") == 0 || strcmp(root, "VolumeProperty") == 0)
        status = vol_foreign_slicer(f, &xml, out, units);
    else
        status = vol_foreign_fault(f, xml.elements[0].line,
                                   "its root <%.60s> is none of <MRML> (3D Slicer), <InviwoTreeData>, <VoreenData>", root);
    vol_xml_free(&xml);
    return status;
}

/* Where JSON begins: behind a byte order mark and white space. */
static size_t text_begin(const VolBytes *bytes)
{
    size_t mark = bytes->size >= 3 && memcmp(bytes->data, "\xEF\xBB\xBF", 3) == 0 ? 3 : 0;
    return vol_json_skip_space((const char *)bytes->data, bytes->size, mark);
}

static bool is_utf16(const VolBytes *bytes)
{
    return bytes->size >= 2 && (memcmp(bytes->data, "\xFF\xFE", 2) == 0 || memcmp(bytes->data, "\xFE\xFF", 2) == 0);
}

VolStatus vol_tf_read(const VolBytes *bytes, const char *name, const char *part, VolTf *out, VolTfUnits *units,
                      const VolLog *log, VolError *err)
{
    VolForeign f = {.name = name, .part = part, .log = log, .err = err};
    size_t begin = text_begin(bytes);
    unsigned char first = begin < bytes->size ? bytes->data[begin] : 0;
    *units = (VolTfUnits){0};
    *out = vol_tf_defaults();
    VolStatus status;
    if (first == '<' || is_utf16(bytes))
        status = read_xml(&f, bytes, out, units);
    else if (first == '[' || first == '{')
        status = read_json(&f, bytes, begin, out, units);
    else if (bytes->size >= 4 && memcmp(bytes->data, "FTSO", 4) == 0)
        status = vol_foreign_ospray(&f, bytes, out, units);
    else
        status = vol_tf_parse(bytes, name, out, log, err); /* says what is wrong with it */
    if (status != VOL_OK)
        vol_tf_free(out);
    return status;
}

/* ---- Ranges ---- */

static double stretched(double v, double lo, double hi)
{
    return lo * (1 - v) + hi * v;
}

void vol_tf_rescale(VolTf *tf, double lo, double hi)
{
    VolTfNodes *lists[] = {&tf->surface, &tf->scatter, &tf->absorb, &tf->emit, &tf->transport, &tf->surfaceness};
    if (!(hi > lo))
        hi = lo + fmax(1, fabs(lo));
    for (size_t k = 0; k < sizeof lists / sizeof *lists; k++) {
        VolTfNode *nodes = lists[k]->nodes;
        for (size_t i = 0; i < lists[k]->count; i++) {
            nodes[i].v = stretched(nodes[i].v, lo, hi);
            if (i && nodes[i].v < nodes[i - 1].v) /* by rounding */
                nodes[i].v = nodes[i - 1].v;
        }
    }
    for (size_t i = 0; i < tf->isosurface_count; i++)
        tf->isosurfaces[i].value = stretched(tf->isosurfaces[i].value, lo, hi);
    if (!tf->scalar_step_given && tf->surface.count)
        tf->scalar_step *= hi - lo;
}
