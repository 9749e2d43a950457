#include "io/pixels.h"

#include <limits.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "adapters/image.h"
#include "base/fmath.h"
#include "base/refusals.h"
#include "base/plugin.h"
#include "io/pixels_exr.h"

void vol_pixels_free(VolPixels *pixels)
{
    free(pixels->data);
    *pixels = (VolPixels){0};
}

static VolStatus load_adapter(const VolImageAdapter **out, VolError *err)
{
    const void *table;
    VolStatus status = vol_plugin("image", &table, err);
    if (status)
        return status;
    *out = table;
    if ((*out)->version != VOL_IMAGE_ADAPTER_VERSION)
        return vol_fail(err, VOL_BAD_INPUT, "cannot use 'pellucid-image.so': it is of another version");
    return VOL_OK;
}

static VolStatus take(VolPixels *out, size_t width, size_t height, int channels, VolError *err)
{
    size_t count;
    if (width > INT_MAX || height > INT_MAX || __builtin_mul_overflow(width * height, (size_t)channels, &count))
        return vol_fail_memory(err, SIZE_MAX);
    VolBox2 all = {0, 0, (int32_t)width - 1, (int32_t)height - 1};
    *out = (VolPixels){.width = (int)width, .height = (int)height, .channels = channels, .window = all, .frame = all};
    out->data = vol_alloc(count, sizeof *out->data);
    return out->data ? VOL_OK : vol_fail_memory(err, count * sizeof *out->data);
}

/* ---- EXR ----------------------------------------------------------------------------------------------------------- */

/* "cannot use EXR 'x': no channels R G B, nor luminance, among Z, id" */
static VolStatus no_picture(const VolImage *image, const VolColors *colors, const char *name, VolError *err)
{
    char list[200] = "";
    size_t length = 0;
    for (size_t p = 0; p < image->part_count; p++)
        for (size_t c = 0; c < image->parts[p].channel_count && length < sizeof list; c++)
            length += (size_t)snprintf(list + length, sizeof list - length, "%s%s", length ? " " : "",
                                       image->parts[p].channels[c].name);
    const char *what = colors->only_chroma || colors->only_data ? "its channels are"
                                                                : "no channels R G B, nor luminance (Y), among";
    const char *why = colors->only_chroma ? ": luminance and chroma (Y, RY, BY) are not read: save it as R, G, B"
                      : colors->only_data ? ": depth, normals, identities and the like are no picture" : "";
    return vol_fail(err, VOL_BAD_INPUT, "cannot use EXR '%s': %s %s%s%s", name, what, list,
                    length >= sizeof list ? " ..." : "", why);
}

static void tell_choice(const VolImage *image, const VolColors *colors, const char *name, const VolLog *log)
{
    const VolPart *part = &image->parts[colors->part];
    char what[200];
    if (colors->layer[0])
        snprintf(what, sizeof what, "layer '%s' of part %zu", colors->layer, colors->part);
    else
        snprintf(what, sizeof what, "part %zu%s%.100s%s", colors->part, part->name ? " ('" : "",
                 part->name ? part->name : "", part->name ? "')" : "");
    if (colors->rivals)
        vol_warn(log, "the picture is %s of '%s': %zu more could be meant", what, name, colors->rivals);
    else if (image->part_count > 1 || colors->layer[0])
        vol_note(log, "the picture is %s of '%s'", what, name);
}

/* Their numbers are taken as they are. */
static void warn_of_primaries(const VolPart *part, const char *name, const VolLog *log)
{
    static const double rec709[8] = {0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.3127, 0.329};
    const VolAttr *primaries = vol_part_attr(part, "chromaticities");
    bool other = false;
    for (int i = 0; primaries && primaries->type == VOL_ATTR_CHROMATICITIES && i < 8; i++)
        other = other || fabs(primaries->number[i] - rec709[i]) > 0.002;
    if (other)
        vol_warn(log, "the primaries of '%s' are not those of Rec.709: its colours will look different", name);
}

static VolStatus from_exr(const VolBytes *bytes, const char *name, VolPixelsUse use, const VolLog *log, VolPixels *out,
                          VolError *err)
{
    VolImage image;
    VolStatus status = vol_exr_read(bytes, name, &image, err);
    if (status)
        return status;
    VolColors colors = vol_exr_colors(&image, use);
    const VolPart *part = &image.parts[colors.part];
    size_t width = vol_box2_width(part->data_window), height = vol_box2_height(part->data_window);
    status = colors.count ? take(out, width, height, colors.count, err) : no_picture(&image, &colors, name, err);
    if (!status) {
        out->window = part->data_window;
        out->frame = part->display_window;
        tell_choice(&image, &colors, name, log);
        if (use == VOL_PIXELS_COLOR && colors.count >= 3)
            warn_of_primaries(part, name, log);
    }
    for (size_t i = 0; i < width * height && !status; i++)
        for (int c = 0; c < colors.count; c++)
            out->data[i * (size_t)colors.count + (size_t)c] = colors.channels[c]->data[i];
    vol_image_free(&image);
    return status;
}

