/* Images in memory: parts, channels, attributes. */
#include "io/exr_private.h"

#include <stdlib.h>
#include <string.h>

static void free_part(VolPart *part)
{
    for (size_t i = 0; i < part->channel_count; i++) {
        free(part->channels[i].name);
        free(part->channels[i].data);
        free(part->channels[i].whole);
    }
    for (size_t i = 0; i < part->attr_count; i++) {
        free(part->attrs[i].name);
        free(part->attrs[i].text);
    }
    free(part->channels);
    free(part->attrs);
    free(part->name);
}

void vol_image_free(VolImage *image)
{
    for (size_t i = 0; i < image->part_count; i++)
        free_part(&image->parts[i]);
    free(image->parts);
    *image = (VolImage){0};
}

VolStatus vol_image_add_part(VolImage *image, const char *name, VolBox2 data, VolBox2 display, VolPart **out,
                             VolError *err)
{
    VolPart *parts = vol_resize(image->parts, image->part_count + 1, sizeof *parts);
    if (!parts)
        return vol_fail_memory(err, (image->part_count + 1) * sizeof *parts);
    image->parts = parts;
    VolPart *part = &parts[image->part_count];
    *part = (VolPart){.data_window = data, .display_window = display, .pixel_aspect = 1, .screen_width = 1};
    if (name && !(part->name = vol_copy_text(name)))
        return vol_fail_memory(err, strlen(name) + 1);
    image->part_count++;
    *out = part;
    return VOL_OK;
}

VolStatus vol_part_insert_channel(VolPart *part, const char *name, VolPixel store, VolChannel **out, VolError *err)
{
    VolChannel *channels = vol_resize(part->channels, part->channel_count + 1, sizeof *channels);
    if (!channels)
        return vol_fail_memory(err, (part->channel_count + 1) * sizeof *channels);
    part->channels = channels;
    char *copy = vol_copy_text(name);
    if (!copy)
        return vol_fail_memory(err, strlen(name) + 1);
    size_t at = part->channel_count;
    while (at > 0 && strcmp(channels[at - 1].name, name) > 0)
        at--;
    memmove(&channels[at + 1], &channels[at], (part->channel_count - at) * sizeof *channels);
    channels[at] = (VolChannel){.name = copy, .store = store};
    part->channel_count++;
    *out = &channels[at];
    return VOL_OK;
}

VolStatus vol_part_add_channel(VolPart *part, const char *name, VolPixel store, VolChannel **out, VolError *err)
{
    VolChannel *channel;
    VolStatus status = vol_part_insert_channel(part, name, store, &channel, err);
    if (status)
        return status;
    size_t width = vol_box2_width(part->data_window), height = vol_box2_height(part->data_window);
    size_t pixels; /* never 0: an empty channel still has memory to point to */
    if (__builtin_mul_overflow(width, height, &pixels))
        return vol_fail_memory(err, SIZE_MAX);
    channel->data = vol_alloc_zero(pixels, sizeof(float));
    if (!channel->data)
        return vol_fail_memory(err, pixels * sizeof(float));
    *out = channel;
    return VOL_OK;
}

VolChannel *vol_part_channel(const VolPart *part, const char *name)
{
    for (size_t i = 0; i < part->channel_count; i++)
        if (strcmp(part->channels[i].name, name) == 0)
            return &part->channels[i];
    return NULL;
}

const VolAttr *vol_part_attr(const VolPart *part, const char *name)
{
    for (size_t i = 0; i < part->attr_count; i++)
        if (strcmp(part->attrs[i].name, name) == 0)
            return &part->attrs[i];
    return NULL;
}

VolStatus vol_part_new_attr(VolPart *part, const char *name, VolAttrType type, VolAttr **out, VolError *err)
{
    VolAttr *attr = NULL;
    for (size_t i = 0; i < part->attr_count && !attr; i++)
        if (strcmp(part->attrs[i].name, name) == 0)
            attr = &part->attrs[i];
    if (!attr) {
        VolAttr *attrs = vol_resize(part->attrs, part->attr_count + 1, sizeof *attrs);
        if (!attrs)
            return vol_fail_memory(err, (part->attr_count + 1) * sizeof *attrs);
        part->attrs = attrs;
        attr = &attrs[part->attr_count];
        *attr = (VolAttr){.name = vol_copy_text(name)};
        if (!attr->name)
            return vol_fail_memory(err, strlen(name) + 1);
        part->attr_count++;
    }
    free(attr->text);
    *attr = (VolAttr){.name = attr->name, .type = type};
    *out = attr;
    return VOL_OK;
}

VolStatus vol_part_set_text(VolPart *part, const char *name, const char *text, VolError *err)
{
    char *copy = vol_copy_text(text); /* first: `text` may be the attribute's own */
    if (!copy)
        return vol_fail_memory(err, strlen(text) + 1);
    VolAttr *attr;
    VolStatus status = vol_part_new_attr(part, name, VOL_ATTR_TEXT, &attr, err);
    if (status) {
        free(copy);
        return status;
    }
    attr->text = copy;
    return VOL_OK;
}

size_t vol_attr_numbers(VolAttrType type)
{
    switch (type) {
    case VOL_ATTR_INT:
    case VOL_ATTR_FLOAT:
    case VOL_ATTR_DOUBLE: return 1;
    case VOL_ATTR_V3F: return 3;
    case VOL_ATTR_CHROMATICITIES: return 8;
    case VOL_ATTR_M44F: return 16;
    case VOL_ATTR_TEXT:
    case VOL_ATTR_OTHER: break;
    }
    return 0;
}

VolStatus vol_part_set_numbers(VolPart *part, const char *name, VolAttrType type, const double *numbers, VolError *err)
{
    double copy[16] = {0};
    memcpy(copy, numbers, vol_attr_numbers(type) * sizeof *copy);
    VolAttr *attr;
    VolStatus status = vol_part_new_attr(part, name, type, &attr, err);
    if (status)
        return status;
    memcpy(attr->number, copy, sizeof copy);
    return VOL_OK;
}
