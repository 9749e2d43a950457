/* A walk over JSON text by brackets, strings and commas alone: it is known to be well-formed. */
#include "tf/locate.h"

#include <stdbool.h>
#include <string.h>

/* The end of the string that begins at text[i] == '"': the index of the closing quote. */
static size_t string_end(const char *text, size_t size, size_t i)
{
    for (i++; i < size && text[i] != '"'; i++)
        if (text[i] == '\\')
            i++;
    return i;
}

static bool is_space(char c)
{
    return c == ' ' || c == '\t' || c == '\n' || c == '\r';
}

size_t vol_json_skip_space(const char *text, size_t size, size_t i)
{
    while (i < size && is_space(text[i]))
        i++;
    return i;
}

/* Whether the string text[begin..end] is this key: a value is not followed by a colon. */
static bool is_key(const char *text, size_t size, size_t begin, size_t end, const char *key)
{
    size_t colon = vol_json_skip_space(text, size, end + 1), length = strlen(key);
    return colon < size && text[colon] == ':' && end - begin - 1 == length &&
           memcmp(text + begin + 1, key, length) == 0;
}

static bool locate(const char *text, size_t size, const char *key, size_t element, size_t *at)
{
    size_t depth = 0, list_depth = 0, elements = 0;
    bool in_key = false;
    for (size_t i = 0; i < size; i++) {
        char c = text[i];
        bool element_begins = list_depth && depth == list_depth && c == ',';
        if (c == '"') {
            size_t end = string_end(text, size, i);
            if (depth == 1 && !in_key && is_key(text, size, i, end, key)) {
                *at = i;
                in_key = true;
                if (!element)
                    return true;
            }
            i = end;
        } else if (c == '{' || c == '[') {
            depth++;
            if (in_key && !list_depth && c == '[') {
                list_depth = depth;
                element_begins = true;
            }
        } else if (c == '}' || c == ']') {
            depth--;
        }
        if (element_begins && ++elements == element) {
            *at = vol_json_skip_space(text, size, i + 1);
            return true;
        }
    }
    return in_key;
}

size_t vol_json_line(const char *text, size_t size, const char *key, size_t element)
{
    size_t at = 0, line = 1;
    if (!locate(text, size, key, element, &at))
        return 0;
    for (size_t i = 0; i < at; i++)
        line += text[i] == '\n';
    return line;
}
