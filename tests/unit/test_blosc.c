/* Blosc's chunks as we unpack them, against Blosc itself. */
#include <blosc.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "io/blosc.h"
#include "tests/unit/test.h"

enum { MOST = 200000, OVERHEAD = BLOSC_MAX_OVERHEAD, BEHIND = 64 };

static unsigned char plain[MOST], packed[MOST + OVERHEAD], unpacked[MOST + BEHIND];
static VolError err;

static uint32_t state = 1;

static uint32_t next(void)
{
    state ^= state << 13;
    state ^= state >> 17;
    state ^= state << 5;
    return state;
}

/* From what cannot be compressed (0) to zeros (3), the high bytes of each value
 * smoother than the low ones. */
static void fill(size_t size, size_t type_size, int smoothness)
{
    for (size_t i = 0; i < size; i++) {
        size_t value = i / type_size, byte = i % type_size;
        uint32_t noise = next();
        unsigned char wave = (unsigned char)(byte * 2 >= type_size ? value / 300 : value * 7);
        plain[i] = smoothness == 0 ? (unsigned char)noise
                   : smoothness == 3
                       ? 0
                       : (unsigned char)(wave + (byte * 2 < type_size && smoothness == 1 ? noise >> 24 & 15 : 0));
    }
}

static size_t pack(size_t size, size_t type_size, int level, int shuffle, const char *codec, size_t block)
{
    int length = blosc_compress_ctx(level, shuffle, type_size, size, plain, packed, sizeof packed, codec, block, 1);
    if (length <= 0)
        FAIL("Blosc does not compress: %d", length);
    return length > 0 ? (size_t)length : 0;
}

static void check_equal(size_t size, size_t type_size, int level, int shuffle, const char *codec, size_t block)
{
    size_t length = pack(size, type_size, level, shuffle, codec, block);
    memset(unpacked, 0xa5, size + BEHIND);
    VolStatus status = vol_blosc_unpack(packed, length, unpacked, size, &err);
    bool beyond = false;
    for (size_t i = 0; i < BEHIND; i++)
        beyond |= unpacked[size + i] != 0xa5;
    if (status || beyond || memcmp(plain, unpacked, size))
        FAIL("%zu bytes of type %zu, level %d, shuffle %d, %s, blocks of %zu: %s", size, type_size, level, shuffle, codec,
             block,
             status   ? err.text
             : beyond ? "wrote beyond"
                      : "they differ");
}

static const size_t types[] = {1, 2, 4, 6, 8, 12, 16, 17, 24};
static const size_t sizes[] = {0,     1,     7,     16,    127,    128,    129,    255,    512,   1000,
                               1024,  1536,  2048,  4095,  4096,   6144,   12288,  16383,  16384, 32767,
                               32768, 32769, 65536, 65540, 131072, 131073, 196608, 199999, 200000};

static void test_as_openvdb_writes(void)
{
    for (size_t t = 0; t < sizeof types / sizeof *types; t++)
        for (size_t s = 0; s < sizeof sizes / sizeof *sizes; s++) {
            fill(sizes[s], types[t], (int)(next() % 4));
            for (int shuffle = 0; shuffle < 2; shuffle++)
                for (int level = 1; level <= 9; level += 2)
                    check_equal(sizes[s], types[t], level, shuffle, BLOSC_LZ4_COMPNAME, 0);
            check_equal(sizes[s], types[t], 9, 1, BLOSC_LZ4_COMPNAME, sizes[s]); /* OpenVDB asks for one block */
        }
}

static void test_around_blocks(void)
{
    for (int n = 0; n < 3000; n++) {
        size_t type = types[next() % (sizeof types / sizeof *types)], block = type * (1 + next() % 700);
        size_t size = block * (next() % 8) + next() % 5;
        size = size > 2 && next() % 2 ? size - 2 : size;
        fill(size, type, (int)(next() % 4));
        check_equal(size, type, 1 + (int)(next() % 9), (int)(next() % 2), BLOSC_LZ4_COMPNAME, block);
    }
}

/* Level 0 stores; other codecs, and LZ4 behind a shuffle of bits, are left to
 * Blosc. */
static void test_others(void)
{
    static const char *const codecs[] = {"blosclz", "lz4", "lz4hc", "zlib", "zstd", "snappy"};
    for (size_t c = 0; c < sizeof codecs / sizeof *codecs; c++)
        for (int shuffle = 0; shuffle < 3; shuffle++)
            for (int level = 0; level < 10; level += 3) {
                fill(20000, 4, 1 + level % 2);
                if (blosc_compname_to_compcode(codecs[c]) >= 0)
                    check_equal(20000, 4, level, shuffle, codecs[c], 0);
            }
}

/* Memory of the right size to a byte, so that a sanitizer sees what is read or
 * written beyond. */
static VolStatus unpack_exactly(const unsigned char *bytes, size_t length, size_t size)
{
    unsigned char *from = malloc(length ? length : 1), *to = malloc(size ? size : 1);
    VolStatus status = VOL_NOMEM;
    if (from && to) {
        memcpy(from, bytes, length);
        status = vol_blosc_unpack(from, length, to, size, &err);
    }
    free(from);
    free(to);
    return status;
}

static void check_damaged(size_t size, size_t type_size, int shuffle, size_t block)
{
    size_t length = pack(size, type_size, 5, shuffle, BLOSC_LZ4_COMPNAME, block);
    for (size_t cut = 0; cut < length; cut += 1 + cut / 64)
        CHECK(unpack_exactly(packed, cut, size) == VOL_BAD_INPUT);
    CHECK(unpack_exactly(packed, length, size + 1) == VOL_BAD_INPUT);
    CHECK(size == 0 || unpack_exactly(packed, length, size - 1) == VOL_BAD_INPUT);
    for (size_t i = 0; i < length && i < 3000; i++)
        for (int kind = 0; kind < 10; kind++) {
            unsigned char was = packed[i];
            packed[i] = (unsigned char)(kind < 8 ? was ^ 1 << kind : kind == 8 ? 0xff : 0x80);
            VolStatus status = unpack_exactly(packed, length, size);
            CHECK(status == VOL_OK || status == VOL_BAD_INPUT);
            packed[i] = was;
        }
    for (int n = 0; n < 2000; n++) { /* several bytes at once, near the beginning most of all */
        unsigned char was[4];
        size_t at[4];
        for (int k = 0; k < 4; k++) {
            at[k] = next() % (n % 2 && length > 40 ? 40 : length);
            was[k] = packed[at[k]];
            packed[at[k]] = (unsigned char)next();
        }
        VolStatus status = unpack_exactly(packed, length, size);
        CHECK(status == VOL_OK || status == VOL_BAD_INPUT);
        for (int k = 3; k >= 0; k--)
            packed[at[k]] = was[k];
    }
    CHECK(unpack_exactly(packed, length, size) == VOL_OK);
}

static void test_damaged(void)
{
    fill(2048, 4, 2);
    check_damaged(2048, 4, 1, 0);
    check_damaged(2048, 4, 0, 0);
    check_damaged(2048, 1, 1, 512);
    fill(5000, 8, 1);
    check_damaged(5000, 8, 1, 2048);
    fill(6144, 12, 1);
    check_damaged(6144, 12, 1, 0);
    fill(300, 4, 0);
    check_damaged(300, 4, 1, 0);
    check_damaged(0, 4, 1, 0);
}

int main(void)
{
    RUN(test_as_openvdb_writes);
    RUN(test_around_blocks);
    RUN(test_others);
    RUN(test_damaged);
    return test_end();
}
