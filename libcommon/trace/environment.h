/* Light from all around: a picture of the whole sphere, and the suns that stand for it.
 *
 * Latitude by longitude as OpenEXR has it: row 0 is +y, the middle column +z, +x left of it.  Pixels are radiance. */
#ifndef VOL_TRACE_ENVIRONMENT_H
#define VOL_TRACE_ENVIRONMENT_H

#include <stdbool.h>
#include <stddef.h>

#include "base/log.h"
#include "base/status.h"
#include "base/vec.h"
#include "trace/scene.h"

typedef struct VolEnvironment {
    int width, height;
    float *rgb; /* interleaved, row 0 on top, as in the file */
    double *solid_angle; /* of a pixel of each row */
    double factor[3];
} VolEnvironment;

/* env:FILE[:R,G,B] -> the name (allocated) and the factors, 1 where they are not given.  `*is_one`: false, and nothing
 * else, where a specification is of another kind.  VOL_USAGE: no name, a factor negative or above 1e36. */
VolStatus vol_environment_parse(const char *spec, bool *is_one, char **file, double factor[3], VolError *err);

/* Of a picture's pixels: `channels` numbers each, grey or RGB in front, row 0 on top; copied.  `name`: for messages.
 * VOL_BAD_INPUT: one is NaN, infinite or negative, or too bright.  All black: a warning. */
VolStatus vol_environment_new(const float *pixels, int channels, int width, int height, const double factor[3],
                              const char *name, const VolLog *log, VolEnvironment *out, VolError *err);
void vol_environment_free(VolEnvironment *environment);

/* Where the light of a picture's place comes from, unit; column and row in pixels, their middles at .5. */
VolVec3 vol_environment_direction(const VolEnvironment *environment, double column, double row);

/* The integral of radiance over the sphere. */
void vol_environment_power(const VolEnvironment *environment, double rgb[3]);

/* By median cut: the region of the most luminance is halved by it across its longer side, until there are `most`, or none
 * with light can be cut.  Each sun comes from its region's mean direction and has its light, RGB = power / (4 pi); brightest
 * first, equal ones by row, then column of their regions' first pixels.  *count: how many; `suns` holds `most`. */
VolStatus vol_environment_suns(const VolEnvironment *environment, size_t most, VolLight *suns, size_t *count, VolError *err);

/* ---- For light that is followed back to where it comes from ---- */

/* What comes from one direction: radiance, and how likely it is drawn, per solid angle. */
typedef struct VolFromAround {
    VolVec3 from; /* unit */
    double rgb[3];
    double density;
} VolFromAround;

/* Directions drawn by luminance, evenly within a pixel. */
typedef struct VolEnvironmentSampler {
    const VolEnvironment *environment; /* outlives this */
    double *rows;    /* luminance above each row, and in all */
    double *columns; /* of each row: left of each column, and in all */
} VolEnvironmentSampler;

VolStatus vol_environment_sampler_new(const VolEnvironment *environment, VolEnvironmentSampler *out, VolError *err);
void vol_environment_sampler_free(VolEnvironmentSampler *sampler);

/* For u and v even in (0, 1); of a black one nothing, of density 0. */
VolFromAround vol_environment_sample(const VolEnvironmentSampler *sampler, double u, double v);

VolFromAround vol_environment_from(const VolEnvironmentSampler *sampler, VolVec3 direction);

#endif
