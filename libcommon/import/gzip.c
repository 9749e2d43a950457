#include <limits.h>
#include <stdlib.h>
#include <string.h>
#include <zlib.h>

#include "base/refusals.h"
#include "import/sampled.h"

typedef struct Inflater {
    z_stream z;
    const unsigned char *data;
    size_t size, fed; /* bytes of the input handed to zlib so far */
    VolBytes out;
    size_t capacity;
} Inflater;

/* One member (or the one zlib stream) to its end.  zlib counts in 32 bits: it is fed by pieces. */
static VolStatus inflate_member(Inflater *inflater, const char *name, VolError *err)
{
    unsigned char piece[1 << 16];
    z_stream *z = &inflater->z;
    for (;;) {
        if (z->avail_in == 0) {
            size_t left = inflater->size - inflater->fed;
            z->next_in = (Bytef *)(uintptr_t)(inflater->data + inflater->fed);
            z->avail_in = left > 1u << 30 ? 1u << 30 : (uInt)left;
            inflater->fed += z->avail_in;
        }
        z->next_out = piece;
        z->avail_out = sizeof piece;
        int result = inflate(z, Z_NO_FLUSH);
        VolStatus status =
            vol_append_unpacked(&inflater->out, &inflater->capacity, piece, sizeof piece - z->avail_out, name,
                                err);
        if (status || result == Z_STREAM_END)
            return status;
        size_t at = inflater->fed - z->avail_in;
        if (result == Z_MEM_ERROR)
            return vol_fail_memory(err, sizeof piece);
        if (result != Z_OK && result != Z_BUF_ERROR)
            return vol_fail(err, VOL_BAD_INPUT, "cannot read '%s': compressed data damaged at byte %zu", name, at);
        if (z->avail_out == sizeof piece && z->avail_in == 0 && inflater->fed == inflater->size)
            return vol_fail(err, VOL_BAD_INPUT, "cannot read '%s': compressed data truncated after %zu bytes",
                            name, at);
    }
}

VolStatus vol_inflate(const unsigned char *data, size_t size, const char *name, VolBytes *out, VolError *err)
{
    Inflater inflater = {.z = {.zalloc = vol_zlib_alloc, .zfree = vol_zlib_free}, .data = data, .size = size};
    if (inflateInit2(&inflater.z, -15) != Z_OK) /* no header, no checksum */
        return vol_fail_memory(err, 1 << 16);
    VolStatus status = inflate_member(&inflater, name, err);
    inflateEnd(&inflater.z);
    if (status)
        vol_bytes_free(&inflater.out);
    else
        *out = inflater.out;
    return status;
}

VolStatus vol_gunzip(const unsigned char *data, size_t size, const char *name, VolBytes *out, VolError *err)
{
    Inflater inflater = {.z = {.zalloc = vol_zlib_alloc, .zfree = vol_zlib_free}, .data = data, .size = size};
    if (inflateInit2(&inflater.z, 15 + 32) != Z_OK) /* 32: zlib or gzip, by its first bytes */
        return vol_fail_memory(err, 1 << 16);

    VolStatus status = VOL_OK;
    for (;;) {
        status = inflate_member(&inflater, name, err);
        size_t at = inflater.fed - inflater.z.avail_in;
        bool more = !status && size - at >= 2 && data[at] == 0x1f && data[at + 1] == 0x8b;
        if (!more)
            break;
        inflateReset(&inflater.z);
    }
    inflateEnd(&inflater.z);
    if (status)
        vol_bytes_free(&inflater.out);
    else
        *out = inflater.out;
    return status;
}

size_t vol_gunzip_head(const VolBytes *bytes, unsigned char *out, size_t room)
{
    z_stream z = {.next_in = bytes->data, .avail_in = bytes->size > 1u << 20 ? 1u << 20 : (uInt)bytes->size,
                  .next_out = out, .avail_out = (uInt)room};
    if (inflateInit2(&z, 15 + 32) != Z_OK)
        return 0;
    inflate(&z, Z_SYNC_FLUSH);
    inflateEnd(&z);
    return room - z.avail_out;
}
