/* A walk over the bytes of a tree, before OpenVDB reads them.
 *
 * A tree of numbers has four levels: a root (a table), nodes of 32^3 and of 16^3 entries, and leaves of 8^3 voxels.
 * Topology:  int32 1; background; uint32 tiles, children;
 *            per tile: origin (3 int32), value, active (1 byte);
 *            per child: origin, node 32^3 { child mask, value mask, values, nodes 16^3 { child mask, value mask, values,
 *            leaves { value mask } } }
 * Buffers:   per leaf, in the same order: value mask, values (bool and mask trees: other forms, see walk_bit_leaf).
 * Values:    a byte that says how inactive ones were left out, up to two inactive values, a mask that selects between
 *            them, and a block: raw, or a signed 64-bit length (negative: stored as it is) and compressed bytes.
 *
 * Every length is thus known from what precedes it, and a cut or a false length shows itself here, where it costs
 * nothing, and not as a huge allocation later. */
#include "io/vdb_private.h"

#include <stdlib.h>
#include <string.h>

enum { ROOT_CHILD_DIM = 4096, LEAF_MASK_BYTES = 64, LEAF_VALUES = 512 };
enum { UPPER_LOG2 = 5, LOWER_LOG2 = 4 }; /* entries per axis of the two inner levels */
enum { BLOSC_OVERHEAD = 16 };

/* How inactive values are stored with a node's values. */
enum {
    ONE_INACTIVE_VALUE = 2,
    MASK_NO_VALUE = 3,
    MASK_ONE_VALUE = 4,
    MASK_TWO_VALUES = 5,
    ALL_VALUES = 6
};

const VdbTreeKind *vol_vdb_tree_kind(const char *type)
{
    static const struct {
        const char *type;
        VdbTreeKind kind;
    } kinds[] = {
        {"Tree_float_5_4_3", {VOL_VALUE_FLOAT, 1, 4, true}},   {"Tree_double_5_4_3", {VOL_VALUE_DOUBLE, 1, 8, true}},
        {"Tree_half_5_4_3", {VOL_VALUE_HALF, 1, 2, true}},     {"Tree_int32_5_4_3", {VOL_VALUE_INT32, 1, 4, false}},
        {"Tree_int64_5_4_3", {VOL_VALUE_INT64, 1, 8, false}},  {"Tree_bool_5_4_3", {VOL_VALUE_BOOL, 1, 1, false}},
        {"Tree_mask_5_4_3", {VOL_VALUE_MASK, 1, 1, false}},    {"Tree_vec3s_5_4_3", {VOL_VALUE_VEC3S, 3, 4, true}},
        {"Tree_vec3d_5_4_3", {VOL_VALUE_VEC3D, 3, 8, true}},   {"Tree_vec3i_5_4_3", {VOL_VALUE_VEC3I, 3, 4, false}},
        {"Tree_ptdataidx32_5_4_3", {VOL_VALUE_POINTS, 1, 4, false}},
    };
    for (size_t i = 0; i < sizeof kinds / sizeof kinds[0]; i++)
        if (strcmp(kinds[i].type, type) == 0)
            return &kinds[i].kind;
    return NULL;
}

bool vol_vdb_is_numeric(const char *type)
{
    const VdbTreeKind *kind = vol_vdb_tree_kind(type);
    return kind && kind->value != VOL_VALUE_POINTS;
}

typedef struct Leaf {
    size_t mask; /* byte of its mask in the topology */
    int32_t origin[3];
} Leaf;

typedef struct Walk {
    const unsigned char *data;
    size_t at, limit;
    uint32_t compression;
    const VdbTreeKind *kind;
    size_t value_size;  /* in memory */
    size_t stored_size; /* in a block */
    bool half;
    Leaf *leaves;
    size_t leaf_count, leaf_capacity;
    VolError *err;
} Walk;

static VolStatus cut(Walk *walk, const char *what)
{
    return vol_fail(walk->err, VOL_BAD_INPUT, "byte %zu: %s runs past the end at byte %zu", walk->at, what,
                    walk->limit);
}

static VolStatus take(Walk *walk, uint64_t size, const char *what, const unsigned char **out)
{
    *out = walk->data + walk->at;
    if (size > walk->limit - walk->at)
        return cut(walk, what);
    walk->at += (size_t)size;
    return VOL_OK;
}

static uint32_t load_u32(const unsigned char *p)
{
    return (uint32_t)p[0] | (uint32_t)p[1] << 8 | (uint32_t)p[2] << 16 | (uint32_t)p[3] << 24;
}

static uint64_t load_u64(const unsigned char *p) { return load_u32(p) | (uint64_t)load_u32(p + 4) << 32; }

static uint32_t count_bits(const unsigned char *mask, size_t bytes)
{
    uint32_t count = 0;
    for (size_t i = 0; i < bytes; i += 8)
        count += (uint32_t)__builtin_popcountll(load_u64(mask + i));
    return count;
}

