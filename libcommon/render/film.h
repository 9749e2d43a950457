/* From pixels to an EXR image: channels, layers and the camera attributes. */
#ifndef VOL_RENDER_FILM_H
#define VOL_RENDER_FILM_H

#include "base/status.h"
#include "io/exr.h"
#include "render/frame.h"

/* Channels of one pixel, in the order of vol_film_channel_name: R G B A, AR AG AB where attenuation is coloured, then the
 * layers asked for, then the frame's passes.  `values` holds at least VOL_FILM_CHANNELS. */
enum { VOL_FILM_CHANNELS = 7 + 3 * (VOL_LAYERS + VOL_PASSES) };
size_t vol_film_channels(const VolFrame *frame, const VolPixelValue *pixel, const char *names[VOL_FILM_CHANNELS],
                         double values[VOL_FILM_CHANNELS]);

/* An image that is being filled. */
typedef struct VolFilm {
    const VolFrame *frame;
    float *planes[VOL_FILM_CHANNELS];
    size_t channels;
} VolFilm;

/* Makes the image of `width` x `height` pixels at (x0, y0) within the camera's full display window.  Z, A and steps stay
 * float where `half` is asked for. */
VolStatus vol_film_begin(const VolFrame *frame, int64_t x0, int64_t y0, int64_t width, int64_t height, bool half,
                         VolImage *image, VolFilm *film, VolError *err);

/* Pixel number `index`, row by row; `film` is a VolFilm (a VolPixelPut). */
void vol_film_put(void *film, size_t index, const VolPixelValue *pixel);

#endif
