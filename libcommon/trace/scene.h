/* What is to be seen, as it was asked for: nothing here changes while a picture is made. */
#ifndef VOL_TRACE_SCENE_H
#define VOL_TRACE_SCENE_H

#include <stdbool.h>
#include <stddef.h>

#include "base/cpu.h"
#include "base/vec.h"
#include "tf/preint.h"
#include "tf/tf.h"
#include "trace/ray.h"
#include "volume/volume.h"

typedef enum VolLightKind { VOL_LIGHT_HEAD, VOL_LIGHT_SUN, VOL_LIGHT_POINT, VOL_LIGHT_SPOT } VolLightKind;

typedef struct VolLight {
    VolLightKind kind;
    VolVec3 position;  /* points and spots */
    VolVec3 direction; /* unit, in which the light travels: suns and spots */
    double rgb[3];
    double cos_edge, cos_full; /* spots: dark beyond the first, full within the second */
} VolLight;

/* Whether it stands somewhere, and so changes along a ray. */
static inline bool vol_light_stands(const VolLight *light)
{
    return light->kind == VOL_LIGHT_POINT || light->kind == VOL_LIGHT_SPOT;
}

/* Keeps n.x >= d; n as the user gave it. */
typedef struct VolClip {
    VolVec3 normal;
    double d;
} VolClip;

typedef enum VolEstimator {
    VOL_ESTIMATE_EXACT,
    VOL_ESTIMATE_FULL,
    VOL_ESTIMATE_INTEGRALS,
    VOL_ESTIMATE_DIRECT
} VolEstimator;

struct VolLit;

typedef struct VolScene {
    VolVolume volume;
    double unit; /* of the field here, in units of the user's field; 0 is 1 */
    const VolTfCompiled *tf;
    const VolPreint *preint;         /* of `tf`, for FULL */
    const VolTfIntegrals *integrals; /* of `tf`, for INTEGRALS */
    const VolLight *lights;
    size_t light_count;
    const struct VolLit *lit; /* what reaches places of all of these and of indirect light (lit.h); NULL: all is lit */
    const VolClip *clips;
    size_t clip_count;
    VolEstimator estimator;
    double step;     /* world units, for estimators that march */
    bool precise;
    bool skip;       /* leave out what is invisible; off only to test that it changes nothing */
    unsigned layers; /* a set: layers.h */
    double background_max;      /* largest channel of what lies behind */
    double termination_opacity; /* rays end where what may still come is below this; 0: by the precision */
    VolCpu cpu;
} VolScene;

/* Cuts the ray's [t0, t1] to the domain and the clip planes; false: nothing left. */
bool vol_ray_clip(const VolScene *scene, VolRay *ray);

#endif