static VolStatus walk_block(Walk *walk, uint64_t count)
{
    const unsigned char *p;
    uint64_t bytes = count * walk->stored_size;
    if (walk->half && count == 0)
        return VOL_OK;
    if (!(walk->compression & (VDB_COMPRESS_ZIP | VDB_COMPRESS_BLOSC)))
        return take(walk, bytes, "a block of values", &p);

    size_t where = walk->at;
    VolStatus status = take(walk, 8, "the length of a block", &p);
    if (status)
        return status;
    int64_t length = (int64_t)load_u64(p);
    if (length <= 0 ? length != -(int64_t)bytes : (uint64_t)length > bytes + BLOSC_OVERHEAD)
        return vol_fail(walk->err, VOL_BAD_INPUT, "byte %zu: a block of %lld bytes where %llu uncompressed are expected",
                        where, (long long)length, (unsigned long long)bytes);
    uint64_t stored = length <= 0 ? bytes : (uint64_t)length;
    if ((status = take(walk, stored, "a block of values", &p)) != VOL_OK)
        return status;
    /* Blosc repeats both lengths in a header of its own, and trusts it. */
    if (length > 0 && (walk->compression & VDB_COMPRESS_BLOSC) &&
        (stored < BLOSC_OVERHEAD || load_u32(p + 4) != bytes || load_u32(p + 12) != stored))
        return vol_fail(walk->err, VOL_BAD_INPUT, "byte %zu: a compressed block contradicts its length", where);
    return VOL_OK;
}

/* The values of a node: `capacity` of them, of which `mask` tells the active ones. */
static VolStatus walk_values(Walk *walk, const unsigned char *mask, uint32_t capacity)
{
    const unsigned char *p;
    size_t where = walk->at;
    VolStatus status = take(walk, 1, "a node", &p);
    if (status)
        return status;
    unsigned form = *p;
    if (form > ALL_VALUES)
        return vol_fail(walk->err, VOL_BAD_INPUT, "byte %zu: unknown form %u of a node's values", where, form);
    size_t extra = 0;
    if (form == ONE_INACTIVE_VALUE || form == MASK_ONE_VALUE)
        extra = walk->value_size;
    else if (form == MASK_TWO_VALUES)
        extra = 2 * walk->value_size;
    if (form == MASK_NO_VALUE || form == MASK_ONE_VALUE || form == MASK_TWO_VALUES)
        extra += capacity / 8;
    if ((status = take(walk, extra, "a node", &p)) != VOL_OK)
        return status;
    bool active_only = (walk->compression & VDB_COMPRESS_ACTIVE_MASK) && form != ALL_VALUES;
    return walk_block(walk, active_only ? count_bits(mask, capacity / 8) : capacity);
}

static VolStatus add_leaf(Walk *walk, const int32_t origin[3])
{
    if (walk->leaf_count == walk->leaf_capacity) {
        size_t capacity = walk->leaf_capacity ? 2 * walk->leaf_capacity : 256;
        Leaf *grown = vol_resize(walk->leaves, capacity, sizeof *grown);
        if (!grown)
            return vol_fail_memory(walk->err, capacity * sizeof *grown);
        walk->leaves = grown;
        walk->leaf_capacity = capacity;
    }
    walk->leaves[walk->leaf_count++] = (Leaf){walk->at, {origin[0], origin[1], origin[2]}};
    const unsigned char *p;
    return take(walk, LEAF_MASK_BYTES, "a leaf's mask", &p);
}

/* An inner node whose 2^(3 log2) entries are cubes of `child_dim` voxels. */
static VolStatus walk_inner(Walk *walk, const int32_t origin[3], int log2, int32_t child_dim)
{
    uint32_t entries = 1u << (3 * log2), axis_mask = (1u << log2) - 1;
    const unsigned char *children, *values;
    VolStatus status = take(walk, entries / 8, "a node's masks", &children);
    if (!status)
        status = take(walk, entries / 8, "a node's masks", &values);
    if (!status)
        status = walk_values(walk, values, entries);
    for (uint32_t n = 0; n < entries && !status; n++) {
        if (!(children[n / 8] >> (n % 8) & 1))
            continue;
        int32_t child[3] = {origin[0] + (int32_t)(n >> (2 * log2)) * child_dim,
                            origin[1] + (int32_t)(n >> log2 & axis_mask) * child_dim,
                            origin[2] + (int32_t)(n & axis_mask) * child_dim};
        status = log2 == UPPER_LOG2 ? walk_inner(walk, child, LOWER_LOG2, 8) : add_leaf(walk, child);
    }
    return status;
}

