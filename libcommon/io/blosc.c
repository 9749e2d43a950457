/* A chunk: 16 bytes of header, the places of its blocks, the blocks.  A block
 * is one stream or, mostly, one for each byte of a value; a stream is its
 * length and then LZ4's bytes, or bare ones where the length is that of what
 * they hold.  A shuffled block has the first bytes of all its values, then all
 * second bytes, and so on; bytes behind the last whole value stay. */
#include "io/blosc.h"

#include <limits.h>
#include <lz4.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "adapters/blosc.h"
#include "base/little.h"
#include "base/mem.h"
#include "base/plugin.h"

enum { HEADER_BYTES = 16, FORMAT_VERSION = 2, CODEC_LZ4 = 1, LZ4_VERSION = 1 };
enum { SHUFFLED = 1, BARE = 2, BITS_SHUFFLED = 4, RESERVED = 8, IN_ONE_STREAM = 16 }; /* flags; from bit 5 on: the codec */
enum { MOST_STREAMS = 16, LEAST_VALUES = 128 };                                       /* beyond: one stream */

typedef struct Chunk {
    const unsigned char *bytes;
    size_t size;
    unsigned flags;
    size_t type_size, total, block;
} Chunk;

/* ---- shuffled bytes ---- */

typedef unsigned char Bytes16 __attribute__((vector_size(16)));

static inline Bytes16 merge_low(Bytes16 a, Bytes16 b)
{
    return __builtin_shufflevector(a, b, 0, 16, 1, 17, 2, 18, 3, 19, 4, 20, 5, 21, 6, 22, 7, 23);
}

static inline Bytes16 merge_high(Bytes16 a, Bytes16 b)
{
    return __builtin_shufflevector(a, b, 8, 24, 9, 25, 10, 26, 11, 27, 12, 28, 13, 29, 14, 30, 15, 31);
}

/* Sixteen values at a time, of 2, 4 or 8 bytes; returns how many were done. */
static inline __attribute__((always_inline)) size_t unshuffle_16(const unsigned char *from, size_t type_size, size_t count,
                                                                 unsigned char *to)
{
    size_t i = 0;
    for (; i + 16 <= count; i += 16) {
        Bytes16 v[8], w[8]; /* in registers, where all is unrolled */
#pragma GCC unroll 8
        for (size_t j = 0; j < type_size; j++)
            memcpy(&v[j], from + j * count + i, 16);
#pragma GCC unroll 3
        for (size_t round = 1; round < type_size; round *= 2) {
#pragma GCC unroll 4
            for (size_t j = 0; j < type_size / 2; j++) {
                w[2 * j] = merge_low(v[j], v[j + type_size / 2]);
                w[2 * j + 1] = merge_high(v[j], v[j + type_size / 2]);
            }
            memcpy(v, w, type_size * sizeof *v);
        }
        memcpy(to + i * type_size, v, type_size * sizeof *v);
    }
    return i;
}

static void unshuffle(const unsigned char *from, size_t type_size, size_t size, unsigned char *to)
{
    size_t count = size / type_size, done = 0;
    switch (type_size) {
    case 2: done = unshuffle_16(from, 2, count, to); break;
    case 4: done = unshuffle_16(from, 4, count, to); break;
    case 8: done = unshuffle_16(from, 8, count, to); break;
    default: break;
    }
    for (size_t i = done; i < count; i++)
        for (size_t j = 0; j < type_size; j++)
            to[i * type_size + j] = from[j * count + i];
    memcpy(to + count * type_size, from + count * type_size, size - count * type_size);
}

/* ---- blocks ---- */

/* One stream at byte *at of the chunk, which must give exactly `size` bytes. */
static bool unpack_stream(const Chunk *chunk, size_t *at, unsigned char *to, size_t size)
{
    if (*at > chunk->size || chunk->size - *at < 4)
        return false;
    size_t length = vol_load_u32(chunk->bytes + *at);
    *at += 4;
    if (length > chunk->size - *at)
        return false;
    const unsigned char *from = chunk->bytes + *at;
    *at += length;
    if (length == size) {
        memcpy(to, from, size);
        return true;
    }
    return LZ4_decompress_safe((const char *)from, (char *)to, (int)length, (int)size) == (int)size;
}

