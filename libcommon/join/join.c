#include "join/join.h"

#include <stdio.h>
#include <string.h>

/* ---- Strangers ----------------------------------------------------------------------------------------------------- */

static VolStatus stranger(const char *name, const char *first, const char *what, VolError *err)
{
    return vol_fail(err, VOL_BAD_INPUT, "cannot join '%s': its %s differs from that of '%s'", name, what, first);
}

static bool same_box(VolBox2 a, VolBox2 b) { return a.x0 == b.x0 && a.y0 == b.y0 && a.x1 == b.x1 && a.y1 == b.y1; }

static bool same_attr(const VolAttr *a, const VolAttr *b)
{
    if (a->type != b->type)
        return false;
    if (a->type == VOL_ATTR_TEXT)
        return strcmp(a->text, b->text) == 0;
    return memcmp(a->number, b->number, sizeof a->number) == 0; /* bits: NaN is itself here */
}

static VolStatus check_attrs(const VolPart *first, const char *first_name, const VolPart *part, const char *name,
                             VolError *err)
{
    char what[300];
    for (int way = 0; way < 2; way++) {
        const VolPart *from = way ? part : first, *to = way ? first : part;
        for (size_t i = 0; i < from->attr_count; i++) {
            const VolAttr *other = vol_part_attr(to, from->attrs[i].name);
            snprintf(what, sizeof what, "attribute %.255s", from->attrs[i].name);
            if (!other || !same_attr(&from->attrs[i], other))
                return stranger(name, first_name, what, err);
        }
    }
    return VOL_OK;
}

static VolStatus check_channels(const VolPart *first, const char *first_name, const VolPart *part, const char *name,
                                VolError *err)
{
    if (first->channel_count != part->channel_count)
        return stranger(name, first_name, "set of channels", err);
    for (size_t c = 0; c < first->channel_count; c++)
        if (strcmp(first->channels[c].name, part->channels[c].name) != 0 ||
            first->channels[c].store != part->channels[c].store)
            return stranger(name, first_name, "set of channels", err);
    return VOL_OK;
}

static VolStatus check_part(const VolPart *first, const char *first_name, const VolPart *part, const char *name,
                            VolError *err)
{
    if (strcmp(first->name ? first->name : "", part->name ? part->name : "") != 0)
        return stranger(name, first_name, "list of parts", err);
    if (!same_box(first->display_window, part->display_window))
        return stranger(name, first_name, "display window", err);
    if (first->pixel_aspect != part->pixel_aspect || first->screen_width != part->screen_width ||
        memcmp(first->screen_center, part->screen_center, sizeof first->screen_center) != 0)
        return stranger(name, first_name, "screen window", err);
    VolBox2 data = part->data_window, frame = part->display_window;
    if (data.x0 < frame.x0 || data.y0 < frame.y0 || data.x1 > frame.x1 || data.y1 > frame.y1)
        return vol_fail(err, VOL_BAD_INPUT, "cannot join '%s': its data window reaches beyond its display window", name);
    VolStatus status = check_channels(first, first_name, part, name, err);
    return status ? status : check_attrs(first, first_name, part, name, err);
}

static VolStatus check_strangers(const VolImage *images, const char *const *names, size_t count, VolError *err)
{
    VolStatus status = VOL_OK;
    for (size_t i = 0; i < count && !status; i++) {
        if (images[i].part_count != images[0].part_count)
            return stranger(names[i], names[0], "list of parts", err);
        for (size_t p = 0; p < images[0].part_count && !status; p++)
            status = check_part(&images[0].parts[p], names[0], &images[i].parts[p], names[i], err);
    }
    return status;
}

/* ---- Overlaps and holes -------------------------------------------------------------------------------------------- */

static VolStatus check_overlaps(const VolImage *images, const char *const *names, size_t count, size_t p, VolError *err)
{
    for (size_t i = 1; i < count; i++)
        for (size_t j = 0; j < i; j++) {
            VolBox2 a = images[i].parts[p].data_window, b = images[j].parts[p].data_window;
            int32_t x0 = a.x0 > b.x0 ? a.x0 : b.x0, x1 = a.x1 < b.x1 ? a.x1 : b.x1;
            int32_t y0 = a.y0 > b.y0 ? a.y0 : b.y0, y1 = a.y1 < b.y1 ? a.y1 : b.y1;
            if (x0 <= x1 && y0 <= y1)
                return vol_fail(err, VOL_BAD_INPUT, "cannot join '%s': overlap with '%s' at (%d,%d)-(%d,%d)", names[i],
                                names[j], x0, y0, x1, y1);
        }
    return VOL_OK;
}

/* The first x >= `x` of line y that no crop covers (x1 + 1: none), and how far it stays free, in *end. */
static int64_t free_from(const VolImage *images, size_t count, size_t p, int64_t x, int64_t y, int64_t x1, int64_t *end)
{
    for (bool moved = true; moved;) {
        moved = false;
        *end = x1;
        for (size_t i = 0; i < count; i++) {
            VolBox2 b = images[i].parts[p].data_window;
            if (y < b.y0 || y > b.y1 || x > b.x1)
                continue;
            if (x >= b.x0) {
                x = (int64_t)b.x1 + 1;
                moved = true;
            } else if (b.x0 - 1 < *end) {
                *end = (int64_t)b.x0 - 1;
            }
        }
    }
    return x;
}

