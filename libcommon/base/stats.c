#include "base/stats.h"

#include <jansson.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <time.h>

#include "base/refusals.h"

struct VolStats {
    json_t *root;
    double started, stage_started;
    size_t refusals; /* when it began: its values may be missing if there are more now */
};

static double seconds_now(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

VolStats *vol_stats_new(void)
{
    vol_watch_jansson();
    size_t refusals = vol_refusals();
    VolStats *stats = vol_alloc(1, sizeof *stats);
    json_t *root = json_object();
    if (!stats || !root) {
        free(stats);
        json_decref(root);
        return NULL;
    }
    double now = seconds_now();
    *stats = (VolStats){.root = root, .started = now, .stage_started = now, .refusals = refusals};
    return stats;
}

void vol_stats_free(VolStats *stats)
{
    if (!stats)
        return;
    json_decref(stats->root);
    free(stats);
}

/* The object that holds the last part of a dotted key, made where it is missing; NULL: no memory. */
static json_t *holder(json_t *object, const char *key, const char **last)
{
    const char *dot;
    while (object && (dot = strchr(key, '.'))) {
        char part[64];
        size_t length = (size_t)(dot - key) < sizeof part ? (size_t)(dot - key) : sizeof part - 1;
        memcpy(part, key, length);
        part[length] = 0;
        json_t *child = json_object_get(object, part);
        if (!json_is_object(child)) {
            child = json_object();
            if (json_object_set_new(object, part, child) != 0)
                return NULL;
        }
        object = child;
        key = dot + 1;
    }
    *last = key;
    return object;
}

static void set(VolStats *stats, const char *key, json_t *value)
{
    const char *last;
    json_t *object = holder(stats->root, key, &last);
    if (object)
        json_object_set_new(object, last, value); /* takes the reference, also on failure */
    else
        json_decref(value);
}

static const json_t *get(VolStats *stats, const char *key)
{
    const char *last;
    json_t *object = holder(stats->root, key, &last);
    return object ? json_object_get(object, last) : NULL;
}

void vol_stats_count(VolStats *stats, const char *key, uint64_t value)
{
    if (!stats)
        return;
    uint64_t sum = (uint64_t)json_integer_value(get(stats, key));
    if (__builtin_add_overflow(sum, value, &sum) || sum > INT64_MAX)
        sum = INT64_MAX;
    set(stats, key, json_integer((json_int_t)sum));
}

void vol_stats_number(VolStats *stats, const char *key, uint64_t value)
{
    if (stats)
        set(stats, key, json_integer(value > INT64_MAX ? INT64_MAX : (json_int_t)value));
}

void vol_stats_real(VolStats *stats, const char *key, double value)
{
    if (!stats)
        return;
    json_t *number = json_real(value); /* NULL for NaN and infinities, which JSON cannot say */
    set(stats, key, number ? number : json_null());
}

void vol_stats_text(VolStats *stats, const char *key, const char *text)
{
    if (!stats)
        return;
    json_t *string = json_string(text); /* NULL where it is not UTF-8 */
    set(stats, key, string ? string : json_null());
}

void vol_stats_stage(VolStats *stats, const char *stage)
{
    if (!stats)
        return;
    char key[96] = "seconds.";
    strncat(key, stage, sizeof key - strlen(key) - 1);
    double now = seconds_now();
    double before = json_real_value(get(stats, key));
    vol_stats_real(stats, key, before + (now - stats->stage_started));
    stats->stage_started = now;
}

VolStatus vol_stats_write(VolStats *stats, VolBytes *out, VolError *err)
{
    *out = (VolBytes){0};
    if (!stats)
        return VOL_OK;
    struct rusage usage;
    if (getrusage(RUSAGE_SELF, &usage) == 0)
        set(stats, "peak_memory_bytes", json_integer((json_int_t)usage.ru_maxrss * 1024));
    vol_stats_real(stats, "seconds.total", seconds_now() - stats->started);
    char *text = json_dumps(stats->root, JSON_INDENT(2) | JSON_REAL_PRECISION(9));
    if (!text || vol_refusals() != stats->refusals) {
        free(text);
        return vol_fail_memory(err, 0);
    }
    size_t length = strlen(text);
    size_t capacity = 0;
    VolStatus status = vol_bytes_append(out, &capacity, text, length, err);
    if (status == VOL_OK)
        status = vol_bytes_append(out, &capacity, "\n", 1, err);
    free(text);
    if (status != VOL_OK)
        vol_bytes_free(out);
    return status;
}
