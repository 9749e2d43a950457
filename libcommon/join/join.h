/* Crops of one frame become the frame. */
#ifndef VOL_JOIN_JOIN_H
#define VOL_JOIN_JOIN_H

#include "base/status.h"
#include "io/exr.h"

/* `names` are for messages.  Everything but the data windows and the pixels must agree: parts, display windows, channels and
 * how they are stored, attributes (so also vol:argsHash, which does not depend on the crop); the result has them all, in the
 * order of the first, and the display window as data window: it is what rendering the whole frame would have given.
 * VOL_BAD_INPUT: an overlap, or a stranger (named, with what differs).  VOL_NO: a hole (named). */
VolStatus vol_join_images(const VolImage *images, const char *const *names, size_t count, VolImage *out, VolError *err);

#endif
