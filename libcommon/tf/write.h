/* A transfer function as JSON again: what was read from another program's file, or made in memory. */
#ifndef VOL_TF_WRITE_H
#define VOL_TF_WRITE_H

#include "tf/tf.h"

/* Reads back (vol_tf_parse) to the same numbers.  Allocated; VOL_NOMEM. */
VolStatus vol_tf_write(const VolTf *tf, char **text, VolError *err);

#endif
