/* Inside io/: where an output goes. */
#ifndef VOL_IO_OUT_TARGET_H
#define VOL_IO_OUT_TARGET_H

#include "io/out.h"

/* Links are followed to their end, there or not, so that the link stays; open descriptors are used as they stand. */
VolStatus vol_target_find(const char *path, VolOutOptions options, VolTarget *out, VolError *err);
void vol_target_free(VolTarget *target);

/* VOL_USAGE where `fd` is a terminal and binary output is not wanted there. */
VolStatus vol_target_refuse_terminal(int fd, const char *name, VolOutOptions options, VolError *err);

#endif
