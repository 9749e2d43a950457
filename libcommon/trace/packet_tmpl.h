/* A ray packet: LANES rays side by side.  What a lane computes depends on its own ray alone, so that a picture does not
 * depend on which rays travel together.
 *
 * PARAMETERS  VOL_DOUBLE: in double, else in float
 * PROVIDES    RayPacket, packet_begin(), give_up(), CLEAR_FROM() */
#ifndef VOL_TRACE_PACKET_TMPL_H
#define VOL_TRACE_PACKET_TMPL_H

#include <math.h>
#include <stddef.h>
#include <string.h>

#include "simd/reals.h"
#include "trace/tf_tables_tmpl.h"
#include "trace/trace.h"

/* Zero from a member on: what stands before it is large, and begins by itself. */
#define CLEAR_FROM(p, member)                                                                                              \
    memset((char *)(p) + offsetof(__typeof__(*(p)), member), 0, sizeof *(p) - offsetof(__typeof__(*(p)), member))

typedef struct RayPacket {
    const VolScene *scene;
    const VolPrepared *prepared;
    const TfTables *tables;
    VolScratch *scratch;
    const VolTraceListener *listener;
    const VolRay *rays;
    size_t count;
    VolRadiance *out;
    struct LitRays *lit; /* light grids under the rays (lit_tmpl.h); NULL: the scene has none */
    bool extra; /* layers beside RGBA are wanted, or there is a listener: general kernels know only when they run */
    reals view[3]; /* world, towards the eye */
    reals termination_depth;
    ints alive;
} RayPacket;

/* The call's rays from `first` on, as many as there are lanes. */
static inline void packet_begin(RayPacket *l, const VolTraceCall *call, size_t first)
{
    size_t left = call->count - first;
    *l = (RayPacket){.scene = call->prepared->scene,
                     .prepared = call->prepared,
                     .tables = PREPARED_TABLES(call->prepared),
                     .scratch = call->scratch,
                     .listener = call->listener,
                     .rays = call->rays + first,
                     .count = left < LANES ? left : LANES,
                     .out = call->out + first,
                     .extra = call->prepared->scene->layers || call->listener};
    for (size_t i = 0; i < LANES; i++) {
        const VolRay *ray = &l->rays[i < l->count ? i : 0];
        if (i < l->count)
            l->out[i] = (VolRadiance){.depth = INFINITY};
        l->termination_depth[i] = (real)vol_termination_depth(l->prepared, ray->t1 - ray->t0);
        l->view[0][i] = (real)-ray->direction.x;
        l->view[1][i] = (real)-ray->direction.y;
        l->view[2][i] = (real)-ray->direction.z;
        l->alive[i] = i < l->count ? -1 : 0;
    }
}

/* Float is not enough for the rays of `lanes`. */
static inline void give_up(RayPacket *l, ints lanes)
{
    l->alive &= ~lanes;
    FOR_LANES(i, mask_bits(lanes))
        l->out[i].given_up = true;
}

#endif
