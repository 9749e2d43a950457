/* The pre-integrated estimators in float, for any machine. */
#include "trace/segments_tmpl.h"

void vol_segments_f32(const VolScene *scene, VolScratch *scratch, const VolRay *rays, size_t count, VolRadiance *out)
{
    trace_segments(scene, scratch, rays, count, out);
}