/* ---- Others -------------------------------------------------------------------------------------------------------- */

static const char *format_of(const VolBytes *bytes)
{
    static const struct {
        const char *magic;
        size_t size;
        const char *format;
    } kinds[] = {{"\x89PNG\r\n\x1a\n", 8, "png"}, {"\xff\xd8\xff", 3, "jpeg"}, {"II*\0", 4, "tiff"},
                 {"MM\0*", 4, "tiff"}, {"II+\0", 4, "tiff"}, {"MM\0+", 4, "tiff"}, {"#?", 2, "hdr"}};
    for (size_t i = 0; i < sizeof kinds / sizeof *kinds; i++)
        if (bytes->size > kinds[i].size && memcmp(bytes->data, kinds[i].magic, kinds[i].size) == 0)
            return kinds[i].format;
    return NULL;
}

/* IEC 61966-2-1. */
static float decode_srgb(float v)
{
    double e = (double)v;
    return (float)(e <= 0.04045 ? e / 12.92 : vol_pow((e + 0.055) / 1.055, 2.4));
}

/* The file's numbers -> linear, premultiplied. */
static void linearise(const VolImageAdapterPixels *from)
{
    size_t n = (size_t)from->width * (size_t)from->height, channels = (size_t)from->channels;
    for (size_t i = 0; i < n; i++) {
        float *pixel = from->data + i * channels;
        for (size_t c = 0; c < channels; c++) {
            pixel[c] /= from->scale;
            if (from->encoded && (int)c != from->alpha)
                pixel[c] = decode_srgb(pixel[c]);
        }
        if (from->alpha >= 0 && from->unassociated)
            for (size_t c = 0; c < channels; c++)
                if ((int)c != from->alpha)
                    pixel[c] *= pixel[from->alpha];
    }
}

/* Grey with alpha becomes RGBA; the rest is as it is. */
static VolStatus arrange(const VolImageAdapterPixels *from, VolPixels *out, VolError *err)
{
    int channels = from->channels == 2 ? 4 : from->channels;
    VolStatus status = take(out, (size_t)from->width, (size_t)from->height, channels, err);
    size_t n = (size_t)from->width * (size_t)from->height;
    if (status)
        return status;
    if (from->channels != 2) {
        memcpy(out->data, from->data, n * (size_t)channels * sizeof *out->data);
        return VOL_OK;
    }
    for (size_t i = 0; i < n; i++) {
        float grey = from->data[2 * i], alpha = from->data[2 * i + 1];
        memcpy(out->data + 4 * i, (float[4]){grey, grey, grey, alpha}, 4 * sizeof(float));
    }
    return VOL_OK;
}

static VolStatus from_other(const VolBytes *bytes, const char *name, const char *format, bool raw, VolPixels *out,
                            VolError *err)
{
    const VolImageAdapter *adapter;
    VolStatus status = strcmp(format, "png") == 0 ? vol_png_check(bytes, name, err) : VOL_OK;
    if (!status)
        status = load_adapter(&adapter, err);
    if (status)
        return status;
    VolImageAdapterPixels pixels;
    char why[512] = "";
    int result = adapter->read(bytes->data, bytes->size, format, &pixels, why, sizeof why);
    if (result == 2 || (result && vol_memory_is_short(bytes->size)))
        return vol_fail_memory(err, bytes->size);
    if (result)
        return vol_fail(err, VOL_BAD_INPUT, "cannot read %s image '%s': %s", format, name, why);
    if (pixels.channels > 4) {
        status = vol_fail(err, VOL_BAD_INPUT, "cannot use %s image '%s': it has %d channels, more than 4", format, name,
                          pixels.channels);
    } else {
        if (!raw)
            linearise(&pixels);
        status = arrange(&pixels, out, err);
    }
    free(pixels.data);
    return status;
}

VolStatus vol_pixels_read(const VolBytes *bytes, const char *name, VolPixelsUse use, const VolLog *log, VolPixels *out,
                          VolError *err)
{
    *out = (VolPixels){0};
    if (bytes->size >= 4 && memcmp(bytes->data, "\x76\x2f\x31\x01", 4) == 0)
        return from_exr(bytes, name, use, log, out, err);
    const char *format = format_of(bytes);
    if (!format)
        return vol_fail(err, VOL_BAD_INPUT, "cannot read image '%s': not EXR, Radiance HDR, PNG, JPEG or TIFF",
                        name);
    return from_other(bytes, name, format, use == VOL_PIXELS_DATA, out, err);
}

VolStatus vol_png_encode(const unsigned char *rgb, int width, int height, VolBytes *out, VolError *err)
{
    *out = (VolBytes){0};
    const VolImageAdapter *adapter;
    VolStatus status = load_adapter(&adapter, err);
    if (status)
        return status;
    char why[512] = "";
    int result = adapter->encode_png(rgb, width, height, &out->data, &out->size, why, sizeof why);
    if (result) /* any picture can be encoded */
        return vol_fail_memory(err, (size_t)width * (size_t)height * 3);
    return VOL_OK;
}
