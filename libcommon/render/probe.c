#include "render/probe.h"

#include <jansson.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/number.h"
#include "base/refusals.h"
#include "render/film.h"

static json_t *number(double v)
{
    return isfinite(v) ? json_real(v) : json_string(isnan(v) ? "nan" : v > 0 ? "inf" : "-inf");
}

typedef struct Trace {
    json_t *steps;
    double unit;
} Trace;

static void add_step(void *user, const VolTraceStep *step)
{
    const Trace *trace = user;
    json_t *entry = json_object();
    json_object_set_new(entry, "what", json_string(step->what));
    json_object_set_new(entry, "t0", number(step->t0));
    json_object_set_new(entry, "t1", number(step->t1));
    json_object_set_new(entry, "v0", number(step->v0 * trace->unit));
    json_object_set_new(entry, "v1", number(step->v1 * trace->unit));
    json_object_set_new(entry, "optical_depth", number(step->optical_depth));
    json_object_set_new(entry, "interval", json_integer((json_int_t)step->interval));
    json_array_append_new(trace->steps, entry);
}

static VolStatus place_of(const VolFrame *frame, const char *text, int64_t at[2], VolError *err)
{
    double v[2];
    if (vol_parse_reals(text, v, 2, 2) != 2 || v[0] != floor(v[0]) || v[1] != floor(v[1]))
        return vol_fail(err, VOL_USAGE, "--probe '%s': want X,Y in whole pixels", text);
    if (v[0] < 0 || v[1] < 0 || v[0] >= (double)frame->camera->width || v[1] >= (double)frame->camera->height)
        return vol_fail(err, VOL_USAGE, "--probe %s lies outside the picture", text);
    at[0] = (int64_t)v[0];
    at[1] = (int64_t)v[1];
    return VOL_OK;
}

static VolStatus add_pixel(VolFrame *frame, const int64_t at[2], bool trace, json_t *pixels, VolError *err)
{
    VolPixelValue pixel;
    VolFrame view = *frame;
    json_t *steps = json_array(), *channels = json_object(), *entry = json_object();
    double unit = frame->prepared->scene->unit;
    VolTraceListener listener = {add_step, &(Trace){steps, unit > 0 ? unit : 1}};
    view.listener = trace ? &listener : NULL;
    VolStatus status = vol_frame_pixel(&view, at[0], at[1], &pixel, err);
    if (status)
        pixel = (VolPixelValue){0};
    const char *names[VOL_FILM_CHANNELS];
    double values[VOL_FILM_CHANNELS];
    size_t count = vol_film_channels(frame, &pixel, names, values);
    for (size_t i = 0; i < count; i++)
        json_object_set_new(channels, names[i], number(values[i]));
    json_object_set_new(entry, "x", json_integer(at[0]));
    json_object_set_new(entry, "y", json_integer(at[1]));
    json_object_set_new(entry, "channels", channels);
    if (trace)
        json_object_set(entry, "trace", steps);
    json_decref(steps);
    json_array_append_new(pixels, entry);
    return status;
}

VolStatus vol_probe_json(VolFrame *frame, const char *const *places, size_t count, bool trace, VolBytes *out,
                         VolError *err)
{
    vol_watch_jansson();
    size_t refusals = vol_refusals();
    json_t *root = json_object(), *pixels = json_array();
    VolStatus status = VOL_OK;
    *out = (VolBytes){0};
    json_object_set(root, "pixels", pixels);
    for (size_t i = 0; i < count && !status; i++) {
        int64_t at[2];
        status = place_of(frame, places[i], at, err);
        if (!status)
            status = add_pixel(frame, at, trace, pixels, err);
    }
    char *text = status ? NULL : json_dumps(root, JSON_INDENT(1) | JSON_REAL_PRECISION(17));
    json_decref(pixels);
    json_decref(root);
    if (status)
        return status;
    size_t length = text ? strlen(text) : 0;
    char *line = text ? vol_resize(text, length + 2, 1) : NULL;
    if (!line || vol_refusals() != refusals) {
        free(line ? line : text);
        return vol_fail_memory(err, length);
    }
    line[length] = '\n';
    out->data = (unsigned char *)line;
    out->size = length + 1;
    return VOL_OK;
}
