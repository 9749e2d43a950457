/* Two 64-bit lanes take 16 bytes at a time.  Every step is a bijection of the state for a given block and of the block
 * for a given state, so no information is lost before the end; the end mixes the length in and spreads every bit over both
 * words.  Bytes are taken in little-endian order whatever the machine. */
#include "base/hash.h"

#include <string.h>

#include "base/little.h"

#define K0 UINT64_C(0x9e3779b97f4a7c15) /* 2^64 / golden ratio, odd */
#define K1 UINT64_C(0xd6e8feb86659fd93)
#define K2 UINT64_C(0xa0761d6478bd642f)
#define K3 UINT64_C(0xe7037ed1a0b428db)

static uint64_t rotate(uint64_t v, int by) { return v << by | v >> (64 - by); }

static uint64_t spread(uint64_t v)
{
    v = (v ^ v >> 32) * K1;
    v = (v ^ v >> 29) * K2;
    return v ^ v >> 32;
}

/* Every block waits for the one before: the state stays in registers. */
static void add_blocks(VolHash *hash, const unsigned char *blocks, size_t count)
{
    uint64_t s0 = hash->state[0], s1 = hash->state[1];
    for (; count; count--, blocks += 16) {
        uint64_t a = vol_load_u64(blocks) * K1, b = vol_load_u64(blocks + 8) * K2;
        s0 ^= (a ^ a >> 32) * K3;
        s1 ^= (b ^ b >> 32) * K0;
        s0 = rotate(s0, 27) * K0 + s1;
        s1 = rotate(s1, 33) * K3 + s0;
    }
    hash->state[0] = s0;
    hash->state[1] = s1;
}

void vol_hash_begin(VolHash *hash)
{
    *hash = (VolHash){.state = {K0, K3}};
}

void vol_hash_add(VolHash *hash, const void *data, size_t size)
{
    const unsigned char *bytes = data;
    hash->total += size;
    if (hash->pending_size) {
        size_t room = sizeof hash->pending - hash->pending_size;
        size_t taken = size < room ? size : room;
        if (taken)
            memcpy(hash->pending + hash->pending_size, bytes, taken);
        hash->pending_size += taken;
        bytes += taken;
        size -= taken;
        if (hash->pending_size < sizeof hash->pending)
            return;
        add_blocks(hash, hash->pending, 1);
        hash->pending_size = 0;
    }
    size_t rest = size % sizeof hash->pending;
    add_blocks(hash, bytes, size / sizeof hash->pending);
    if (rest)
        memcpy(hash->pending, bytes + (size - rest), rest);
    hash->pending_size = rest;
}

void vol_hash_end(VolHash *hash, uint64_t out[2])
{
    if (hash->pending_size) {
        memset(hash->pending + hash->pending_size, 0, sizeof hash->pending - hash->pending_size);
        add_blocks(hash, hash->pending, 1);
    }
    uint64_t s0 = spread(hash->state[0] ^ hash->total), s1 = spread(hash->state[1] + s0);
    s0 = spread(s0 + rotate(s1, 32));
    out[0] = s0;
    out[1] = spread(s1 ^ s0 * K0);
}

void vol_hash_hex(const uint64_t digest[2], char out[33])
{
    for (int i = 0; i < 32; i++)
        out[i] = "0123456789abcdef"[digest[i / 16] >> (60 - 4 * (i % 16)) & 15];
    out[32] = 0;
}

void vol_hash_bytes(const void *data, size_t size, uint64_t out[2])
{
    VolHash hash;
    vol_hash_begin(&hash);
    vol_hash_add(&hash, data, size);
    vol_hash_end(&hash, out);
}
