/* Inside tf/: a small XML file as a list of elements in the order of the text.  Text between tags is not kept. */
#ifndef VOL_TF_XML_H
#define VOL_TF_XML_H

#include <stddef.h>

#include "base/mem.h"
#include "base/status.h"

typedef struct VolXmlElement {
    size_t name;            /* where it begins in `text` */
    size_t attributes;      /* where key, value, key, value ... begin, each with a NUL */
    size_t attribute_count;
    size_t end;             /* index after the last element inside this one */
    size_t line;
} VolXmlElement;

typedef struct VolXml {
    VolXmlElement *elements; /* elements[0] is the root */
    size_t count, capacity;
    VolBytes text;
    size_t text_capacity;
} VolXml;

/* VOL_BAD_INPUT "bad transfer function 'NAME': line 7: mismatched tag".  Document type declarations are refused: no
 * entities but the five of XML. */
VolStatus vol_xml_parse(const VolBytes *bytes, const char *name, VolXml *out, VolError *err);
void vol_xml_free(VolXml *xml);

const char *vol_xml_name(const VolXml *xml, size_t element);
const char *vol_xml_attribute(const VolXml *xml, size_t element, const char *key); /* NULL: none */

/* The next child of `parent` after the child `after` (0: the first), named `name` (NULL: any); 0 if there is none. */
size_t vol_xml_child(const VolXml *xml, size_t parent, const char *name, size_t after);

/* The next element of that name anywhere after element `after`, the root not counted; 0 if there is none. */
size_t vol_xml_find(const VolXml *xml, const char *name, size_t after);

#endif
