/* The transfer function that indirect light of `cone` meets (K 12): `transport` in place of the particles, surfaces and
 * isosurfaces as they are; nothing is sent. */
#ifndef VOL_LIGHT_TRANSPORT_H
#define VOL_LIGHT_TRANSPORT_H

#include "tf/tf.h"

/* What attenuates stands as `absorb`.  vol_tf_compiled_free() is to follow whatever comes of it. */
VolStatus vol_transport_of(const VolTfCompiled *tf, VolTfCompiled *out, VolError *err);

#endif
