#include "render/backdrop.h"

#include <ctype.h>
#include <float.h>
#include <inttypes.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/number.h"

/* "plates/sky", "sky.exr": more likely a file that is missing than a colour misspelt (white, 0.5, #ffffff). */
static bool looks_like_a_file(const char *text)
{
    const char *dot = strrchr(text, '.');
    return strchr(text, '/') || (dot && isalpha((unsigned char)dot[1]));
}

VolStatus vol_backdrop_parse(const char *text, bool exists, double color[3], bool *is_file, VolError *err)
{
    *is_file = false;
    if (vol_parse_reals(text, color, 3, 3) == 3) {
        for (int c = 0; c < 3; c++)
            if (!(color[c] >= 0 && color[c] <= FLT_MAX))
                return vol_fail(err, VOL_USAGE, "--background %s: %s", text,
                                color[c] < 0 ? "a colour is negative" : "no pixel can be as bright");
        return VOL_OK;
    }
    *is_file = exists || looks_like_a_file(text) || strcmp(text, "-") == 0;
    if (*is_file)
        return VOL_OK;
    return vol_fail(err, VOL_USAGE,
                    "--background '%s': neither a file nor a colour: colours are three numbers R,G,B, so 1,1,1 is white",
                    text);
}

static bool has_size(VolBox2 box, int64_t width, int64_t height)
{
    return (int64_t)box.x1 - box.x0 + 1 == width && (int64_t)box.y1 - box.y0 + 1 == height;
}

/* Where in the plane of the pixels the picture's first pixel lies. */
static VolStatus choose_origin(const VolPixels *pixels, const char *name, int64_t width, int64_t height, int64_t origin[2],
                               VolError *err)
{
    VolBox2 frame = pixels->frame, window = pixels->window;
    bool framed = has_size(frame, width, height);
    if (framed || has_size(window, width, height)) {
        origin[0] = framed ? frame.x0 : window.x0;
        origin[1] = framed ? frame.y0 : window.y0;
        return VOL_OK;
    }
    int64_t frame_width = (int64_t)frame.x1 - frame.x0 + 1, frame_height = (int64_t)frame.y1 - frame.y0 + 1;
    if (has_size(frame, pixels->width, pixels->height))
        return vol_fail(err, VOL_BAD_INPUT,
                        "background '%s' is %dx%d, the picture %" PRId64 "x%" PRId64 ": give --size %dx%d", name,
                        pixels->width, pixels->height, width, height, pixels->width, pixels->height);
    return vol_fail(err, VOL_BAD_INPUT,
                    "background '%s' shows %" PRId64 "x%" PRId64 " of its %dx%d pixels, the picture is %" PRId64 "x%" PRId64
                    ": give --size %" PRId64 "x%" PRId64 ", or %dx%d for all",
                    name, frame_width, frame_height, pixels->width, pixels->height, width, height, frame_width, frame_height,
                    pixels->width, pixels->height);
}

/* One row of the picture, and of the pixels that lie there; false: one of them is not finite. */
static bool copy_row(const VolPixels *pixels, const float *from, float *to, int64_t count, double *largest)
{
    size_t stride = (size_t)pixels->channels, colors = pixels->channels >= 3 ? 1 : 0;
    for (int64_t x = 0; x < count; x++, from += stride, to += 3)
        for (size_t c = 0; c < 3; c++) {
            to[c] = from[c * colors];
            *largest = fmax(*largest, fabs((double)to[c]));
            if (!isfinite(to[c]))
                return false;
        }
    return true;
}

VolStatus vol_backdrop_fit(const VolPixels *pixels, const char *name, int64_t width, int64_t height, const VolLog *log,
                           float **rgb, double *largest, VolError *err)
{
    int64_t origin[2] = {0};
    VolBox2 window = pixels->window;
    *rgb = NULL;
    *largest = 0;
    VolStatus status = choose_origin(pixels, name, width, height, origin, err);
    if (status)
        return status;
    float *out = vol_alloc_zero((size_t)width * (size_t)height, 3 * sizeof *out);
    if (!out)
        return vol_fail_memory(err, (size_t)width * (size_t)height * 3 * sizeof *out);
    /* The pixels that are seen, counted from the picture's first. */
    int64_t left = window.x0 - origin[0], right = window.x1 - origin[0] + 1;
    int64_t top = window.y0 - origin[1], bottom = window.y1 - origin[1] + 1;
    int64_t x0 = left > 0 ? left : 0, x1 = right < width ? right : width;
    int64_t y0 = top > 0 ? top : 0, y1 = bottom < height ? bottom : height;
    for (int64_t y = y0; y < y1 && x0 < x1; y++) {
        const float *from = pixels->data + ((y - top) * pixels->width + x0 - left) * pixels->channels;
        if (!copy_row(pixels, from, out + (y * width + x0) * 3, x1 - x0, largest)) {
            free(out);
            return vol_fail(err, VOL_BAD_INPUT, "background '%s' has a pixel that is NaN or infinite", name);
        }
    }
    if (x0 >= x1 || y0 >= y1)
        vol_warn(log, "no pixel of background '%s' lies within its display window: it is black", name);
    *rgb = out;
    return VOL_OK;
}
