/* What of a transfer function attenuates light: extinctions and opacities, whatever their colours. */
#ifndef VOL_TF_ATTENUATION_H
#define VOL_TF_ATTENUATION_H

#include "tf/tf.h"

/* All of it anew, to be changed and freed by itself.  On failure there is nothing to free. */
VolStatus vol_tf_compiled_copy(const VolTfCompiled *tf, VolTfCompiled *out, VolError *err);

/* The same attenuation, nothing else: black, unshaded, without emission, and so without what merely emits. */
VolStatus vol_tf_attenuation_of(const VolTfCompiled *tf, VolTfCompiled *out, VolError *err);

/* A hash of all that light on its way depends on: extinction of surfaces, particles and `transport` between nodes,
 * isosurfaces with their opacities; not of colours, emission, phase functions, shading.  `tf` has its steps settled. */
VolStatus vol_tf_attenuation_hash(const VolTf *tf, uint64_t out[2], VolError *err);

#endif
