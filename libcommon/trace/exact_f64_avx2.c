/* The exact estimator in double, with AVX2 and fused multiply-add. */
#define VOL_DOUBLE
#include "trace/exact_tmpl.h"

void vol_exact_f64_avx2(const VolScene *scene, VolScratch *scratch, const VolRay *rays, size_t count, VolRadiance *out)
{
    trace_exact(scene, scratch, rays, count, out);
}
