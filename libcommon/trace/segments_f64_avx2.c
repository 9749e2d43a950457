/* The pre-integrated estimators in double, with AVX2 and fused multiply-add. */
#define VOL_DOUBLE
#include "trace/segments_tmpl.h"

void vol_segments_f64_avx2(const VolScene *scene, VolScratch *scratch, const VolRay *rays, size_t count, VolRadiance *out)
{
    trace_segments(scene, scratch, rays, count, out);
}
