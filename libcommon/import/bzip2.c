#include <bzlib.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "base/mem.h"
#include "import/sampled.h"

typedef struct Expander {
    bz_stream z;
    const unsigned char *data;
    size_t size, fed; /* bytes of the input handed to libbz2 so far */
    VolBytes out;
    size_t capacity;
} Expander;

static void *bzip2_alloc(void *opaque, int count, int size)
{
    (void)opaque;
    return count < 0 || size < 0 ? NULL : vol_alloc((size_t)count, (size_t)size);
}

static void bzip2_free(void *opaque, void *block)
{
    (void)opaque;
    free(block);
}

/* libbz2 counts in 32 bits: it is fed by pieces. */
static void feed(Expander *expander)
{
    bz_stream *z = &expander->z;
    size_t left = expander->size - expander->fed;
    if (z->avail_in)
        return;
    z->next_in = (char *)(uintptr_t)(expander->data + expander->fed);
    z->avail_in = left > 1u << 30 ? 1u << 30 : (unsigned)left;
    expander->fed += z->avail_in;
}

/* One stream to its end. */
static VolStatus expand_stream(Expander *expander, const char *name, VolError *err)
{
    char piece[1 << 16];
    bz_stream *z = &expander->z;
    for (;;) {
        feed(expander);
        z->next_out = piece;
        z->avail_out = sizeof piece;
        int result = BZ2_bzDecompress(z);
        size_t made = sizeof piece - z->avail_out, at = expander->fed - z->avail_in;
        VolStatus status = vol_append_unpacked(&expander->out, &expander->capacity, piece, made, name, err);
        if (status || result == BZ_STREAM_END)
            return status;
        if (result == BZ_MEM_ERROR)
            return vol_fail_memory(err, sizeof piece);
        if (result != BZ_OK)
            return vol_fail(err, VOL_BAD_INPUT, "cannot read '%s': compressed data damaged at byte %zu", name, at);
        if (made == 0 && z->avail_in == 0 && expander->fed == expander->size)
            return vol_fail(err, VOL_BAD_INPUT, "cannot read '%s': compressed data truncated after %zu bytes",
                            name, at);
    }
}

VolStatus vol_bunzip2(const unsigned char *data, size_t size, const char *name, VolBytes *out, VolError *err)
{
    Expander expander = {.data = data, .size = size};
    VolStatus status = VOL_OK;
    for (size_t at = 0; !status;) {
        expander.z = (bz_stream){.bzalloc = bzip2_alloc, .bzfree = bzip2_free};
        expander.fed = at;
        if (BZ2_bzDecompressInit(&expander.z, 0, 0) != BZ_OK) {
            status = vol_fail_memory(err, 1 << 16);
            break;
        }
        status = expand_stream(&expander, name, err);
        at = expander.fed - expander.z.avail_in;
        BZ2_bzDecompressEnd(&expander.z);
        if (size - at < 4 || memcmp(data + at, "BZh", 3) != 0) /* several streams are one, as bzip2 has it */
            break;
    }
    if (status)
        vol_bytes_free(&expander.out);
    else
        *out = expander.out;
    return status;
}

size_t vol_bunzip2_head(const VolBytes *bytes, unsigned char *out, size_t room)
{
    bz_stream z = {.bzalloc = bzip2_alloc, .bzfree = bzip2_free,
                   .next_in = (char *)bytes->data, .avail_in = bytes->size > 1u << 21 ? 1u << 21 : (unsigned)bytes->size,
                   .next_out = (char *)out, .avail_out = (unsigned)room};
    if (BZ2_bzDecompressInit(&z, 0, 0) != BZ_OK)
        return 0;
    while (z.avail_out && z.avail_in && BZ2_bzDecompress(&z) == BZ_OK)
        continue;
    BZ2_bzDecompressEnd(&z);
    return room - z.avail_out;
}
