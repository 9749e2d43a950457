/* What lies behind the volume, as users give it. */
#ifndef VOL_RENDER_BACKDROP_H
#define VOL_RENDER_BACKDROP_H

#include "base/log.h"
#include "io/pixels.h"
#include "render/frame.h"

/* "R,G,B" -> the colour; VOL_USAGE where `text` is nothing that could be a colour or the name of a file that is missing
 * (white, #fff, 1,1): a message that says how colours are written.  Is it the name of a file, `*is_file` is true. */
VolStatus vol_backdrop_parse(const char *text, bool exists, double color[3], bool *is_file, VolError *err);

/* The picture behind a frame of width x height pixels: what the pixels' display window shows, or, where that is of another
 * size, all of them; black where there are none.  Allocated, in *rgb, with its largest channel (absolute) in *largest.
 * VOL_BAD_INPUT: neither is of this size, or a pixel that is seen is not finite. */
VolStatus vol_backdrop_fit(const VolPixels *pixels, const char *name, int64_t width, int64_t height, const VolLog *log,
                           float **rgb, double *largest, VolError *err);

#endif
