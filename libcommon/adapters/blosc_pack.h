/* C++: what OpenVDB gets for blosc_compress_ctx().  Blosc works on through a null pointer where it gets no memory; here that
 * is std::bad_alloc, which OpenVDB lets through.  LZ4 behind a shuffle of bytes, as OpenVDB wants it, in the very bytes of
 * Blosc 1.21; anything else goes on to Blosc. */
#ifndef VOL_ADAPTERS_BLOSC_PACK_H
#define VOL_ADAPTERS_BLOSC_PACK_H

#include <dlfcn.h>
#include <lz4.h>

#include <algorithm>
#include <climits>
#include <cstdint>
#include <cstring>
#include <vector>

namespace blosc_pack {

constexpr size_t HEADER = 16, SHORTEST = 128, MOST_STREAMS = 16, LARGEST_STREAM = 1 << 18, SMALLEST_BLOCK = 1 << 16,
                 LARGEST_BLOCK = 1 << 20;
constexpr unsigned FORMAT = 2, LZ4_FORMAT = 1, SHUFFLED = 1, BARE = 2, IN_ONE_STREAM = 16, LZ4_CODEC = 1 << 5;

inline void put32(unsigned char *to, size_t value)
{
    for (int i = 0; i < 4; i++)
        to[i] = static_cast<unsigned char>(value >> 8 * i);
}

inline bool splits(size_t type, size_t block) { return type <= MOST_STREAMS && block / type >= SHORTEST; }

inline size_t block_size(size_t type, size_t size, size_t wanted)
{
    size_t block = std::max(wanted, SHORTEST);
    if (splits(type, block))
        block = std::clamp(std::min(block, LARGEST_STREAM) * type, SMALLEST_BLOCK, LARGEST_BLOCK);
    block = std::min(block, size);
    return block > type ? block / type * type : block;
}

inline void shuffle(const unsigned char *from, size_t type, size_t size, unsigned char *to)
{
    const size_t count = size / type;
    for (size_t j = 0; j < type; j++)
        for (size_t i = 0; i < count; i++)
            to[j * count + i] = from[i * type + j];
    std::memcpy(to + count * type, from + count * type, size - count * type);
}

/* One block at byte `at`; where the next one goes, or 0: it does not fit. */
inline size_t pack_block(const unsigned char *from, size_t size, size_t streams, int acceleration, unsigned char *to,
                         size_t at, size_t room)
{
    const size_t each = size / streams;
    for (size_t i = 0; i < streams; i++, from += each) {
        at += 4;
        if (at >= room)
            return 0;
        const size_t most = std::min(each, room - at);
        size_t length = static_cast<size_t>(LZ4_compress_fast(reinterpret_cast<const char *>(from),
                                                              reinterpret_cast<char *>(to + at), static_cast<int>(each),
                                                              static_cast<int>(most), acceleration));
        if (length == 0 || length == each) {
            if (at + each > room)
                return 0;
            std::memcpy(to + at, from, each);
            length = each;
        }
        put32(to + at - 4, length);
        at += length;
    }
    return at;
}

inline size_t pack_blocks(const unsigned char *from, size_t type, size_t size, size_t block, int acceleration,
                          unsigned char *to, size_t room)
{
    const size_t blocks = (size + block - 1) / block;
    size_t at = HEADER + 4 * blocks;
    std::vector<unsigned char> shuffled(block);
    for (size_t n = 0; n < blocks && at; n++) {
        const size_t length = std::min(block, size - n * block);
        const unsigned char *plain = from + n * block;
        if (at > room)
            return 0;
        put32(to + HEADER + 4 * n, at);
        if (type > 1) {
            shuffle(plain, type, length, shuffled.data());
            plain = shuffled.data();
        }
        at = pack_block(plain, length, splits(type, block) && length == block ? type : 1, acceleration, to, at, room);
    }
    return at;
}

inline int pack(int level, size_t type, size_t size, const void *from, void *to, size_t room, size_t wanted)
{
    auto *out = static_cast<unsigned char *>(to);
    const size_t block = block_size(type, size, wanted);
    unsigned flags = SHUFFLED | LZ4_CODEC | (splits(type, block) ? 0 : IN_ONE_STREAM);
    size_t length = 0;
    if (size >= SHORTEST)
        length = pack_blocks(static_cast<const unsigned char *>(from), type, size, block, 10 - level, out, room);
    if (length == 0) {
        if (size + HEADER > room)
            return 0;
        flags |= BARE;
        length = size + HEADER;
        std::memcpy(out + HEADER, from, size);
    }
    const unsigned char head[4] = {FORMAT, LZ4_FORMAT, static_cast<unsigned char>(flags), static_cast<unsigned char>(type)};
    std::memcpy(out, head, sizeof head);
    put32(out + 4, size);
    put32(out + 8, block);
    put32(out + 12, length);
    return static_cast<int>(length);
}

} // namespace blosc_pack

/* Blosc's state, which functions of the kind ..._ctx do without.  Where it gets no memory for it, it says so on stdout. */
extern "C" __attribute__((visibility("default"))) void blosc_init() {}

extern "C" __attribute__((visibility("default"))) int blosc_set_compressor(const char *codec)
{
    return std::strcmp(codec, "lz4") == 0 ? static_cast<int>(blosc_pack::LZ4_FORMAT) : -1;
}

/* Before Blosc's own in the order in which names are looked up for OpenVDB. */
extern "C" __attribute__((visibility("default"))) int blosc_compress_ctx(int level, int shuffle, size_t type, size_t size,
                                                                         const void *from, void *to, size_t room,
                                                                         const char *codec, size_t block, int threads)
{
    using Compress = int(int, int, size_t, size_t, const void *, void *, size_t, const char *, size_t, int);
    if (shuffle == 1 && level > 0 && level < 10 && type > 0 && type < 256 && size >= type && block > 0 &&
        size < INT_MAX - blosc_pack::HEADER && block < INT_MAX / 2 && std::strcmp(codec, "lz4") == 0)
        return blosc_pack::pack(level, type, size, from, to, std::min<size_t>(room, INT_MAX), block);
    auto *blosc = reinterpret_cast<Compress *>(dlsym(RTLD_NEXT, "blosc_compress_ctx"));
    return blosc ? blosc(level, shuffle, type, size, from, to, room, codec, block, threads) : -1;
}

#endif
