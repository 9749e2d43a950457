/* What is made of a scene once, before any ray. */
#ifndef VOL_TRACE_PREPARED_H
#define VOL_TRACE_PREPARED_H

#include "base/status.h"
#include "trace/empty_space.h"
#include "trace/scene.h"

/* The same tables in float and in double: see tf_tables_tmpl.h. */
typedef struct VolTfTablesF32 VolTfTablesF32;
typedef struct VolTfTablesF64 VolTfTablesF64;

typedef struct VolPrepared {
    const VolScene *scene; /* outlives this, unchanged */
    VolTfTablesF32 *tables32;
    VolTfTablesF64 *tables64;
    VolEmptySpace space;
    uint8_t *ill_conditioned;   /* one per part of the volume: float is not enough there (conditioning.c); NULL: nowhere */
    bool gives_up;              /* rays in float may turn out to need double */
    bool shaded;                /* hybrid or classic with something to shade */
    bool lit_from_places;       /* some light stands somewhere, and what arrives of it changes on the way */
    double termination_opacity; /* the scene's, or by the precision */
    double termination_depth;   /* the optical depth for that, where nothing is emitted */
    double nearest_light;       /* lights that stand somewhere shine no brighter than from this distance */
    double color_bound;         /* largest radiance any surface or particle can send */
} VolPrepared;

/* Whatever comes of it, vol_prepared_free() is to follow. */
VolStatus vol_scene_prepare(const VolScene *scene, VolPrepared *out, VolError *err);
void vol_prepared_free(VolPrepared *prepared);

/* The features that the scene is without, hence the kernel too: "surfaces, emission, ..." into `out`. */
void vol_features_skipped(const VolPrepared *prepared, char *out, size_t size);

/* Optical depth beyond which a ray of that length can be given up: what is still to come, seen through it, is below
 * termination_opacity.  With T the transmittance reached and L the length, dropping the rest changes a pixel by at most
 * T (max(1, largest radiance, background) + largest emission x L). */
double vol_termination_depth(const VolPrepared *prepared, double length);

/* Whether a clipped ray meets the box around the visible bricks. */
bool vol_ray_meets_visible(const VolPrepared *prepared, const VolRay *ray);

#endif
