#include "trace/trace.h"

#include <stdlib.h>

#include "base/mem.h"
#include "trace/gather.h"
#include "trace/lit.h"

bool vol_brick_store_new(VolBrickStore *store, size_t places, size_t size)
{
    store->numbers = vol_alloc(places, size);
    store->key = vol_alloc_zero(places, sizeof *store->key);
    store->places = places;
    return store->numbers && store->key;
}

void vol_brick_store_free(VolBrickStore *store)
{
    free(store->numbers);
    free(store->key);
    *store = (VolBrickStore){0};
}

/* What kernels of that precision need of light grids. */
static VolStatus lit_scratch(const VolScene *scene, bool precise, VolScratch *out, VolError *err)
{
    const VolLit *lit = scene->lit;
    size_t room = VOL_LIT_HEAD + (scene->light_count + lit->grid_count) * VOL_LIT_EACH;
    out->lit = vol_alloc_zero(lit->grid_count, sizeof *out->lit);
    out->lit_room = vol_alloc_aligned(64, 1, room);
    if (!out->lit || !out->lit_room)
        return vol_fail_memory(err, room);
    for (size_t n = 0; n < lit->grid_count; n++) {
        VolStatus status = vol_gather_new(lit->grids[n], scene->cpu, precise, &out->lit[n], err);
        out->lit_count = n + 1;
        if (status)
            return status;
    }
    return VOL_OK;
}

static VolStatus scratch_of_precision(const VolPrepared *prepared, size_t real_size, VolScratch *out, VolError *err)
{
    enum { VALUES = 64, GRADIENTS = 256 };
    size_t size = real_size * VOL_BRICK_STRIDE;
    *out = (VolScratch){0};
    out->zeros = vol_alloc_zero(3, size);
    bool made = out->zeros && vol_brick_store_new(&out->values, VALUES, size) &&
                (!prepared->shaded || vol_brick_store_new(&out->gradients, GRADIENTS, 3 * size));
    if (!made)
        return vol_fail_memory(err, GRADIENTS * 3 * size);
    return prepared->scene->lit ? lit_scratch(prepared->scene, real_size == sizeof(double), out, err) : VOL_OK;
}

VolStatus vol_scratch_new(const VolPrepared *prepared, VolScratch *out, VolError *err)
{
    VolStatus status = scratch_of_precision(prepared, prepared->scene->precise ? sizeof(double) : sizeof(float), out, err);
    if (!status && prepared->gives_up) {
        out->in_double = vol_alloc_zero(1, sizeof *out->in_double);
        status = out->in_double ? scratch_of_precision(prepared, sizeof(double), out->in_double, err)
                                : vol_fail_memory(err, sizeof *out->in_double);
    }
    if (status)
        vol_scratch_free(out);
    return status;
}

void vol_scratch_free(VolScratch *scratch)
{
    if (scratch->in_double)
        vol_scratch_free(scratch->in_double);
    free(scratch->in_double);
    vol_brick_store_free(&scratch->values);
    vol_brick_store_free(&scratch->gradients);
    free(scratch->zeros);
    for (size_t n = 0; n < scratch->lit_count; n++)
        vol_gather_free(&scratch->lit[n]);
    free(scratch->lit);
    free(scratch->lit_room);
    *scratch = (VolScratch){0};
}

static VolTraceRays *kernel_of(const VolScene *scene, bool precise)
{
    enum { EXACT, DIRECT, SEGMENTS };
    static VolTraceRays *const plain[2][3] = {{vol_exact_f32, vol_direct_f32, vol_segments_f32},
                                             {vol_exact_f64, vol_direct_f64, vol_segments_f64}};
    int kind = scene->estimator == VOL_ESTIMATE_EXACT ? EXACT : scene->estimator == VOL_ESTIMATE_DIRECT ? DIRECT : SEGMENTS;
#if defined(__x86_64__)
    static VolTraceRays *const avx2[2][3] = {{vol_exact_f32_avx2, vol_direct_f32_avx2, vol_segments_f32_avx2},
                                            {vol_exact_f64_avx2, vol_direct_f64_avx2, vol_segments_f64_avx2}};
    static VolTraceRays *const avx512[3] = {vol_exact_f32_avx512, vol_direct_f32_avx512, vol_segments_f32_avx512};
    if (scene->cpu == VOL_CPU_AVX512 && !precise)
        return avx512[kind];
    if (vol_cpu_runs_avx2(scene->cpu))
        return avx2[precise][kind];
#endif
    return plain[precise][kind];
}

/* Adds what the rays met in double to the thread's counts. */
static void take_counts(VolScratch *scratch)
{
    VolSkipped *sum = &scratch->skipped, *some = &scratch->in_double->skipped;
    sum->bricks_entered += some->bricks_entered;
    sum->blocks += some->blocks;
    sum->cells_met += some->cells_met;
    sum->rays_ended += some->rays_ended;
    *some = (VolSkipped){0};
}

/* The rays that were given up. */
static void trace_in_double(const VolTraceCall *call)
{
    VolRay again[VOL_PACKET];
    VolRadiance got[VOL_PACKET];
    size_t place[VOL_PACKET], given_up = 0;
    for (size_t i = 0; i < call->count; i++)
        if (call->out[i].given_up) {
            again[given_up] = call->rays[i];
            place[given_up++] = i;
        }
    if (!given_up)
        return;
    VolTraceCall in_double = *call;
    in_double.scratch = call->scratch->in_double;
    in_double.rays = again;
    in_double.count = given_up;
    in_double.out = got;
    call->scratch->skipped.rays_in_double += given_up;
    kernel_of(call->prepared->scene, true)(&in_double);
    for (size_t n = 0; n < given_up; n++)
        call->out[place[n]] = got[n];
    take_counts(call->scratch);
}

/* A listener is told one way of a ray, not also the one that was given up: first each is traced in silence. */
static void trace_aloud(const VolTraceCall *call)
{
    VolTraceRays *kernel = kernel_of(call->prepared->scene, false);
    for (size_t i = 0; i < call->count; i++) {
        VolTraceCall one = *call;
        one.rays = &call->rays[i];
        one.count = 1;
        one.out = &call->out[i];
        one.listener = NULL;
        kernel(&one);
        one.listener = call->listener;
        if (!call->out[i].given_up)
            kernel(&one);
    }
    trace_in_double(call);
}

/* Light is 0 or more.  A colour that runs to 0 at a node comes out a little below it where the field is that node's value
 * but for rounding. */
static void leave_no_negative(const VolTraceCall *call)
{
    static const int light[] = {VOL_SUM_SCATTER, VOL_SUM_EMIT, VOL_SUM_SURFACE};
    for (size_t i = 0; i < call->count; i++)
        for (int c = 0; c < 3; c++) {
            VolRadiance *out = &call->out[i];
            out->color[c] = out->color[c] < 0 ? 0 : out->color[c];
            for (size_t n = 0; n < sizeof light / sizeof *light; n++)
                out->sum[light[n]][c] = out->sum[light[n]][c] < 0 ? 0 : out->sum[light[n]][c];
        }
}

void vol_trace_rays(const VolTraceCall *call)
{
    const VolPrepared *prepared = call->prepared;
    if (call->listener && prepared->gives_up) {
        trace_aloud(call);
    } else {
        kernel_of(prepared->scene, prepared->scene->precise)(call);
        if (prepared->gives_up)
            trace_in_double(call);
    }
    leave_no_negative(call);
}
