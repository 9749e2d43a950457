#include "base/number.h"

#include <ctype.h>
#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

bool vol_parse_real(const char *text, double *out)
{
    char *end;
    if (!*text || isspace((unsigned char)*text))
        return false;
    double value = strtod(text, &end); /* the C locale: nobody calls setlocale */
    if (*end || !isfinite(value))
        return false;
    *out = value;
    return true;
}

bool vol_parse_int(const char *text, int64_t *out)
{
    char *end;
    if (!*text || isspace((unsigned char)*text))
        return false;
    errno = 0;
    long long value = strtoll(text, &end, 10);
    if (*end || errno)
        return false;
    *out = value;
    return true;
}

/* Copies text up to `separator` (or the end) into `piece`; returns what follows it, NULL at the end or where it does not
 * fit (piece is then empty, so that no number is found in it). */
const char *vol_cut_text(const char *text, char separator, char *piece, size_t size)
{
    const char *end = strchr(text, separator);
    size_t length = end ? (size_t)(end - text) : strlen(text);
    piece[0] = 0;
    if (length >= size)
        return NULL;
    memcpy(piece, text, length);
    piece[length] = 0;
    return end ? end + 1 : NULL;
}

int vol_parse_reals(const char *text, double *out, int min, int max)
{
    int count = 0;
    for (const char *rest = text; rest;) {
        char piece[512];
        rest = vol_cut_text(rest, ',', piece, sizeof piece);
        if (count == max || !vol_parse_real(piece, &out[count]))
            return -1;
        count++;
    }
    return count >= min ? count : -1;
}
