/* The exact estimator in float, for any machine. */
#include "trace/exact_tmpl.h"

void vol_exact_f32(const VolScene *scene, VolScratch *scratch, const VolRay *rays, size_t count, VolRadiance *out)
{
    trace_exact(scene, scratch, rays, count, out);
}
