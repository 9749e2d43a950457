/* A walk over the bytes of a tree, before any value is unpacked.
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

enum { BLOSC_OVERHEAD = 16 };

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

typedef struct Walk {
    VdbTree *tree;
    size_t at, limit;
    size_t leaf_capacity;
    VolError *err;
} Walk;

static VolStatus cut(Walk *walk, const char *what)
{
    return vol_fail(walk->err, VOL_BAD_INPUT, "byte %zu: %s runs past the end at byte %zu", walk->at, what,
                    walk->limit);
}

static VolStatus take(Walk *walk, uint64_t size, const char *what, const unsigned char **out)
{
    *out = walk->tree->data + walk->at;
    if (size > walk->limit - walk->at)
        return cut(walk, what);
    walk->at += (size_t)size;
    return VOL_OK;
}

uint32_t vol_vdb_count_bits(const unsigned char *mask, size_t bytes)
{
    uint32_t count = 0;
    for (size_t i = 0; i < bytes; i += 8)
        count += (uint32_t)__builtin_popcountll(vol_load_u64(mask + i));
    return count;
}

uint32_t vol_vdb_block_count(const VdbCodec *codec, unsigned form, const unsigned char *mask, uint32_t capacity)
{
    bool active_only = (codec->compression & VDB_COMPRESS_ACTIVE_MASK) && form != VDB_ALL_VALUES;
    return active_only ? vol_vdb_count_bits(mask, capacity / 8) : capacity;
}

static VolStatus walk_block(Walk *walk, uint64_t count)
{
    const unsigned char *p;
    const VdbCodec *codec = &walk->tree->codec;
    uint64_t bytes = count * codec->stored_size;
    if (codec->half && count == 0)
        return VOL_OK;
    if (!(codec->compression & (VDB_COMPRESS_ZIP | VDB_COMPRESS_BLOSC)))
        return take(walk, bytes, "a block of values", &p);

    size_t where = walk->at;
    VolStatus status = take(walk, 8, "the length of a block", &p);
    if (status)
        return status;
    int64_t length = (int64_t)vol_load_u64(p);
    if (length <= 0 ? length != -(int64_t)bytes : (uint64_t)length > bytes + BLOSC_OVERHEAD)
        return vol_fail(walk->err, VOL_BAD_INPUT, "byte %zu: a block of %lld bytes where %llu uncompressed are expected",
                        where, (long long)length, (unsigned long long)bytes);
    uint64_t stored = length <= 0 ? bytes : (uint64_t)length;
    if ((status = take(walk, stored, "a block of values", &p)) != VOL_OK)
        return status;
    /* Blosc repeats both lengths in a header of its own, and trusts it. */
    if (length > 0 && (codec->compression & VDB_COMPRESS_BLOSC) &&
        (stored < BLOSC_OVERHEAD || vol_load_u32(p + 4) != bytes || vol_load_u32(p + 12) != stored))
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
    if (form > VDB_ALL_VALUES)
        return vol_fail(walk->err, VOL_BAD_INPUT, "byte %zu: unknown form %u of a node's values", where, form);
    size_t extra = 0, value_size = walk->tree->codec.value_size;
    if (form == VDB_ONE_INACTIVE_VALUE || form == VDB_MASK_ONE_VALUE)
        extra = value_size;
    else if (form == VDB_MASK_TWO_VALUES)
        extra = 2 * value_size;
    if (form == VDB_MASK_NO_VALUE || form == VDB_MASK_ONE_VALUE || form == VDB_MASK_TWO_VALUES)
        extra += capacity / 8;
    if ((status = take(walk, extra, "a node", &p)) != VOL_OK)
        return status;
    return walk_block(walk, vol_vdb_block_count(&walk->tree->codec, form, mask, capacity));
}

