/* Light specifications: sun:DX,DY,DZ[:R,G,B], point:X,Y,Z[:R,G,B], spot:X,Y,Z,DX,DY,DZ,DEG[:R,G,B]. */
#ifndef VOL_TRACE_LIGHTS_H
#define VOL_TRACE_LIGHTS_H

#include "base/status.h"
#include "trace/scene.h"

/* VOL_USAGE on anything else: unknown kind, wrong number of values, a direction of no length, an angle outside (0, 180],
 * negative colours. */
VolStatus vol_light_parse(const char *spec, VolLight *out, VolError *err);

/* White, from the eye: what shades surfaces where no light is given. */
VolLight vol_light_head(void);

#endif
