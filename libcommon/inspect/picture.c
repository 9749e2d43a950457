#include "inspect/picture.h"

#include <math.h>
#include <stdlib.h>

#include "base/fmath.h"
#include "io/pixels.h"

/* IEC 61966-2-1, to the nearest of 256 steps.  The caller has dealt with NaN. */
static unsigned char encode_srgb(double linear)
{
    double v = fmin(fmax(linear, 0), 1);
    double encoded = v <= 0.0031308 ? 12.92 * v : 1.055 * vol_pow(v, 1 / 2.4) - 0.055;
    return (unsigned char)floor(255 * encoded + 0.5);
}

/* `color` has one channel or three. */
static void show_pixel(const float *color, size_t channels, unsigned char rgb[3])
{
    for (size_t c = 0; c < 3; c++) {
        float v = color[c % channels];
        if (isnan(v)) {
            rgb[0] = rgb[2] = 255;
            rgb[1] = 0;
            return;
        }
        rgb[c] = encode_srgb((double)v);
    }
}

VolStatus vol_picture_png(const VolBytes *exr, const char *name, const VolLog *log, VolBytes *png, VolError *err)
{
    VolPixels pixels;
    *png = (VolBytes){0};
    VolStatus status = vol_pixels_read(exr, name, VOL_PIXELS_LOOK, log, &pixels, err);
    if (status)
        return status;
    size_t count = (size_t)pixels.width * (size_t)pixels.height, stride = (size_t)pixels.channels;
    unsigned char *rgb = vol_alloc(count, 3);
    if (!rgb) {
        status = vol_fail_memory(err, count * 3);
    } else {
        for (size_t i = 0; i < count; i++)
            show_pixel(pixels.data + i * stride, stride < 3 ? 1 : 3, rgb + 3 * i);
        status = vol_png_encode(rgb, pixels.width, pixels.height, png, err);
    }
    free(rgb);
    vol_pixels_free(&pixels);
    return status;
}
