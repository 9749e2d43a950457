/* The values of one node of a tree, unpacked: of a node of the two inner levels, or of a leaf.
 *
 * A block holds the node's values, or with active-mask compression only the active ones; the others are then the
 * background, its negative, or one of two values kept beside the block, chosen by a second mask.  Reals may be kept as
 * half, and the block may be compressed by zlib or Blosc.  Where the lengths are right (vdb_tree.c), only the compressed
 * bytes themselves can be damaged. */
#include "io/vdb_private.h"

#include <string.h>
#include <zlib.h>

#include "base/half.h"
#include "base/refusals.h"
#include "io/blosc.h"

/* ---- numbers ---- */

static uint16_t load_half(const unsigned char *p) { return (uint16_t)(p[0] | p[1] << 8); }

#define CONVERT(T, NUMBER)                                                                                             \
    for (size_t i = 0; i < n; i++) {                                                                                   \
        T v;                                                                                                           \
        memcpy(&v, from + i * sizeof v, sizeof v);                                                                     \
        out[i] = NUMBER;                                                                                               \
    }                                                                                                                  \
    return

/* Integers become float by way of double, as every other number does. */
void vol_vdb_to_floats(const VdbTreeKind *kind, const void *values, size_t count, float *out)
{
    const unsigned char *from = values;
    size_t n = count * kind->components;
    switch (kind->value) {
    case VOL_VALUE_FLOAT:
    case VOL_VALUE_VEC3S: memcpy(out, from, n * sizeof *out); return;
    case VOL_VALUE_DOUBLE:
    case VOL_VALUE_VEC3D: CONVERT(double, (float)v);
    case VOL_VALUE_HALF: CONVERT(uint16_t, vol_half_to_float(v));
    case VOL_VALUE_INT32:
    case VOL_VALUE_VEC3I: CONVERT(int32_t, (float)(double)v);
    case VOL_VALUE_INT64: CONVERT(int64_t, (float)(double)v);
    default: CONVERT(uint8_t, (float)(v != 0));
    }
}

void vol_vdb_to_doubles(const VdbTreeKind *kind, const void *values, size_t count, double *out)
{
    const unsigned char *from = values;
    size_t n = count * kind->components;
    switch (kind->value) {
    case VOL_VALUE_FLOAT:
    case VOL_VALUE_VEC3S: CONVERT(float, (double)v);
    case VOL_VALUE_DOUBLE:
    case VOL_VALUE_VEC3D: memcpy(out, from, n * sizeof *out); return;
    case VOL_VALUE_HALF: CONVERT(uint16_t, (double)vol_half_to_float(v));
    case VOL_VALUE_INT32:
    case VOL_VALUE_VEC3I: CONVERT(int32_t, (double)v);
    case VOL_VALUE_INT64: CONVERT(int64_t, (double)v);
    default: CONVERT(uint8_t, (double)(v != 0));
    }
}

/* Reals of the tree's own type from halves. */
static void widen_halves(const VdbTreeKind *kind, const unsigned char *from, size_t n, unsigned char *to)
{
    for (size_t i = 0; i < n; i++) {
        uint16_t half = load_half(from + 2 * i);
        float single = vol_half_to_float(half);
        double wide = (double)single;
        const void *value = kind->component_size == 2 ? (const void *)&half
                            : kind->component_size == 4 ? (const void *)&single : (const void *)&wide;
        memcpy(to + i * kind->component_size, value, kind->component_size);
    }
}

static void negate(const VdbTreeKind *kind, const unsigned char *from, unsigned char *to)
{
    size_t size = kind->component_size;
    for (uint32_t c = 0; c < kind->components; c++, from += size, to += size) {
        memcpy(to, from, size);
        if (kind->value == VOL_VALUE_BOOL || kind->value == VOL_VALUE_MASK) {
            *to = !*from;
        } else if (kind->real) {
            to[size - 1] ^= 0x80;
        } else { /* two's complement: the complement plus one */
            unsigned carry = 1;
            for (size_t i = 0; i < size; i++) {
                carry += (unsigned char)~from[i];
                to[i] = (unsigned char)carry;
                carry >>= 8;
            }
        }
    }
}

/* ---- blocks ---- */

/* Values of one node: far below zlib's 32 bits of length. */
static VolStatus unzip(const unsigned char *from, size_t size, void *to, size_t to_size, VolError *err)
{
    z_stream z = {.next_in = (Bytef *)(uintptr_t)from, .avail_in = (uInt)size, .next_out = to, .avail_out = (uInt)to_size,
                  .zalloc = vol_zlib_alloc, .zfree = vol_zlib_free};
    int result = inflateInit(&z);
    if (result == Z_OK) {
        result = inflate(&z, Z_FINISH);
        inflateEnd(&z);
    }
    if (result == Z_MEM_ERROR)
        return vol_fail(err, VOL_NOMEM, "out of memory for zlib");
    if (result != Z_STREAM_END || z.avail_out)
        return vol_fail(err, VOL_BAD_INPUT, "a compressed block is damaged");
    return VOL_OK;
}

