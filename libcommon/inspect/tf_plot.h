/* A transfer function as a picture: every function's curve and colours over the histogram of the data, and the phase
 * function around the direction of the light. */
#ifndef VOL_INSPECT_TF_PLOT_H
#define VOL_INSPECT_TF_PLOT_H

#include "base/mem.h"
#include "inspect/inspect.h"
#include "tf/tf.h"

/* From lo to hi at least, widened to the data's range.  `data`: its histogram, or NULL.  A PNG. */
VolStatus vol_tf_plot(const VolTf *tf, const VolTfCompiled *compiled, double lo, double hi, const VolSeries *data,
                      VolBytes *png, VolError *err);

#endif
