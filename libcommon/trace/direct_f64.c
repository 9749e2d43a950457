/* The direct estimator in double, for any machine. */
#define VOL_DOUBLE
#include "trace/direct_tmpl.h"

void vol_direct_f64(const VolScene *scene, VolScratch *scratch, const VolRay *rays, size_t count, VolRadiance *out)
{
    trace_direct(scene, scratch, rays, count, out);
}
