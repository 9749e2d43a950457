/* Random numbers that depend on (seed, place, sample, dimension) alone: whoever asks, in whatever order, gets the same.
 *
 * A place is a pixel or a voxel; a dimension is the number of the decision within one sample.  Blocks of four words come
 * of Philox 4x32-10 (Salmon et al. 2011), a bijection of a 128-bit counter for each 64-bit key: no two share a block. */
#ifndef VOL_BASE_RANDOM_H
#define VOL_BASE_RANDOM_H

#include <stdint.h>

void vol_random_block(const uint32_t counter[4], const uint32_t key[2], uint32_t out[4]);

/* The numbers of one sample, one after another: copies go on independently and alike. */
typedef struct VolRandom {
    uint32_t key[2], counter[4]; /* the seed; place (two words), sample, number of the next block */
    uint32_t block[4];
    unsigned used; /* of `block` */
} VolRandom;

/* Whose first number has this dimension. */
VolRandom vol_random(uint64_t seed, uint64_t place, uint32_t sample, uint64_t dimension);

/* In (0, 1), a multiple of 2^-33, of even distribution: 0 and 1 never come.  At most 2^34 in a sample. */
double vol_random_next(VolRandom *random);

/* A single one of them. */
double vol_random_at(uint64_t seed, uint64_t place, uint32_t sample, uint64_t dimension);

#endif