/* Block `n`, of `size` bytes; `room` holds a whole block where bytes are
 * shuffled. */
static bool unpack_block(const Chunk *chunk, size_t n, size_t size, unsigned char *to, unsigned char *room)
{
    size_t at = vol_load_u32(chunk->bytes + HEADER_BYTES + 4 * n), type = chunk->type_size;
    bool split =
        !(chunk->flags & IN_ONE_STREAM) && type <= MOST_STREAMS && size / type >= LEAST_VALUES && size == chunk->block;
    size_t streams = split ? type : 1, each = size / streams;
    unsigned char *place = room ? room : to;
    if (at < HEADER_BYTES || each * streams != size)
        return false;
    for (size_t i = 0; i < streams; i++)
        if (!unpack_stream(chunk, &at, place + i * each, each))
            return false;
    if (room)
        unshuffle(room, type, size, to);
    return true;
}

static VolStatus damaged(VolError *err)
{
    return vol_fail(err, VOL_BAD_INPUT, "a compressed block is damaged");
}

static VolStatus unpack_lz4(const Chunk *chunk, unsigned char *to, VolError *err)
{
    if (!chunk->type_size || !chunk->block || chunk->block > chunk->total || chunk->size > INT_MAX || chunk->total > INT_MAX)
        return damaged(err);
    size_t blocks = (chunk->total + chunk->block - 1) / chunk->block;
    if (blocks > (chunk->size - HEADER_BYTES) / 4)
        return damaged(err);
    unsigned char *room = NULL;
    if (chunk->flags & SHUFFLED && chunk->type_size > 1 && !(room = vol_alloc(chunk->block, 1)))
        return vol_fail_memory(err, chunk->block);
    bool sound = true;
    for (size_t n = 0; n < blocks && sound; n++) {
        size_t from = n * chunk->block, left = chunk->total - from;
        sound = unpack_block(chunk, n, left < chunk->block ? left : chunk->block, to + from, room);
    }
    free(room);
    return sound ? VOL_OK : damaged(err);
}

static VolStatus unpack_other(const Chunk *chunk, void *to, VolError *err)
{
    const void *table;
    VolStatus status = vol_plugin("blosc", &table, err);
    if (status)
        return status;
    const VolBloscAdapter *blosc = table;
    switch (blosc->decompress(chunk->bytes, chunk->size, to, chunk->total)) {
    case VOL_BLOSC_DONE: return VOL_OK;
    case VOL_BLOSC_NO_MEMORY: return vol_fail(err, VOL_NOMEM, "out of memory for Blosc");
    case VOL_BLOSC_DAMAGED: break;
    }
    return damaged(err);
}

VolStatus vol_blosc_unpack(const unsigned char *chunk, size_t size, void *to, size_t to_size, VolError *err)
{
    if (size < HEADER_BYTES || vol_load_u32(chunk + 4) != to_size || vol_load_u32(chunk + 12) != size)
        return damaged(err);
    Chunk c = {.bytes = chunk,
               .size = size,
               .flags = chunk[2],
               .type_size = chunk[3],
               .total = to_size,
               .block = vol_load_u32(chunk + 8)};
    if (c.flags & RESERVED)
        return damaged(err);
    if (to_size == 0)
        return VOL_OK;
    if (c.flags & BARE) {
        if (size - HEADER_BYTES != to_size)
            return damaged(err);
        memcpy(to, chunk + HEADER_BYTES, to_size);
        return VOL_OK;
    }
    if (chunk[0] == FORMAT_VERSION && chunk[1] == LZ4_VERSION && c.flags >> 5 == CODEC_LZ4 && !(c.flags & BITS_SHUFFLED))
        return unpack_lz4(&c, to, err);
    return unpack_other(&c, to, err);
}
