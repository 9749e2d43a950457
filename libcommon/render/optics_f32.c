/* Optical tables in float. */
#include "render/optics.h"
#include "render/real.h"

#include "render/optics_build_tmpl.h"

VolStatus vol_optics_f32_new(const VolScene *scene, VolOpticsF32 **out, VolError *err)
{
    *out = vol_alloc_zero(1, sizeof **out);
    if (!*out)
        return vol_fail_memory(err, sizeof **out);
    VolStatus status = build_optics(scene, &(*out)->o, err);
    if (status) {
        free(*out);
        *out = NULL;
    }
    return status;
}

void vol_optics_f32_free(VolOpticsF32 *optics)
{
    if (optics)
        free_optics(&optics->o);
    free(optics);
}
