#include "trace/gather.h"

VolStatus vol_gather_new(const VolGrid *field, VolCpu cpu, bool precise, VolGather *out, VolError *err)
{
    enum { PLACES = 2 * VOL_PACKET };
    size_t size = (precise ? sizeof(double) : sizeof(float)) * (size_t)vol_grid_planes(field) * VOL_BRICK_STRIDE;
    *out = (VolGather){.field = field, .cpu = cpu, .precise = precise};
    return vol_brick_store_new(&out->store, PLACES, size) ? VOL_OK : vol_fail_memory(err, PLACES * size);
}

void vol_gather_free(VolGather *gather)
{
    vol_brick_store_free(&gather->store);
    *gather = (VolGather){0};
}

void vol_gather(VolGather *gather, const VolVec3 *points, size_t count, double *out)
{
    VolGatherPoints *kernel = gather->precise ? vol_gather_f64 : vol_gather_f32;
#if defined(__x86_64__)
    if (vol_cpu_runs_avx2(gather->cpu))
        kernel = gather->precise ? vol_gather_f64_avx2 : vol_gather_f32_avx2;
    if (gather->cpu == VOL_CPU_AVX512 && !gather->precise)
        kernel = vol_gather_f32_avx512;
#endif
    kernel(gather, points, count, out);
}
