/* An EXR image as people look at it. */
#ifndef VOL_INSPECT_PICTURE_H
#define VOL_INSPECT_PICTURE_H

#include "base/mem.h"
#include "base/status.h"

/* The first part's data window as an 8-bit PNG: R G B (else Y, or the only channel, as grey), premultiplied, so over black;
 * cut to 0..1 and encoded as sRGB.  A pixel with a NaN in its colour is magenta.  VOL_BAD_INPUT: no such channels. */
VolStatus vol_picture_png(const VolBytes *exr, const char *name, VolBytes *png, VolError *err);

#endif
