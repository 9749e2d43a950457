#include "base/random.h"

void vol_random_block(const uint32_t counter[4], const uint32_t key[2], uint32_t out[4])
{
    uint32_t c0 = counter[0], c1 = counter[1], c2 = counter[2], c3 = counter[3], k0 = key[0], k1 = key[1];
    for (int round = 0; round < 10; round++) {
        uint64_t p = (uint64_t)0xD2511F53u * c0, q = (uint64_t)0xCD9E8D57u * c2;
        c0 = (uint32_t)(q >> 32) ^ c1 ^ k0;
        c2 = (uint32_t)(p >> 32) ^ c3 ^ k1;
        c1 = (uint32_t)q;
        c3 = (uint32_t)p;
        k0 += 0x9E3779B9u; /* the golden ratio */
        k1 += 0xBB67AE85u; /* the square root of 3, less 1 */
    }
    out[0] = c0;
    out[1] = c1;
    out[2] = c2;
    out[3] = c3;
}

static void next_block(VolRandom *random)
{
    vol_random_block(random->counter, random->key, random->block);
    random->counter[3]++;
    random->used = 0;
}

VolRandom vol_random(uint64_t seed, uint64_t place, uint32_t sample, uint64_t dimension)
{
    VolRandom random = {.key = {(uint32_t)seed, (uint32_t)(seed >> 32)},
                        .counter = {(uint32_t)place, (uint32_t)(place >> 32), sample, (uint32_t)(dimension / 4)}};
    next_block(&random);
    random.used = (unsigned)(dimension % 4);
    return random;
}

double vol_random_next(VolRandom *random)
{
    if (random->used == 4)
        next_block(random);
    return (random->block[random->used++] + 0.5) * 0x1p-32;
}

double vol_random_at(uint64_t seed, uint64_t place, uint32_t sample, uint64_t dimension)
{
    VolRandom random = vol_random(seed, place, sample, dimension);
    return vol_random_next(&random);
}
