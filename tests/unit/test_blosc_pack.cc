/* Blosc's chunks as we pack them for OpenVDB: the bytes of Blosc itself. */
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <dlfcn.h>

#include "adapters/blosc_pack.h"

extern "C" {
#include "tests/unit/test.h"
}

using Compress = int(int, int, size_t, size_t, const void *, void *, size_t, const char *, size_t, int);

static Compress *blosc;

static uint32_t state = 1;

static uint32_t next()
{
    state ^= state << 13;
    state ^= state >> 17;
    return state ^= state << 5;
}

static void test_same_bytes()
{
    static const size_t types[] = {1, 2, 4, 6, 8, 12, 16, 24};
    static unsigned char plain[300000], a[400000], b[400000];
    for (int n = 0; n < 4000; n++) {
        const size_t type = types[next() % 8], values = 1 + next() % (n % 50 ? 1500 : 12000), size = type * values;
        const uint32_t smooth = next() % 4;
        const size_t block = next() % 4 ? size : 1 + next() % (2 * size), room = size + (next() % 3 ? 16 : next() % 16);
        for (size_t i = 0; i < size; i++)
            plain[i] = static_cast<unsigned char>(smooth == 0   ? next()
                                                  : smooth == 1 ? i / type >> (i % type)
                                                                : next() % smooth);
        const int level = 1 + static_cast<int>(next() % 9);
        const int got = blosc_compress_ctx(level, 1, type, size, plain, a, room, "lz4", block, 1);
        const int want = blosc(level, 1, type, size, plain, b, room, "lz4", block, 1);
        if (got != want || (got > 0 && std::memcmp(a, b, static_cast<size_t>(got)) != 0))
            FAIL("%zu bytes of type %zu in blocks of %zu, level %d, room %zu: %d, Blosc %d", size, type, block, level,
                 room, got, want);
    }
}

int main()
{
    void *library = dlopen("libblosc.so.1", RTLD_NOW | RTLD_LOCAL);
    blosc = library ? reinterpret_cast<Compress *>(dlsym(library, "blosc_compress_ctx")) : nullptr;
    if (!blosc) {
        std::printf("1..0 # SKIP no libblosc.so.1\n");
        return 0;
    }
    RUN(test_same_bytes);
    return test_end();
}
