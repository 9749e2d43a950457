/* Content hash: 128 bits, streaming, the same on every machine.  Not cryptographic. */
#ifndef VOL_BASE_HASH_H
#define VOL_BASE_HASH_H

#include <stddef.h>
#include <stdint.h>

typedef struct VolHash {
    uint64_t state[2];
    unsigned char pending[16];
    size_t pending_size;
    uint64_t total;
} VolHash;

void vol_hash_begin(VolHash *hash);
void vol_hash_add(VolHash *hash, const void *data, size_t size);
void vol_hash_end(VolHash *hash, uint64_t out[2]);
void vol_hash_bytes(const void *data, size_t size, uint64_t out[2]); /* all three at once */
void vol_hash_hex(const uint64_t digest[2], char out[33]);

#endif