/* Origins in the root's table ascend, so that none comes twice, and are multiples of a child's width. */
static VolStatus take_origin(Walk *walk, int32_t origin[3], const int32_t *previous)
{
    const unsigned char *p;
    size_t where = walk->at;
    VolStatus status = take(walk, 12, "an origin", &p);
    if (status)
        return status;
    int order = previous ? 0 : 1;
    for (int k = 0; k < 3; k++) {
        origin[k] = (int32_t)load_u32(p + 4 * k);
        if (origin[k] % ROOT_CHILD_DIM != 0)
            return vol_fail(walk->err, VOL_BAD_INPUT, "byte %zu: node origin %d is not a multiple of %d", where,
                            origin[k], ROOT_CHILD_DIM);
        if (order == 0)
            order = (origin[k] > previous[k]) - (origin[k] < previous[k]);
    }
    if (order <= 0)
        return vol_fail(walk->err, VOL_BAD_INPUT, "byte %zu: node origins are out of order", where);
    return VOL_OK;
}

static VolStatus walk_topology(Walk *walk)
{
    const unsigned char *p;
    size_t where = walk->at;
    VolStatus status = take(walk, 4 + walk->value_size + 8, "the root of the tree", &p);
    if (status)
        return status;
    if (load_u32(p) != 1)
        return vol_fail(walk->err, VOL_BAD_INPUT, "byte %zu: %u buffers per tree", where, load_u32(p));
    uint32_t tiles = load_u32(p + 4 + walk->value_size), children = load_u32(p + 8 + walk->value_size);
    int32_t origin[2][3] = {{0}};
    for (uint32_t i = 0; i < tiles; i++) {
        if ((status = take_origin(walk, origin[i % 2], i ? origin[(i + 1) % 2] : NULL)) != VOL_OK ||
            (status = take(walk, walk->value_size + 1, "a tile", &p)) != VOL_OK)
            return status;
        if (p[walk->value_size] > 1)
            return vol_fail(walk->err, VOL_BAD_INPUT, "byte %zu: a tile's state is %u", walk->at - 1,
                            p[walk->value_size]);
    }
    for (uint32_t i = 0; i < children; i++) {
        if ((status = take_origin(walk, origin[i % 2], i ? origin[(i + 1) % 2] : NULL)) != VOL_OK ||
            (status = walk_inner(walk, origin[i % 2], UPPER_LOG2, 128)) != VOL_OK)
            return status;
    }
    return VOL_OK;
}

/* bool: value mask, origin, bits.  mask: bits, origin. */
static VolStatus walk_bit_leaf(Walk *walk, const Leaf *leaf)
{
    const unsigned char *p;
    bool is_bool = walk->kind->value == VOL_VALUE_BOOL;
    size_t where = walk->at;
    VolStatus status = take(walk, 12 + (is_bool ? LEAF_MASK_BYTES : 0), "a leaf", &p);
    if (status)
        return status;
    for (int k = 0; k < 3; k++)
        if ((int32_t)load_u32(p + 4 * k) != leaf->origin[k])
            return vol_fail(walk->err, VOL_BAD_INPUT, "byte %zu: a leaf's origin contradicts its place", where);
    return VOL_OK;
}

static VolStatus walk_buffers(Walk *walk)
{
    bool bits = walk->kind->value == VOL_VALUE_BOOL || walk->kind->value == VOL_VALUE_MASK;
    VolStatus status = VOL_OK;
    for (size_t i = 0; i < walk->leaf_count && !status; i++) {
        const unsigned char *mask;
        size_t where = walk->at;
        if ((status = take(walk, LEAF_MASK_BYTES, "a leaf's mask", &mask)) != VOL_OK)
            return status;
        if (memcmp(mask, walk->data + walk->leaves[i].mask, LEAF_MASK_BYTES) != 0)
            return vol_fail(walk->err, VOL_BAD_INPUT, "byte %zu: a leaf's mask differs from the one at byte %zu", where,
                            walk->leaves[i].mask);
        status = bits ? walk_bit_leaf(walk, &walk->leaves[i]) : walk_values(walk, mask, LEAF_VALUES);
    }
    return status;
}

VolStatus vol_vdb_walk_tree(const VolVdb *vdb, const VdbGrid *grid, size_t limit, size_t *buffers, size_t *end,
                            VolError *err)
{
    const VdbTreeKind *kind = vol_vdb_tree_kind(grid->entry.type);
    Walk walk = {.data = vdb->bytes.data, .at = grid->tree, .limit = limit, .compression = grid->compression,
                 .kind = kind, .err = err};
    walk.half = grid->entry.half && kind->real;
    walk.value_size = kind->components * kind->component_size;
    walk.stored_size = walk.half ? kind->components * 2 : walk.value_size;
    VolStatus status = walk_topology(&walk);
    *buffers = walk.at;
    if (!status && kind->value == VOL_VALUE_POINTS)
        walk.at = limit;
    else if (!status)
        status = walk_buffers(&walk);
    *end = walk.at;
    free(walk.leaves);
    return status;
}
