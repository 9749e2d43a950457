/* Pictures of the common formats as floats: EXR by our own reader; Radiance HDR, PNG, JPEG and TIFF through
 * OpenImageIO, loaded when the first such picture comes.  And PNG out, for plots. */
#ifndef VOL_IO_PIXELS_H
#define VOL_IO_PIXELS_H

#include <stdbool.h>

#include "base/log.h"
#include "base/mem.h"
#include "base/status.h"
#include "io/exr.h"

typedef struct VolPixels {
    int width, height;
    int channels; /* 1 (grey), 3 (RGB) or 4 (RGBA) */
    float *data;  /* interleaved, row 0 on top */
    VolBox2 window; /* where these pixels lie */
    VolBox2 frame;  /* what is meant to be seen: an EXR's display window; of other formats the same as `window` */
} VolPixels;

typedef enum VolPixelsUse {
    VOL_PIXELS_COLOR, /* a picture: colours or luminance, nothing else */
    VOL_PIXELS_LOOK,  /* to look at: else any channel that is alone */
    VOL_PIXELS_DATA   /* the file's numbers as they are (255 stays 255, -32767 stays -32767), for heights and other data */
} VolPixelsUse;

/* Colours come out linear Rec.709: pictures of 8 or 16 unsigned bits are decoded from sRGB (unless they say they are linear)
 * to 0..1, then multiplied by alpha where the file's are not.  Grey with alpha becomes RGBA.
 * NaN and infinities are left as they are.  EXR: R G B [A] of the first part or layer that has them, else luminance or an R
 * without G and B, else, but for VOL_PIXELS_COLOR, a channel that is alone or a layer named as depth and other data are; a
 * note says which, a warning where others could have been meant.
 * `name`: for messages.
 * VOL_BAD_INPUT: not a picture, damaged, or more than 4 channels. */
VolStatus vol_pixels_read(const VolBytes *bytes, const char *name, VolPixelsUse use, const VolLog *log, VolPixels *out,
                          VolError *err);
void vol_pixels_free(VolPixels *pixels);

/* sRGB bytes, three per pixel, row 0 on top -> a PNG file. */
VolStatus vol_png_encode(const unsigned char *rgb, int width, int height, VolBytes *out, VolError *err);

/* Whether a PNG is complete and its checksums hold; the signature has been seen. */
VolStatus vol_png_check(const VolBytes *bytes, const char *name, VolError *err);

#endif