static VolStatus add_leaf(Walk *walk, const int32_t origin[3])
{
    VdbTree *tree = walk->tree;
    if (tree->leaf_count == walk->leaf_capacity) {
        size_t capacity = walk->leaf_capacity ? 2 * walk->leaf_capacity : 256;
        VdbLeaf *grown = vol_resize(tree->leaves, capacity, sizeof *grown);
        if (!grown)
            return vol_fail_memory(walk->err, capacity * sizeof *grown);
        tree->leaves = grown;
        walk->leaf_capacity = capacity;
    }
    tree->leaves[tree->leaf_count++] = (VdbLeaf){walk->at, 0, {origin[0], origin[1], origin[2]}};
    const unsigned char *p;
    return take(walk, VDB_LEAF_MASK_BYTES, "a leaf's mask", &p);
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
        status = log2 == VDB_UPPER_LOG2 ? walk_inner(walk, child, VDB_LOWER_LOG2, 8) : add_leaf(walk, child);
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
        origin[k] = (int32_t)vol_load_u32(p + 4 * k);
        if (origin[k] % VDB_ROOT_CHILD_DIM != 0)
            return vol_fail(walk->err, VOL_BAD_INPUT, "byte %zu: node origin %d is not a multiple of %d", where,
                            origin[k], VDB_ROOT_CHILD_DIM);
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
    size_t where = walk->at, value_size = walk->tree->codec.value_size;
    VolStatus status = take(walk, 4 + value_size + 8, "the root of the tree", &p);
    if (status)
        return status;
    if (vol_load_u32(p) != 1)
        return vol_fail(walk->err, VOL_BAD_INPUT, "byte %zu: %u buffers per tree", where, vol_load_u32(p));
    uint32_t tiles = vol_load_u32(p + 4 + value_size), children = vol_load_u32(p + 8 + value_size);
    int32_t origin[2][3] = {{0}};
    for (uint32_t i = 0; i < tiles; i++) {
        if ((status = take_origin(walk, origin[i % 2], i ? origin[(i + 1) % 2] : NULL)) != VOL_OK ||
            (status = take(walk, value_size + 1, "a tile", &p)) != VOL_OK)
            return status;
        if (p[value_size] > 1)
            return vol_fail(walk->err, VOL_BAD_INPUT, "byte %zu: a tile's state is %u", walk->at - 1,
                            p[value_size]);
    }
    for (uint32_t i = 0; i < children; i++) {
        if ((status = take_origin(walk, origin[i % 2], i ? origin[(i + 1) % 2] : NULL)) != VOL_OK ||
            (status = walk_inner(walk, origin[i % 2], VDB_UPPER_LOG2, 128)) != VOL_OK)
            return status;
    }
    return VOL_OK;
}

/* bool: value mask, origin, bits.  mask: bits, origin. */
static VolStatus walk_bit_leaf(Walk *walk, const VdbLeaf *leaf)
{
    const unsigned char *p;
    bool is_bool = walk->tree->codec.kind->value == VOL_VALUE_BOOL;
    size_t where = walk->at;
    VolStatus status = take(walk, 12 + (is_bool ? VDB_LEAF_MASK_BYTES : 0), "a leaf", &p);
    if (status)
        return status;
    for (int k = 0; k < 3; k++)
        if ((int32_t)vol_load_u32(p + 4 * k) != leaf->origin[k])
            return vol_fail(walk->err, VOL_BAD_INPUT, "byte %zu: a leaf's origin contradicts its place", where);
    return VOL_OK;
}

static VolStatus walk_buffers(Walk *walk)
{
    const VdbTree *tree = walk->tree;
    bool bits = tree->codec.kind->value == VOL_VALUE_BOOL || tree->codec.kind->value == VOL_VALUE_MASK;
    VolStatus status = VOL_OK;
    for (size_t i = 0; i < tree->leaf_count && !status; i++) {
        VdbLeaf *leaf = &tree->leaves[i];
        const unsigned char *mask;
        size_t where = walk->at;
        if ((status = take(walk, VDB_LEAF_MASK_BYTES, "a leaf's mask", &mask)) != VOL_OK)
            return status;
        if (memcmp(mask, tree->data + leaf->mask, VDB_LEAF_MASK_BYTES) != 0)
            return vol_fail(walk->err, VOL_BAD_INPUT, "byte %zu: a leaf's mask differs from the one at byte %zu", where,
                            leaf->mask);
        leaf->values = walk->at;
        status = bits ? walk_bit_leaf(walk, leaf) : walk_values(walk, mask, VDB_LEAF_VALUES);
    }
    return status;
}

static VdbCodec codec_of(const VdbGrid *grid)
{
    const VdbTreeKind *kind = vol_vdb_tree_kind(grid->entry.type);
    VdbCodec codec = {.kind = kind, .compression = grid->compression, .half = grid->entry.half && kind->real};
    codec.value_size = kind->components * kind->component_size;
    codec.stored_size = codec.half ? kind->components * 2 : codec.value_size;
    return codec;
}

VolStatus vol_vdb_walk_tree(const VolVdb *vdb, const VdbGrid *grid, size_t limit, VdbTree *out, VolError *err)
{
    *out = (VdbTree){.data = vdb->bytes.data, .begin = grid->tree, .codec = codec_of(grid)};
    Walk walk = {.tree = out, .at = grid->tree, .limit = limit, .err = err};
    VolStatus status = walk_topology(&walk);
    out->buffers = walk.at;
    if (!status && out->codec.kind->value == VOL_VALUE_POINTS)
        walk.at = limit;
    else if (!status)
        status = walk_buffers(&walk);
    out->end = walk.at;
    if (status)
        vol_vdb_tree_free(out);
    return status;
}

void vol_vdb_tree_free(VdbTree *tree)
{
    free(tree->leaves);
    tree->leaves = NULL;
    tree->leaf_count = 0;
}
