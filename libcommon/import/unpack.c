/* Files that are packed as a whole. */
#include <string.h>

#include "import/sampled.h"

static bool is_gzip(const VolBytes *bytes)
{
    return bytes->size >= 2 && bytes->data[0] == 0x1f && bytes->data[1] == 0x8b;
}

/* "BZh", the size of the blocks, and the first block's mark: pi, or the end's, the square root of pi. */
static bool is_bzip2(const VolBytes *bytes)
{
    const unsigned char *p = bytes->data;
    return bytes->size >= 10 && memcmp(p, "BZh", 3) == 0 && p[3] >= '1' && p[3] <= '9' &&
           (memcmp(p + 4, "\x31\x41\x59\x26\x53\x59", 6) == 0 || memcmp(p + 4, "\x17\x72\x45\x38\x50\x90", 6) == 0);
}

bool vol_is_packed(const VolBytes *bytes) { return is_gzip(bytes) || is_bzip2(bytes); }

size_t vol_unpack_head(const VolBytes *bytes, unsigned char *out, size_t room)
{
    return is_gzip(bytes) ? vol_gunzip_head(bytes, out, room)
           : is_bzip2(bytes) ? vol_bunzip2_head(bytes, out, room)
                             : 0;
}

VolStatus vol_unpack(VolBytes *bytes, const char *name, VolError *err)
{
    if (!vol_is_packed(bytes))
        return VOL_OK;
    VolBytes unpacked = {0};
    VolStatus status = is_gzip(bytes) ? vol_gunzip(bytes->data, bytes->size, name, &unpacked, err)
                                      : vol_bunzip2(bytes->data, bytes->size, name, &unpacked, err);
    if (status)
        return status;
    vol_bytes_free(bytes);
    *bytes = unpacked;
    return VOL_OK;
}
