#include <stdio.h>
#include <string.h>

#include "base/refusals.h"
#include "inspect/inspect.h"

static json_t *window_json(VolBox2 b) { return vol_json_ints((int32_t[]){b.x0, b.y0, b.x1, b.y1}, 4); }

static json_t *attr_json(const VolAttr *attr)
{
    switch (attr->type) {
    case VOL_ATTR_TEXT: return vol_json_text(attr->text);
    case VOL_ATTR_INT: return json_integer((json_int_t)attr->number[0]);
    case VOL_ATTR_FLOAT:
    case VOL_ATTR_DOUBLE: return vol_json_real(attr->number[0]);
    case VOL_ATTR_OTHER: return json_string("(of another type)");
    default: return vol_json_reals(attr->number, vol_attr_numbers(attr->type));
    }
}

static VolStatus describe_values(const VolPart *part, const VolChannel *channel, VolInspection *out, json_t *object,
                                 VolError *err)
{
    char name[300];
    snprintf(name, sizeof name, part->name ? "%.128s: %.128s" : "%.0s%.128s", part->name ? part->name : "", channel->name);
    VolSeries *series;
    VolStatus status = vol_inspection_add_series(out, name, &series, err);
    if (status)
        return status;
    size_t n = vol_box2_width(part->data_window) * vol_box2_height(part->data_window);
    for (size_t i = 0; i < n; i++)
        vol_series_range(series, vol_channel_value(channel, i), 1);
    for (size_t i = 0; i < n; i++)
        vol_series_bin(series, vol_channel_value(channel, i), 1);
    json_t *values = vol_series_json(series);
    if (json_object_update(object, values))
        status = vol_fail_memory(err, 0);
    json_decref(values);
    return status;
}

static VolStatus describe_channels(const VolPart *part, bool headers_only, VolInspection *out, json_t *list, VolError *err)
{
    static const char *const types[] = {"float", "half", "uint"};
    VolStatus status = VOL_OK;
    for (size_t c = 0; c < part->channel_count && !status; c++) {
        const VolChannel *channel = &part->channels[c];
        json_t *object = json_object();
        json_object_set_new(object, "name", vol_json_text(channel->name));
        json_object_set_new(object, "type", json_string(types[channel->store]));
        if (json_array_append_new(list, object))
            status = vol_fail_memory(err, 0);
        else if (!headers_only)
            status = describe_values(part, channel, out, object, err);
    }
    return status;
}

static VolStatus describe_part(const VolPart *part, bool headers_only, VolInspection *out, json_t *object, VolError *err)
{
    if (part->name)
        json_object_set_new(object, "name", vol_json_text(part->name));
    json_object_set_new(object, "data_window", window_json(part->data_window));
    json_object_set_new(object, "display_window", window_json(part->display_window));
    json_object_set_new(object, "pixel_aspect", vol_json_real(part->pixel_aspect));
    json_t *attrs = json_object();
    for (size_t i = 0; i < part->attr_count; i++)
        json_object_set_new_nocheck(attrs, part->attrs[i].name, attr_json(&part->attrs[i]));
    json_t *channels = json_array();
    if (json_object_set_new(object, "attributes", attrs) || json_object_set_new(object, "channels", channels))
        return vol_fail_memory(err, 0);
    return describe_channels(part, headers_only, out, channels, err);
}

VolStatus vol_inspect_exr(const VolImage *image, size_t size, bool headers_only, VolInspection *out, VolError *err)
{
    vol_watch_jansson();
    size_t refusals = vol_refusals();
    *out = (VolInspection){.description = json_object()};
    json_t *parts = json_array();
    json_object_set_new(out->description, "format", json_string("EXR"));
    json_object_set_new(out->description, "bytes", json_integer((json_int_t)size));
    VolStatus status = json_object_set_new(out->description, "parts", parts) ? vol_fail_memory(err, 0) : VOL_OK;
    for (size_t p = 0; p < image->part_count && !status; p++) {
        const VolAttr *history = vol_part_attr(&image->parts[p], "vol:history");
        if (history && history->type == VOL_ATTR_TEXT && !out->history)
            out->history = vol_copy_text(history->text);
        json_t *object = json_object();
        if (json_array_append_new(parts, object))
            status = vol_fail_memory(err, 0);
        else
            status = describe_part(&image->parts[p], headers_only, out, object, err);
    }
    if (!status && vol_refusals() != refusals) /* jansson leaves out what it has no memory for */
        status = vol_fail_memory(err, 0);
    if (status)
        vol_inspection_free(out);
    return status;
}