/* A block of `count` stored values at byte *at. */
static VolStatus unpack_block(const VdbTree *tree, size_t *at, size_t count, void *to, VolError *err)
{
    const VdbCodec *codec = &tree->codec;
    const unsigned char *from = tree->data + *at;
    size_t bytes = count * codec->stored_size;
    int64_t length = 0;
    if (codec->half && count == 0)
        return VOL_OK;
    if (codec->compression & (VDB_COMPRESS_ZIP | VDB_COMPRESS_BLOSC)) {
        length = (int64_t)vol_load_u64(from);
        from += 8;
        *at += 8;
    }
    *at += length > 0 ? (size_t)length : bytes;
    if (length <= 0) {
        memcpy(to, from, bytes);
        return VOL_OK;
    }
    VolStatus status;
    if (codec->compression & VDB_COMPRESS_BLOSC)
        status = vol_blosc_unpack(from, (size_t)length, to, bytes, err);
    else
        status = unzip(from, (size_t)length, to, bytes, err);
    return status == VOL_BAD_INPUT ? vol_fail_within(err, status, "byte %zu", (size_t)(from - tree->data)) : status;
}

/* ---- nodes ---- */

static bool is_on(const unsigned char *mask, uint32_t n) { return mask[n / 8] >> (n % 8) & 1; }

/* Active values to their places, and what stands for the others between them. */
static void spread(const unsigned char *packed, const unsigned char *mask, const unsigned char *selection,
                   const unsigned char *inactive[2], uint32_t capacity, size_t size, unsigned char *to)
{
    for (uint32_t n = 0; n < capacity; n++, to += size) {
        const unsigned char *value = inactive[selection && is_on(selection, n)];
        if (is_on(mask, n)) {
            value = packed;
            packed += size;
        }
        memcpy(to, value, size);
    }
}

VolStatus vol_vdb_unpack_values(const VdbTree *tree, size_t *at, const unsigned char *mask, uint32_t capacity,
                                const void *background, void *values, void *scratch, VolError *err)
{
    const VdbCodec *codec = &tree->codec;
    size_t size = codec->value_size;
    unsigned char negated[3 * sizeof(double)];
    unsigned form = tree->data[*at];
    const unsigned char *inactive[2] = {background, background}, *selection = NULL;
    *at += 1;
    if (form != VDB_BACKGROUND) {
        negate(codec->kind, background, negated);
        inactive[0] = negated;
    }
    if (form == VDB_ONE_INACTIVE_VALUE || form == VDB_MASK_ONE_VALUE || form == VDB_MASK_TWO_VALUES) {
        inactive[0] = tree->data + *at;
        *at += size;
    }
    if (form == VDB_MASK_TWO_VALUES) {
        inactive[1] = tree->data + *at;
        *at += size;
    }
    if (form == VDB_MASK_NO_VALUE || form == VDB_MASK_ONE_VALUE || form == VDB_MASK_TWO_VALUES) {
        selection = tree->data + *at;
        *at += capacity / 8;
    }
    uint32_t count = vol_vdb_block_count(codec, form, mask, capacity);
    unsigned char *packed = count == capacity ? values : scratch, *block = packed;
    if (codec->half)
        block = (unsigned char *)scratch + (size_t)capacity * size;
    VolStatus status = unpack_block(tree, at, count, block, err);
    if (status)
        return status;
    if (codec->half)
        widen_halves(codec->kind, block, (size_t)count * codec->kind->components, packed);
    if (count != capacity)
        spread(packed, mask, selection, inactive, capacity, size, values);
    return VOL_OK;
}

VolStatus vol_vdb_unpack_leaf(const VdbTree *tree, const VdbLeaf *leaf, const void *background, void *values,
                              void *scratch, VolError *err)
{
    const unsigned char *mask = vol_vdb_leaf_mask(tree, leaf);
    VolVdbValue value = tree->codec.kind->value;
    if (value == VOL_VALUE_BOOL || value == VOL_VALUE_MASK) {
        const unsigned char *bits = value == VOL_VALUE_MASK ? mask : tree->data + leaf->values + 12; /* behind its origin */
        for (uint32_t n = 0; n < VDB_LEAF_VALUES; n++)
            ((unsigned char *)values)[n] = is_on(bits, n);
        return VOL_OK;
    }
    size_t at = leaf->values;
    return vol_vdb_unpack_values(tree, &at, mask, VDB_LEAF_VALUES, background, values, scratch, err);
}
