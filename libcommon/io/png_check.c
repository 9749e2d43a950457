/* Is every byte of a PNG there and whole?  (libpng would find out too, but it prints what it finds.)
 * A PNG is 8 bytes of signature, then chunks: length, name, data, CRC-32 of name and data, up to the chunk IEND. */
#include "io/pixels.h"

#include <stdint.h>
#include <string.h>

static uint32_t big_endian(const unsigned char *b)
{
    return (uint32_t)b[0] << 24 | (uint32_t)b[1] << 16 | (uint32_t)b[2] << 8 | b[3];
}

/* Polynomial 0xedb88320, reflected; half a byte at a time. */
static uint32_t crc32(const unsigned char *data, size_t size)
{
    static const uint32_t nibble[16] = {0x00000000, 0x1db71064, 0x3b6e20c8, 0x26d930ac, 0x76dc4190, 0x6b6b51f4,
                                        0x4db26158, 0x5005713c, 0xedb88320, 0xf00f9344, 0xd6d6a3e8, 0xcb61b38c,
                                        0x9b64c2b0, 0x86d3d2d4, 0xa00ae278, 0xbdbdf21c};
    uint32_t crc = UINT32_MAX;
    for (size_t i = 0; i < size; i++) {
        crc = nibble[(crc ^ data[i]) & 15] ^ crc >> 4;
        crc = nibble[(crc ^ (uint32_t)data[i] >> 4) & 15] ^ crc >> 4;
    }
    return ~crc;
}

VolStatus vol_png_check(const VolBytes *bytes, const char *name, VolError *err)
{
    for (size_t at = 8;;) {
        size_t left = bytes->size - at;
        if (left < 12 || big_endian(bytes->data + at) > left - 12)
            return vol_fail(err, VOL_BAD_INPUT, "damaged PNG '%s': ends at byte %zu, within the chunk at byte %zu", name,
                            bytes->size, at);
        size_t length = big_endian(bytes->data + at);
        const unsigned char *chunk = bytes->data + at + 4;
        if (crc32(chunk, length + 4) != big_endian(chunk + 4 + length))
            return vol_fail(err, VOL_BAD_INPUT, "damaged PNG '%s': wrong checksum in the chunk at byte %zu", name, at);
        if (memcmp(chunk, "IEND", 4) == 0)
            return VOL_OK;
        at += length + 12;
    }
}
