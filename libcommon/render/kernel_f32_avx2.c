/* The ray kernels in float, with AVX2 and fused multiply-add. */
#include "render/real.h"

#include "render/optics_tmpl.h"

#include "render/direct_tmpl.h"
#include "render/exact_tmpl.h"
#include "render/segments_tmpl.h"

void vol_exact_f32_avx2(const VolScene *scene, const VolRay *ray, VolRadiance *out) { trace_exact(scene, ray, out); }
void vol_direct_f32_avx2(const VolScene *scene, const VolRay *ray, VolRadiance *out) { trace_direct(scene, ray, out); }
void vol_segments_f32_avx2(const VolScene *scene, const VolRay *ray, VolRadiance *out) { trace_segments(scene, ray, out); }
