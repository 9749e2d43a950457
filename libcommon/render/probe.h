/* `--probe`: what single pixels are made of, as JSON in 17 digits. */
#ifndef VOL_RENDER_PROBE_H
#define VOL_RENDER_PROBE_H

#include "base/mem.h"
#include "render/frame.h"

/* `places`: "X,Y" in whole pixels.  {"pixels": [{"x": 1, "y": 2, "channels": {"R": ..}, "trace": [..]}]}; `trace` has one
 * entry per stretch of each ray where asked for.  VOL_USAGE: not two whole numbers, or outside the picture. */
VolStatus vol_probe_json(VolFrame *frame, const char *const *places, size_t count, bool trace, VolBytes *out,
                         VolError *err);

#endif
