/* Two 64-bit lanes take 16 bytes at a time.  Every step is a bijection of the state for a given block and of the block
 * for a given state, so no information is lost before the end; the end mixes the length in and spreads every bit over both
 * words.  Bytes are taken in little-endian order whatever the machine. */
#include "base/hash.h"

#include <string.h>

#define K0 UINT64_C(0x9e3779b97f4a7c15) /* 2^64 / golden ratio, odd */
#define K1 UINT64_C(0xd6e8feb86659fd93)
#define K2 UINT64_C(0xa0761d6478bd642f)
#define K3 UINT64_C(0xe7037ed1a0b428db)

static uint64_t rotate(uint64_t v, int by) { return v << by | v >> (64 - by); }

/* Written out, compilers make one load of it. */
static uint64_t load64(const unsigned char *p)
{
    return (uint64_t)p[0] | (uint64_t)p[1] << 8 | (uint64_t)p[2] << 16 | (uint64_t)p[3] << 24 | (uint64_t)p[4] << 32 |
           (uint64_t)p[5] << 40 | (uint64_t)p[6] << 48 | (uint64_t)p[7] << 56;
}

static uint64_t spread(uint64_t v)
{
    v = (v ^ v >> 32) * K1;
    v = (v ^ v >> 29) * K2;
    return v ^ v >> 32;
}

static void add_block(VolHash *hash, const unsigned char *block)
{
    uint64_t a = load64(block) * K1, b = load64(block + 8) * K2;
    uint64_t s0 = hash->state[0] ^ (a ^ a >> 32) * K3;
    uint64_t s1 = hash->state[1] ^ (b ^ b >> 32) * K0;
    s0 = rotate(s0, 27) * K0 + s1;
    s1 = rotate(s1, 33) * K3 + s0;
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
        add_block(hash, hash->pending);
        hash->pending_size = 0;
    }
    for (; size >= 16; bytes += 16, size -= 16)
        add_block(hash, bytes);
    if (size)
        memcpy(hash->pending, bytes, size);
    hash->pending_size = size;
}

void vol_hash_end(VolHash *hash, uint64_t out[2])
{
    if (hash->pending_size) {
        memset(hash->pending + hash->pending_size, 0, sizeof hash->pending - hash->pending_size);
        add_block(hash, hash->pending);
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
