/* Images: part by part, channel by channel. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "compare/compare.h"

typedef struct ImagePair {
    const VolTolerance *tolerance;
    VolReport *report;
    VolImage *difference;
    VolError *err;
    char prefix[300]; /* "part 'NAME', " or "" */
} ImagePair;

static const char *part_name(const VolPart *part) { return part->name ? part->name : "unnamed"; }

static const VolPart *partner(const VolPart *part, const VolImage *own, const VolImage *other)
{
    if (own->part_count == 1 && other->part_count == 1)
        return &other->parts[0];
    for (size_t i = 0; i < other->part_count; i++)
        if (strcmp(part_name(&other->parts[i]), part_name(part)) == 0)
            return &other->parts[i];
    return NULL;
}

/* "(0,0)-(511,511)" */
static void window_text(VolBox2 b, char text[64]) { snprintf(text, 64, "(%d,%d)-(%d,%d)", b.x0, b.y0, b.x1, b.y1); }

static bool same_window(VolBox2 a, VolBox2 b) { return a.x0 == b.x0 && a.y0 == b.y0 && a.x1 == b.x1 && a.y1 == b.y1; }

static VolStatus compare_windows(ImagePair *pair, const char *which, VolBox2 a, VolBox2 b, bool *same)
{
    char text_a[64], text_b[64];
    if (same_window(a, b))
        return VOL_OK;
    *same = false;
    window_text(a, text_a);
    window_text(b, text_b);
    return vol_report(pair->report, pair->err, "%s%s window: %s and %s", pair->prefix, which, text_a, text_b);
}

/* The channel of the difference image, or NULL where none is wanted. */
static VolStatus difference_channel(ImagePair *pair, const char *name, float **out)
{
    *out = NULL;
    if (!pair->difference)
        return VOL_OK;
    VolChannel *channel;
    VolPart *part = &pair->difference->parts[pair->difference->part_count - 1];
    VolStatus status = vol_part_add_channel(part, name, VOL_PIXEL_FLOAT, &channel, pair->err);
    if (!status)
        *out = channel->data;
    return status;
}

static VolStatus compare_channel(ImagePair *pair, VolBox2 window, const VolChannel *a, const VolChannel *b)
{
    float *difference;
    VolStatus status = difference_channel(pair, a->name, &difference);
    if (status)
        return status;
    VolDeviation deviation = {0};
    size_t width = vol_box2_width(window), height = vol_box2_height(window), i = 0;
    for (size_t y = 0; y < height; y++)
        for (size_t x = 0; x < width; x++, i++) {
            double va = vol_channel_value(a, i), vb = vol_channel_value(b, i);
            vol_deviation_add(&deviation, pair->tolerance, va, vb, 1,
                              (const int64_t[3]){window.x0 + (int64_t)x, window.y0 + (int64_t)y, 0});
            if (difference)
                difference[i] = isfinite(va) && isfinite(vb) ? (float)fabs(va - vb) : NAN;
        }
    char what[600];
    snprintf(what, sizeof what, "%schannel '%s'", pair->prefix, a->name);
    return vol_deviation_report(&deviation, pair->tolerance, what, 2, pair->report, pair->err);
}

static VolStatus compare_channels(ImagePair *pair, const VolPart *a, const VolPart *b, bool pixels)
{
    VolStatus status = VOL_OK;
    for (size_t i = 0; i < a->channel_count && !status; i++) {
        const VolChannel *other = vol_part_channel(b, a->channels[i].name);
        if (!other)
            status = vol_report(pair->report, pair->err, "%schannel '%s': only in the first", pair->prefix,
                                a->channels[i].name);
        else if (pixels)
            status = compare_channel(pair, a->data_window, &a->channels[i], other);
    }
    for (size_t i = 0; i < b->channel_count && !status; i++)
        if (!vol_part_channel(a, b->channels[i].name))
            status = vol_report(pair->report, pair->err, "%schannel '%s': only in the second", pair->prefix,
                                b->channels[i].name);
    return status;
}

/* Whether the parts have a channel in common (a part without channels cannot be written). */
static bool have_common_channel(const VolPart *a, const VolPart *b)
{
    for (size_t i = 0; i < a->channel_count; i++)
        if (vol_part_channel(b, a->channels[i].name))
            return true;
    return false;
}

static VolStatus compare_parts(ImagePair *pair, const VolPart *a, const VolPart *b)
{
    bool same_display = true, same_data = true;
    VolStatus status = compare_windows(pair, "display", a->display_window, b->display_window, &same_display);
    if (!status)
        status = compare_windows(pair, "data", a->data_window, b->data_window, &same_data);
    VolImage *difference = pair->difference;
    if (!same_data || !have_common_channel(a, b))
        pair->difference = NULL;
    VolPart *part;
    if (!status && pair->difference)
        status = vol_image_add_part(difference, a->name, a->data_window, a->display_window, &part, pair->err);
    if (!status)
        status = compare_channels(pair, a, b, same_data);
    pair->difference = difference;
    return status;
}

VolStatus vol_compare_images(const VolImage *a, const VolImage *b, const VolTolerance *tolerance, VolReport *report,
                             VolImage *difference, VolError *err)
{
    ImagePair pair = {.tolerance = tolerance, .report = report, .difference = difference, .err = err};
    VolStatus status = VOL_OK;
    if (difference)
        *difference = (VolImage){0};
    bool named = a->part_count > 1 || b->part_count > 1;
    for (size_t i = 0; i < a->part_count && !status; i++) {
        const VolPart *part = &a->parts[i], *other = partner(part, a, b);
        if (named)
            snprintf(pair.prefix, sizeof pair.prefix, "part '%.256s', ", part_name(part));
        if (other)
            status = compare_parts(&pair, part, other);
        else
            status = vol_report(report, err, "part '%s': only in the first", part_name(part));
    }
    for (size_t i = 0; i < b->part_count && !status; i++)
        if (!partner(&b->parts[i], b, a))
            status = vol_report(report, err, "part '%s': only in the second", part_name(&b->parts[i]));
    return status;
}