/* The first line below `y` where another set of crops begins to lie; past the frame: `bottom` + 1. */
static int64_t next_change(const VolImage *images, size_t count, size_t p, int64_t y, int64_t bottom)
{
    int64_t next = bottom + 1;
    for (size_t i = 0; i < count; i++) {
        VolBox2 b = images[i].parts[p].data_window;
        if (b.y0 > y && b.y0 < next)
            next = b.y0;
        if (b.y1 + INT64_C(1) > y && b.y1 + INT64_C(1) < next)
            next = b.y1 + INT64_C(1);
    }
    return next;
}

static VolStatus tell_hole(const VolImage *images, size_t count, size_t p, VolError *err)
{
    const VolPart *part = &images[0].parts[p];
    VolBox2 frame = part->display_window;
    int64_t y = frame.y0, end, x;
    while ((x = free_from(images, count, p, frame.x0, y, frame.x1, &end)) > frame.x1)
        y = next_change(images, count, p, y, frame.y1);
    int64_t below, next = y; /* the hole goes down while the same stretch is free */
    do
        next = next_change(images, count, p, next, frame.y1);
    while (next <= frame.y1 && free_from(images, count, p, x, next, frame.x1, &below) == x && below >= end);
    return vol_fail(err, VOL_NO, "cannot join '%s': a hole at (%lld,%lld)-(%lld,%lld)", part->name ? part->name : "frame",
                    (long long)x, (long long)y, (long long)end, (long long)next - 1);
}

/* Crops that do not overlap and lie within the frame cover it if they have as many pixels.  So the work, and the memory
 * that is taken for the frame, are those of the crops, whatever a display window claims. */
static VolStatus check_holes(const VolImage *images, size_t count, size_t p, VolError *err)
{
    VolBox2 frame = images[0].parts[p].display_window;
    uint64_t covered = 0;
    for (size_t i = 0; i < count; i++) {
        VolBox2 b = images[i].parts[p].data_window;
        covered += (uint64_t)vol_box2_width(b) * vol_box2_height(b);
    }
    return covered == (uint64_t)vol_box2_width(frame) * vol_box2_height(frame) ? VOL_OK : tell_hole(images, count, p, err);
}

/* ---- Joining ------------------------------------------------------------------------------------------------------- */

static VolStatus copy_attrs(const VolPart *from, VolPart *to, VolError *err)
{
    VolStatus status = VOL_OK;
    for (size_t i = 0; i < from->attr_count && !status; i++) {
        const VolAttr *attr = &from->attrs[i];
        if (attr->type == VOL_ATTR_TEXT)
            status = vol_part_set_text(to, attr->name, attr->text, err);
        else if (attr->type != VOL_ATTR_OTHER)
            status = vol_part_set_numbers(to, attr->name, attr->type, attr->number, err);
    }
    return status;
}

static VolStatus new_frame(const VolPart *like, VolImage *out, VolPart **frame, VolError *err)
{
    VolStatus status = vol_image_add_part(out, like->name, like->display_window, like->display_window, frame, err);
    if (status)
        return status;
    (*frame)->pixel_aspect = like->pixel_aspect;
    (*frame)->screen_width = like->screen_width;
    memcpy((*frame)->screen_center, like->screen_center, sizeof like->screen_center);
    VolChannel *channel;
    for (size_t c = 0; c < like->channel_count && !status; c++) {
        status = vol_part_add_channel(*frame, like->channels[c].name, like->channels[c].store, &channel, err);
        size_t pixels = vol_box2_width(like->display_window) * vol_box2_height(like->display_window);
        if (!status && like->channels[c].whole && !(channel->whole = vol_alloc_zero(pixels, sizeof *channel->whole)))
            status = vol_fail_memory(err, pixels * sizeof *channel->whole);
    }
    return status ? status : copy_attrs(like, *frame, err);
}

static void paste(const VolPart *crop, VolPart *frame)
{
    size_t width = vol_box2_width(crop->data_window), height = vol_box2_height(crop->data_window);
    size_t stride = vol_box2_width(frame->data_window);
    size_t left = (size_t)((int64_t)crop->data_window.x0 - frame->data_window.x0);
    size_t top = (size_t)((int64_t)crop->data_window.y0 - frame->data_window.y0);
    for (size_t c = 0; c < crop->channel_count; c++)
        for (size_t y = 0; y < height; y++) {
            const VolChannel *from = &crop->channels[c], *to = &frame->channels[c];
            size_t at = (top + y) * stride + left;
            memcpy(to->data + at, from->data + y * width, width * sizeof(float));
            if (to->whole && from->whole)
                memcpy(to->whole + at, from->whole + y * width, width * sizeof(uint32_t));
        }
}

VolStatus vol_join_images(const VolImage *images, const char *const *names, size_t count, VolImage *out, VolError *err)
{
    *out = (VolImage){0};
    VolStatus status = check_strangers(images, names, count, err);
    for (size_t p = 0; p < images[0].part_count && !status; p++) {
        status = check_overlaps(images, names, count, p, err);
        if (!status)
            status = check_holes(images, count, p, err);
    }
    for (size_t p = 0; p < images[0].part_count && !status; p++) {
        VolPart *frame;
        status = new_frame(&images[0].parts[p], out, &frame, err);
        for (size_t i = 0; i < count && !status; i++)
            paste(&images[i].parts[p], frame);
    }
    if (status)
        vol_image_free(out);
    return status;
}
