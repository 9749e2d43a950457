/* Which of an EXR's parts and channels make a picture. */
#ifndef VOL_IO_PIXELS_EXR_H
#define VOL_IO_PIXELS_EXR_H

#include "io/exr.h"
#include "io/pixels.h"

typedef struct VolColors {
    size_t part;
    const VolChannel *channels[4]; /* R G B [A], or one */
    int count;                     /* 0: no picture */
    char layer[64];                /* "rgba" of rgba.R; "": none */
    size_t rivals;                 /* others that could have been meant just as well */
    bool only_data, only_chroma;   /* why there is none: layers of data; Y with RY and BY */
} VolColors;

/* In this order: R G B of a part, those of a layer (first those with names like rgba or beauty), luminance, R with
 * neither G nor B.  But for VOL_PIXELS_COLOR then also the one channel of a part that has no other, and the colours of
 * layers and parts whose names are those of data: depth, normals, identities. */
VolColors vol_exr_colors(const VolImage *image, VolPixelsUse use);

#endif
