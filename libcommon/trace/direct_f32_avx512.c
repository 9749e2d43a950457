/* The direct estimator in float, with AVX-512. */
#include "trace/direct_tmpl.h"

void vol_direct_f32_avx512(const VolScene *scene, VolScratch *scratch, const VolRay *rays, size_t count, VolRadiance *out)
{
    trace_direct(scene, scratch, rays, count, out);
}
