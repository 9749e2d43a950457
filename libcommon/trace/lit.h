/* Light that was solved for beforehand: grids beside the volume, of how much of each light reaches a place.
 *
 * What scatters is lit by the sum of its lights, each RGB x fall-off x transmittance x phase, and of indirect light; or by
 * the total alone.  Between voxels all of them are trilinear. */
#ifndef VOL_TRACE_LIT_H
#define VOL_TRACE_LIT_H

#include "base/status.h"
#include "tf/phase.h"
#include "trace/scene.h"
#include "volume/grid.h"

typedef struct VolLit {
    const VolGrid **grids; /* of one number or RGB each, all finite: transmittance of the scene's lights in their order, */
    size_t grid_count;     /* then indirect light; or one alone, the total */
    size_t *lattice;       /* of each: the first grid that has its voxels in the same places */
    bool total;
    bool apart;            /* some lattice is not the volume's: light bends within cells */
    VolPhase phase;        /* of what scatters */
} VolLit;

/* How many of the grids are transmittances. */
static inline size_t vol_lit_direct_count(const VolScene *scene)
{
    return scene->lit->total ? 0 : scene->light_count;
}

/* Lists of that length, all NULL; vol_lit_free() gives them back, not the grids. */
VolStatus vol_lit_begin(size_t grid_count, VolLit *out, VolError *err);

/* `lattice` and `apart` from `grids` and the volume. */
void vol_lit_settle(VolLit *lit, const VolVolume *volume);
void vol_lit_free(VolLit *lit);

/* The most that a place can receive, in any channel, where the scene's lights together send `sent` at most; phases count
 * where `scattered`. */
double vol_lit_bound(const VolScene *scene, double sent, bool scattered);

#endif
