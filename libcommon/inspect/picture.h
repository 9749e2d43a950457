/* An EXR image as people look at it. */
#ifndef VOL_INSPECT_PICTURE_H
#define VOL_INSPECT_PICTURE_H

#include "base/log.h"
#include "base/mem.h"
#include "base/status.h"

/* A data window as an 8-bit PNG: R G B of the part or layer that has them (else Y, or a channel that is alone, as grey),
 * premultiplied, so over black; cut to 0..1 and encoded as sRGB.  A pixel with a NaN in its colour is magenta.
 * VOL_BAD_INPUT: no such channels. */
VolStatus vol_picture_png(const VolBytes *exr, const char *name, const VolLog *log, VolBytes *png, VolError *err);

#endif
