/* Inside tf/: how a list of nodes becomes extinction.  Others use tf.h. */
#ifndef VOL_TF_CONVERT_H
#define VOL_TF_CONVERT_H

/* Opacity 1 would be infinite extinction: it is taken as 1 - 2^-24, the largest float below 1. */
#define VOL_TF_LEAST_TRANSMITTANCE 0x1p-24

/* Nodes are inserted where the opacity of linear extinction differs by more than this from linear opacity. */
#define VOL_TF_LARGEST_DIFFERENCE 1e-3

/* The largest difference between the opacity 1 - exp(-x(u)), x linear in u from x0 to x1, and the straight line
 * between its ends; t0 = exp(-x0), t1 = exp(-x1). */
double vol_tf_opacity_difference(double t0, double x0, double t1, double x1);

#endif
