/* Phase functions: how much of the light that travels one way is scattered another way.
 *
 * Relative: light from all around with an even phase function of 1 is scattered evenly.  Henyey-Greenstein's has the mean 1
 * over the sphere; a table, as K has them, is used as it is. */
#ifndef VOL_TF_PHASE_H
#define VOL_TF_PHASE_H

#include "tf/tf.h"

typedef struct VolPhase {
    double g;                /* Henyey-Greenstein's; 0: even, the same in all directions */
    const VolTfNodes *table; /* in place of it: linear in the cosine between nodes, constant beyond; NULL: none */
} VolPhase;

/* That of a transfer function, which outlives it. */
VolPhase vol_phase_of(const VolTf *tf);

/* Of the cosine between the ways that light travels before and after: 1 is straight on. */
void vol_phase_at(const VolPhase *phase, double cosine, double rgb[3]);

/* The largest that any channel is anywhere. */
double vol_phase_most(const VolPhase *phase);

/* Its means over the sphere: half the integral over the cosine.  1 for Henyey-Greenstein's. */
void vol_phase_means(const VolPhase *phase, double mean[3]);

/* Whether it is 1 everywhere. */
static inline bool vol_phase_is_even(const VolPhase *phase) { return phase->g == 0 && !phase->table; }

/* ---- For light that is scattered again and again: each channel over its mean, so that none is made or lost ---- */

/* Between two cosines the density is linear. */
typedef struct VolPhasePiece {
    double cosine[2], density[2];
    double before; /* the probability of lesser cosines */
} VolPhasePiece;

/* Directions are drawn by the channels' mean, each over its own: no channel weighs more than 3. */
typedef struct VolPhaseSampler {
    VolPhase phase;
    double mean[3];
    VolPhasePiece *pieces; /* of tables that are not 0 everywhere; else NULL */
    size_t count;
} VolPhaseSampler;

VolStatus vol_phase_sampler_new(const VolPhase *phase, VolPhaseSampler *out, VolError *err);
void vol_phase_sampler_free(VolPhaseSampler *sampler);

/* Each channel over its mean; 0 where that is 0. */
void vol_phase_normalised(const VolPhaseSampler *sampler, double cosine, double rgb[3]);

/* The cosine for `u`, even in (0, 1). */
double vol_phase_sample(const VolPhaseSampler *sampler, double u);

/* How likely it is, relative to even directions: of mean 1 over the sphere. */
double vol_phase_density(const VolPhaseSampler *sampler, double cosine);

#endif
