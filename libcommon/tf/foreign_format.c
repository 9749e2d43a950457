/* What readers of foreign formats share: messages, the choice of one of several, numbers. */
#include "tf/foreign_private.h"

#include <ctype.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "base/number.h"

#define MOST_LISTED 20

/* ---- Messages ---- */

VolStatus vol_foreign_fault(const VolForeign *f, size_t line, const char *format, ...)
{
    char why[512], where[40] = "";
    va_list args;
    va_start(args, format);
    vsnprintf(why, sizeof why, format, args);
    va_end(args);
    if (line)
        snprintf(where, sizeof where, "line %zu: ", line);
    return vol_fail(f->err, VOL_BAD_INPUT, "bad transfer function '%.200s': %s%s%s", f->name, where, f->subject, why);
}

void vol_foreign_warn(const VolForeign *f, const char *format, ...)
{
    char what[512];
    va_list args;
    va_start(args, format);
    vsnprintf(what, sizeof what, format, args);
    va_end(args);
    vol_warn(f->log, "transfer function '%.200s': %s%s", f->name, f->subject, what);
}

void vol_foreign_note(const VolForeign *f, const char *format, ...)
{
    char what[512];
    va_list args;
    va_start(args, format);
    vsnprintf(what, sizeof what, format, args);
    va_end(args);
    vol_note(f->log, "transfer function '%.200s': %s%s", f->name, f->subject, what);
}

/* ---- One of several ---- */

static bool contains(const char *text, const char *piece)
{
    for (; *text; text++) {
        size_t i = 0;
        while (piece[i] && tolower((unsigned char)text[i]) == tolower((unsigned char)piece[i]))
            i++;
        if (!piece[i])
            return true;
    }
    return false;
}

/* "'a', 'b', 'c' and 7 more"; where `like` is part of some names only those. */
static void list_names(const char *const *names, size_t count, const char *like, char *out, size_t size)
{
    size_t matches = 0, listed = 0, length = 0;
    for (size_t i = 0; like && i < count; i++)
        matches += contains(names[i], like);
    for (size_t i = 0; i < count && listed < MOST_LISTED; i++) {
        if (matches && !contains(names[i], like))
            continue;
        if (length + strlen(names[i]) + 24 > size)
            break;
        length += (size_t)snprintf(out + length, size - length, "%s'%s'", listed ? ", " : "", names[i]);
        listed++;
    }
    if (listed < count)
        snprintf(out + length, size - length, " and %zu more", count - listed);
}

VolStatus vol_foreign_choose(VolForeign *f, const char *kind, const char *const *names, size_t count, size_t *out)
{
    char listed[700] = "";
    size_t found = f->part || count != 1 ? count : 0;
    if (!count)
        return vol_foreign_fault(f, 0, "there is no %s in it", kind);
    for (size_t i = 0; f->part && i < count; i++) {
        if (strcmp(names[i], f->part) != 0)
            continue;
        if (found < count)
            vol_foreign_warn(f, "there are several %ss named '%.80s'; the first is used", kind, f->part);
        else
            found = i;
    }
    if (found == count)
        list_names(names, count, f->part, listed, sizeof listed);
    if (found == count && f->part)
        return vol_foreign_fault(f, 0, "no %s is named '%.80s'; there is %s", kind, f->part, listed);
    if (found == count)
        return vol_foreign_fault(f, 0, "name one of its %ss by FILE#NAME: %s", kind, listed);
    *out = found;
    snprintf(f->subject, sizeof f->subject, "%s '%.60s': ", kind, names[found]);
    return VOL_OK;
}

VolStatus vol_foreign_no_parts(const VolForeign *f)
{
    if (!f->part)
        return VOL_OK;
    return vol_foreign_fault(f, 0, "there is one transfer function in it, none named '%.80s'", f->part);
}

/* ---- Numbers ---- */

VolStatus vol_foreign_number(const VolForeign *f, const VolXml *xml, size_t element, const char *key, double *out)
{
    const char *text = vol_xml_attribute(xml, element, key);
    size_t line = xml->elements[element].line;
    if (!text)
        return vol_foreign_fault(f, line, "<%.40s> has no '%s'", vol_xml_name(xml, element), key);
    if (!vol_parse_real(text, out))
        return vol_foreign_fault(f, line, "%s '%.40s' of <%.40s> is not a finite number", key, text,
                                 vol_xml_name(xml, element));
    return VOL_OK;
}

VolStatus vol_foreign_child_number(const VolForeign *f, const VolXml *xml, size_t element, const char *child,
                                   const char *key, double *out)
{
    size_t at = vol_xml_child(xml, element, child, 0);
    return at ? vol_foreign_number(f, xml, at, key, out) : VOL_OK;
}
