/* The exact estimator in double, for any machine. */
#define VOL_DOUBLE
#include "trace/exact_tmpl.h"

void vol_exact_f64(const VolScene *scene, VolScratch *scratch, const VolRay *rays, size_t count, VolRadiance *out)
{
    trace_exact(scene, scratch, rays, count, out);
}
