/* A scene put together from what programs load: the field, what makes it visible, lights, clip planes. */
#ifndef VOL_LOAD_ASSEMBLY_H
#define VOL_LOAD_ASSEMBLY_H

#include "base/log.h"
#include "load/appearance.h"
#include "load/light_grids.h"
#include "trace/scene.h"

typedef struct VolAssembly {
    VolVolume volume;
    VolAppearance appearance;
    VolLight *lights;
    VolClip *clips;
    VolLightGrids light_grids;
    VolScene scene; /* of the above, which all belong to the assembly */
} VolAssembly;

/* Fits what was read into `appearance` to `volume` (vol_appearance_fit) and shows the scene both. */
VolStatus vol_assemble_appearance(VolAssembly *assembly, const VolAppearanceSettings *settings, const VolLog *log,
                                  VolError *err);

/* Of specifications as in lights.h; none: one light from the eye.  VOL_USAGE. */
VolStatus vol_assemble_lights(VolAssembly *assembly, const char *const *specs, size_t count, VolError *err);

/* Those of the light grids, if there are any, which light the scene from then on; when the volume and its appearance are
 * there.  VOL_BAD_INPUT: they do not cover the volume. */
VolStatus vol_assemble_light_grids(VolAssembly *assembly, VolError *err);

/* Of "NX,NY,NZ,D": keeps n.x >= D, world units.  VOL_USAGE. */
VolStatus vol_assemble_clips(VolAssembly *assembly, const char *const *planes, size_t count, VolError *err);

/* Black pictures have reasons: says the one that it knows, values in the user's units.  False: none. */
bool vol_assembly_explains_nothing(const VolAssembly *assembly, const VolLog *log);

void vol_assembly_free(VolAssembly *assembly);

#endif
