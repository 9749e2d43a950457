#include "tf/xml.h"

#include <expat.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include "base/refusals.h"

#define CHUNK ((size_t)1 << 20)
#define MOST_DEPTH 256

typedef struct Reader {
    XML_Parser parser;
    VolXml *xml;
    size_t open[MOST_DEPTH]; /* the elements we are in */
    size_t depth;
    const char *refused; /* why we stopped the parser */
    VolStatus status;    /* of our own allocations */
    VolError *err;
} Reader;

static void stop(Reader *r, VolStatus status)
{
    r->status = status;
    XML_StopParser(r->parser, XML_FALSE);
}

static void refuse(Reader *r, const char *why)
{
    if (!r->refused)
        r->refused = why;
    stop(r, VOL_BAD_INPUT);
}

static VolStatus keep_text(Reader *r, const char *text)
{
    return vol_bytes_append(&r->xml->text, &r->xml->text_capacity, text, strlen(text) + 1, r->err);
}

static VolStatus add_element(Reader *r, const char *name, const char **attributes)
{
    VolXml *xml = r->xml;
    if (xml->count == xml->capacity) {
        size_t capacity = xml->capacity ? 2 * xml->capacity : 64;
        VolXmlElement *grown = vol_resize(xml->elements, capacity, sizeof *grown);
        if (!grown)
            return vol_fail_memory(r->err, capacity * sizeof *grown);
        xml->elements = grown;
        xml->capacity = capacity;
    }
    VolXmlElement element = {.name = xml->text.size, .line = XML_GetCurrentLineNumber(r->parser)};
    VolStatus status = keep_text(r, name);
    element.attributes = xml->text.size;
    for (size_t i = 0; attributes[i] && status == VOL_OK; i++) {
        status = keep_text(r, attributes[i]);
        element.attribute_count += i % 2;
    }
    xml->elements[xml->count++] = element;
    return status;
}

static void XMLCALL on_start(void *user, const char *name, const char **attributes)
{
    Reader *r = user;
    if (r->status != VOL_OK)
        return;
    if (r->depth == MOST_DEPTH) {
        refuse(r, "elements are nested too deeply");
        return;
    }
    r->open[r->depth++] = r->xml->count;
    VolStatus status = add_element(r, name, attributes);
    if (status != VOL_OK)
        stop(r, status);
}

static void XMLCALL on_end(void *user, const char *name)
{
    Reader *r = user;
    (void)name;
    if (r->status == VOL_OK)
        r->xml->elements[r->open[--r->depth]].end = r->xml->count;
}

static void XMLCALL on_doctype(void *user, const char *name, const char *system, const char *public, int internal)
{
    (void)name, (void)system, (void)public, (void)internal;
    refuse(user, "document type declarations are not supported");
}

/* Expat takes an int's worth at a time. */
static enum XML_Status feed(XML_Parser parser, const VolBytes *bytes)
{
    size_t at = 0;
    enum XML_Status ok = XML_STATUS_OK;
    do {
        size_t n = bytes->size - at < CHUNK ? bytes->size - at : CHUNK;
        bool last = at + n == bytes->size;
        ok = XML_Parse(parser, n ? (const char *)bytes->data + at : "", (int)n, last);
        at += n;
    } while (ok == XML_STATUS_OK && at < bytes->size);
    return ok;
}

static VolStatus parse(Reader *r, const VolBytes *bytes, const char *name)
{
    XML_SetUserData(r->parser, r);
    XML_SetElementHandler(r->parser, on_start, on_end);
    XML_SetStartDoctypeDeclHandler(r->parser, on_doctype);
    if (feed(r->parser, bytes) == XML_STATUS_OK)
        return VOL_OK;
    enum XML_Error code = XML_GetErrorCode(r->parser);
    if (code == XML_ERROR_NO_MEMORY || r->status == VOL_NOMEM)
        return vol_fail(r->err, VOL_NOMEM, "out of memory while reading '%.200s'", name);
    return vol_fail(r->err, VOL_BAD_INPUT, "bad transfer function '%.200s': line %lu: %s", name,
                    (unsigned long)XML_GetCurrentLineNumber(r->parser), r->refused ? r->refused : XML_ErrorString(code));
}

VolStatus vol_xml_parse(const VolBytes *bytes, const char *name, VolXml *out, VolError *err)
{
    *out = (VolXml){0};
    static const XML_Memory_Handling_Suite memory = {vol_library_alloc, vol_library_resize, free};
    Reader r = {.parser = XML_ParserCreate_MM(NULL, &memory, NULL), .xml = out, .err = err};
    if (!r.parser)
        return vol_fail(err, VOL_NOMEM, "out of memory while reading '%.200s'", name);
    VolStatus status = parse(&r, bytes, name);
    XML_ParserFree(r.parser);
    if (status != VOL_OK)
        vol_xml_free(out);
    return status;
}

void vol_xml_free(VolXml *xml)
{
    free(xml->elements);
    vol_bytes_free(&xml->text);
    *xml = (VolXml){0};
}

const char *vol_xml_name(const VolXml *xml, size_t element)
{
    return (const char *)xml->text.data + xml->elements[element].name;
}

const char *vol_xml_attribute(const VolXml *xml, size_t element, const char *key)
{
    const VolXmlElement *e = &xml->elements[element];
    const char *at = (const char *)xml->text.data + e->attributes;
    for (size_t i = 0; i < e->attribute_count; i++) {
        const char *value = at + strlen(at) + 1;
        if (strcmp(at, key) == 0)
            return value;
        at = value + strlen(value) + 1;
    }
    return NULL;
}

size_t vol_xml_child(const VolXml *xml, size_t parent, const char *name, size_t after)
{
    size_t child = after ? xml->elements[after].end : parent + 1;
    for (; child < xml->elements[parent].end; child = xml->elements[child].end)
        if (!name || strcmp(vol_xml_name(xml, child), name) == 0)
            return child;
    return 0;
}

size_t vol_xml_find(const VolXml *xml, const char *name, size_t after)
{
    for (size_t i = after + 1; i < xml->count; i++)
        if (strcmp(vol_xml_name(xml, i), name) == 0)
            return i;
    return 0;
}
