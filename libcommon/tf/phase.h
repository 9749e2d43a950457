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

/* Whether it is 1 everywhere. */
static inline bool vol_phase_is_even(const VolPhase *phase) { return phase->g == 0 && !phase->table; }

#endif
