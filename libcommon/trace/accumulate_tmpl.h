/* What rays have gathered, and what follows from it: light as it comes through what is in front, early ray termination,
 * the depth layer, isosurfaces, what a listener is told.
 *
 * Optical depth and light are summed in double, and transmittance is taken anew from the sum: no product of many factors
 * near 1 is ever formed.
 *
 * PARAMETERS  VOL_DOUBLE
 * PROVIDES    Accumulator, Light, add_layers(), optical_depths_of(), terminate_rays(), where_doubt_shows(), wants_depth(),
 *             share_up_to_half(), tell(), cross_isosurface(), store_sums(); FeaturesKernel, kernel_for() */
#ifndef VOL_TRACE_ACCUMULATE_TMPL_H
#define VOL_TRACE_ACCUMULATE_TMPL_H

#include "base/fmath.h"
#include "trace/packet_tmpl.h"
#include "trace/source_tmpl.h"

typedef struct Accumulator {
    Doubles optical_depth[3], color[3];
    Doubles sum[VOL_SUMS][3]; /* layers */
    reals reached[3];         /* optical_depth, rounded, where it was asked for */
    ints cells;
} Accumulator;

/* What some part of each ray sends. */
typedef struct Light {
    reals scatter[3], emit[3], surface[3];
    reals normal[3]; /* weighted as surfaces are */
} Light;

/* ---- Sums ---- */

/* Adds the sums to the rays' results. */
static inline void store_sums(const Accumulator *sum, const RayPacket *l)
{
    for (size_t i = 0; i < l->count; i++) {
        VolRadiance *out = &l->out[i];
        out->cells = (double)sum->cells[i];
        for (int c = 0; c < 3; c++) {
            out->color[c] += doubles_lane(&sum->color[c], (int)i);
            for (int n = 0; n < VOL_SUMS; n++)
                out->sum[n][c] += doubles_lane(&sum->sum[n][c], (int)i);
            out->optical_depth[c] = c < l->tables->channels ? doubles_lane(&sum->optical_depth[c], (int)i) : 0;
        }
    }
}

static inline void optical_depths_of(const Accumulator *sum, unsigned i, unsigned features, double optical_depth[3])
{
    for (int c = 0; c < channels_of(features); c++)
        optical_depth[c] = doubles_lane(&sum->optical_depth[c], (int)i);
}

/* Adds to the layers what is seen of each part: `seen`, which comes through what is in front, 0 in lanes without a part. */
ALWAYS_INLINE void add_layers(Accumulator *sum, const RayPacket *l, const Light *seen, unsigned features)
{
    if (!(features & FEATURE_EXTRA) || !l->extra)
        return;
    for (int c = 0; c < 3; c++) {
        doubles_add(&sum->sum[VOL_SUM_SCATTER][c], seen->scatter[c]);
        doubles_add(&sum->sum[VOL_SUM_EMIT][c], seen->emit[c]);
        doubles_add(&sum->sum[VOL_SUM_SURFACE][c], seen->surface[c]);
        if (features & FEATURE_SHADED)
            doubles_add(&sum->sum[VOL_SUM_NORMAL][c], seen->normal[c]);
    }
}

/* ---- Early ray termination ---- */

/* Ends those rays of `mask` behind whose optical depth nothing could be seen. */
ALWAYS_INLINE ints terminate_rays(Accumulator *sum, RayPacket *l, ints mask, unsigned features)
{
    reals least = reals_all(INFINITY);
    for (int c = 0; c < channels_of(features); c++) {
        sum->reached[c] = doubles_round(&sum->optical_depth[c]);
        least = reals_min(sum->reached[c], least);
    }
    ints opaque = mask & (ints)(least > l->termination_depth);
    if (any(opaque)) {
        l->scratch->skipped.rays_ended += (unsigned)__builtin_popcount(mask_bits(opaque));
        l->alive &= ~opaque;
    }
    return opaque;
}

/* ---- What float cannot tell ---- */

/* Those of `mask` on which a doubt shows, in what is `shown` of it behind what is in front. */
MAYBE_UNUSED static ints where_doubt_shows(const Accumulator *sum, reals doubt, reals shown, ints mask, unsigned features)
{
    reals reached = doubles_round(&sum->optical_depth[0]);
    for (int c = 1; c < channels_of(features); c++)
        reached = reals_min(reached, doubles_round(&sum->optical_depth[c]));
    return mask & (ints)(doubt * shown * reals_exp(-reached) > (real)BLUR_LIMIT);
}

