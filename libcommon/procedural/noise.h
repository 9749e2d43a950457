/* Seeded gradient noise from an integer hash: no table, no period, the same bits everywhere. */
#ifndef VOL_PROCEDURAL_NOISE_H
#define VOL_PROCEDURAL_NOISE_H

#include <stdint.h>

#include "base/vec.h"

/* Band-limited around one period per unit length; 0 at the points of the integer lattice; within [-1, 1]; C2.
 * Places beyond +-2^52, where a double has no fraction, give 0. */
double vol_noise(uint64_t seed, VolVec3 x);

/* Sum of `octaves` (1..32) noises, each `lacunarity` times finer and `gain` times weaker than the last, divided by
 * the sum of the weights, so that it stays within [-1, 1]. */
double vol_fbm(uint64_t seed, VolVec3 x, int octaves, double lacunarity, double gain);

#endif
