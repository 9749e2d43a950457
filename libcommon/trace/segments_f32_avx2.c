/* The pre-integrated estimators in float, with AVX2 and fused multiply-add. */
#include "trace/segments_tmpl.h"

void vol_segments_f32_avx2(const VolScene *scene, VolScratch *scratch, const VolRay *rays, size_t count, VolRadiance *out)
{
    trace_segments(scene, scratch, rays, count, out);
}