/* ---- The depth layer, and listeners ---- */

static inline double mean_transmittance(const double optical_depth[3], int channels)
{
    double sum = 0;
    for (int c = 0; c < channels; c++)
        sum += vol_exp(-optical_depth[c]);
    return sum / channels;
}

static inline bool wants_depth(const RayPacket *l, unsigned i)
{
    return vol_has_layer(l->scene->layers, VOL_LAYER_Z) && isinf(l->out[i].depth);
}

/* The optical depth in front of a ray's part and of the part itself up to u in [0, 1], per channel. */
typedef void OpticalDepthUpTo(const void *part, unsigned i, double u, double optical_depth[3]);

/* The depth layer: u where the mean transmittance falls to one half; 2: not within the part. */
static inline double share_up_to_half(OpticalDepthUpTo *up_to, const void *part, unsigned i, int channels)
{
    double lo = 0, hi = 1, optical_depth[3];
    for (int n = -1; n < 48; n++) {
        double u = n < 0 ? 1 : 0.5 * (lo + hi);
        up_to(part, i, u, optical_depth);
        if (mean_transmittance(optical_depth, channels) <= 0.5)
            hi = u;
        else if (n < 0)
            return 2;
        else
            lo = u;
    }
    return hi;
}

static inline void tell(const RayPacket *l, const VolTraceStep *step)
{
    if (l->listener)
        l->listener->step(l->listener->user, step);
}

/* ---- Isosurfaces ---- */

/* Lane i crosses an isosurface at t, shaded by `sh` (NULL: not). */
static inline void cross_isosurface(Accumulator *sum, RayPacket *l, unsigned i, const Isosurface *isosurface, double t,
                                    const Shading *sh, unsigned features)
{
    VolRadiance *out = &l->out[i];
    int channels = channels_of(features);
    double optical_depth[3] = {0};
    optical_depths_of(sum, i, features, optical_depth);
    for (int c = 0; c < 3; c++) {
        double color = (double)isosurface_color(isosurface, sh, i, c);
        double part = vol_exp(-optical_depth[c < channels ? c : 0]) * isosurface->opacity * color;
        out->sum[VOL_SUM_SURFACE][c] += part;
        doubles_set(&sum->color[c], (int)i, doubles_lane(&sum->color[c], (int)i) + part);
        if (sh)
            out->sum[VOL_SUM_NORMAL][c] += vol_exp(-optical_depth[0]) * isosurface->opacity * (double)sh->normal[c][i];
    }
    for (int c = 0; c < channels; c++) {
        optical_depth[c] += isosurface->optical_depth;
        doubles_set(&sum->optical_depth[c], (int)i, optical_depth[c]);
    }
    if (isinf(out->depth) && mean_transmittance(optical_depth, channels) <= 0.5)
        out->depth = t;
    double value = (double)isosurface->value;
    tell(l, &(VolTraceStep){t, t, value, value, isosurface->optical_depth, (size_t)(isosurface - l->tables->isosurfaces),
                            "isosurface"});
}

/* ---- Kernels ---- */

/* One per set of features: those that a scene is without cost nothing. */
typedef struct FeaturesKernel {
    unsigned features;
    void (*trace)(void *estimator);
} FeaturesKernel;

/* The first kernel that has all of the scene's features.  Its kind of shading must be the scene's own, not just include it;
 * the last rows are general kernels, one for each kind of shading, so that one always fits. */
static inline const FeaturesKernel *kernel_for(const VolTraceCall *call, const FeaturesKernel *kernels, size_t count)
{
    const unsigned same = FEATURE_SHADED | FEATURE_CLASSIC;
    unsigned features = PREPARED_TABLES(call->prepared)->features;
    if (call->prepared->scene->layers || call->listener)
        features |= FEATURE_EXTRA;
    if (call->prepared->scene->lit)
        features |= FEATURE_LIT;
    size_t n = 0;
    while (n + 1 < count && (features & ~kernels[n].features || (features ^ kernels[n].features) & same))
        n++;
    return &kernels[n];
}

#endif
