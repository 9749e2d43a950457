/* The description as text: one line per value, lists of objects as headed blocks, histograms as bars. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/fmath.h"
#include "inspect/inspect.h"

typedef struct Text {
    VolBytes bytes;
    size_t capacity;
    VolStatus status;
    VolError *err;
} Text;

static void put(Text *t, const char *text)
{
    if (!t->status)
        t->status = vol_bytes_append(&t->bytes, &t->capacity, text, strlen(text), t->err);
}

static void indent(Text *t, int depth)
{
    for (int i = 0; i < depth; i++)
        put(t, "  ");
}

/* Text of the input: lines after the first are indented, control characters become '?'. */
static void put_foreign(Text *t, const char *text, int depth)
{
    bool lines = strchr(text, '\n') != NULL;
    for (const char *c = text; *c; c++) {
        if (lines && (c == text || c[-1] == '\n')) {
            put(t, "\n");
            indent(t, depth + 1);
        }
        char one[2] = {*c == '\t' ? ' ' : (unsigned char)*c < 32 || *c == 127 ? '?' : *c, 0};
        if (*c != '\n')
            put(t, one);
    }
}

static void put_scalar(Text *t, const json_t *value, int depth)
{
    char number[40] = "";
    if (json_is_string(value))
        put_foreign(t, json_string_value(value), depth);
    else if (json_is_integer(value))
        snprintf(number, sizeof number, "%lld", (long long)json_integer_value(value));
    else if (json_is_real(value))
        snprintf(number, sizeof number, "%.9g", json_real_value(value));
    else
        snprintf(number, sizeof number, json_is_true(value) ? "yes" : "no");
    put(t, number);
}

/* Sixteen rows, four bins in each; a bar is as long as the logarithm of its count. */
static void put_histogram(Text *t, const json_t *histogram, int depth)
{
    enum { ROWS = 16, EACH = VOL_BINS / ROWS, LONGEST = 40 };
    const json_t *counts = json_object_get(histogram, "counts");
    double from = json_number_value(json_object_get(histogram, "from")), rows[ROWS] = {0}, most = 0;
    double to = json_number_value(json_object_get(histogram, "to"));
    for (int i = 0; i < VOL_BINS; i++)
        rows[i / EACH] += (double)json_integer_value(json_array_get(counts, (size_t)i));
    for (int i = 0; i < ROWS; i++)
        most = fmax(most, rows[i]);
    put(t, from < to ? " (lower end of the bin, log of the count)\n" : "\n");
    for (int i = 0; i < (from < to ? ROWS : 1); i++) {
        char line[120], bar[LONGEST + 1];
        int length = most > 0 ? (int)nearbyint(vol_log1p(rows[i]) / vol_log1p(most) * LONGEST) : 0;
        memset(bar, '#', (size_t)length);
        bar[length] = 0;
        indent(t, depth + 1);
        snprintf(line, sizeof line, "%12.5g |%-40s %.0f\n", from + (to - from) * i / ROWS, bar, rows[i]);
        put(t, line);
    }
}

static void put_object(Text *t, const json_t *object, int depth);

/* "grids" -> a block "grid NAME" for each, by the name that --grid takes. */
static void put_blocks(Text *t, const char *key, const json_t *list, int depth)
{
    size_t i;
    const json_t *item;
    char head[40];
    snprintf(head, sizeof head, "%.*s", (int)strlen(key) - 1, key);
    json_array_foreach((json_t *)list, i, item) {
        const json_t *label = json_object_get(item, "label"), *name = label ? label : json_object_get(item, "name");
        indent(t, depth);
        put(t, strcmp(head, "component") == 0 && !name ? "values" : head);
        if (name) {
            put(t, " ");
            put_foreign(t, json_string_value(name), depth);
        }
        put(t, "\n");
        put_object(t, item, depth + 1);
    }
}

static void put_value(Text *t, const char *key, const json_t *value, int depth)
{
    if (json_is_array(value) && json_is_object(json_array_get(value, 0))) {
        put_blocks(t, key, value, depth);
        return;
    }
    indent(t, depth);
    put_foreign(t, key, depth);
    put(t, ":");
    if (json_is_object(value)) {
        if (strcmp(key, "histogram") == 0) {
            put_histogram(t, value, depth);
        } else {
            put(t, json_object_size(value) ? "\n" : " none\n");
            put_object(t, value, depth + 1);
        }
        return;
    }
    for (size_t i = 0; i < (json_is_array(value) ? json_array_size(value) : 1); i++) {
        const char *text = json_string_value(value);
        put(t, i ? ", " : text && (!*text || strchr(text, '\n')) ? "" : " ");
        put_scalar(t, json_is_array(value) ? json_array_get(value, i) : value, depth);
    }
    put(t, "\n");
}

static void put_object(Text *t, const json_t *object, int depth)
{
    const char *key;
    json_t *value;
    json_object_foreach((json_t *)object, key, value)
    {
        bool in_head = strcmp(key, "name") == 0 || strcmp(key, "label") == 0;
        if (depth == 0 || !in_head)
            put_value(t, key, value, depth);
    }
}

VolStatus vol_inspection_text(const VolInspection *inspection, VolBytes *out, VolError *err)
{
    Text t = {.err = err};
    put_object(&t, inspection->description, 0);
    *out = t.bytes;
    return t.status;
}
