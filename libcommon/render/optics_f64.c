/* Optical tables in double. */
#define VOL_DOUBLE
#include "render/optics.h"
#include "render/real.h"

#include "render/optics_build_tmpl.h"

VolStatus vol_optics_f64_new(const VolScene *scene, VolOpticsF64 **out, VolError *err)
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

void vol_optics_f64_free(VolOpticsF64 *optics)
{
    if (optics)
        free_optics(&optics->o);
    free(optics);
}
