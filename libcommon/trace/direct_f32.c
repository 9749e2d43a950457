/* The direct estimator in float, for any machine. */
#include "trace/direct_tmpl.h"

void vol_direct_f32(const VolScene *scene, VolScratch *scratch, const VolRay *rays, size_t count, VolRadiance *out)
{
    trace_direct(scene, scratch, rays, count, out);
}
