#include "light/cone_medium.h"

#include <stdlib.h>

#include "base/fmath.h"
#include "base/mem.h"
#include "light/transport.h"

VolStatus vol_cone_medium_new(const VolScene *scene, int samples, int threads, VolConeMedium *out, VolError *err)
{
    *out = (VolConeMedium){.transport = vol_alloc_zero(1, sizeof *out->transport)};
    if (!out->transport)
        return vol_fail_memory(err, sizeof *out->transport);
    VolStatus status = vol_transport_of(scene->tf, out->transport, err);
    out->channels = out->transport->coloured ? 3 : 1;
    return status == VOL_OK ? vol_depths_new(scene, out->transport, samples, threads, &out->depths, err) : status;
}

void vol_cone_medium_free(VolConeMedium *medium)
{
    vol_depths_free(&medium->depths);
    if (medium->transport)
        vol_tf_compiled_free(medium->transport);
    free(medium->transport);
    *medium = (VolConeMedium){0};
}

VolStatus vol_cone_medium_pass(void *user, const VolConePlanes *planes, int32_t k, int32_t i, int thread,
                               float *const passed[3], VolError *err)
{
    enum { SOME = 256 };
    const VolConeMedium *m = user;
    VolVec3 from[SOME], to[SOME];
    double depth[SOME][3];
    for (int32_t first = 0; first < planes->size[1]; first += SOME) {
        int32_t count = planes->size[1] - first < SOME ? planes->size[1] - first : SOME;
        for (int32_t j = 0; j < count; j++) {
            from[j] = vol_cone_place(planes, k, i, first + j);
            to[j] = vol_cone_place(planes, k + 1, i, first + j);
        }
        VolStatus status = vol_depths_between(&m->depths, thread, from, to, (size_t)count, depth, err);
        if (status != VOL_OK)
            return status;
        for (int32_t j = 0; j < count; j++)
            for (int c = 0; c < m->channels; c++)
                passed[c][first + j] = depth[j][c] > 0 ? (float)vol_exp(-depth[j][c]) : 1;
    }
    return VOL_OK;
}
