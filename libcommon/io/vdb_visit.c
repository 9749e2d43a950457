/* Visiting the leaves and tiles of a grid: first its masks are counted, then it is walked node by node, then (where the
 * visitor wants them apart) the leaves' values are unpacked over threads, each run of leaves by whoever comes. */
#include "io/vdb_private.h"

#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

#include "base/pool.h"

enum { LEAVES_PER_ITEM = 128 };
enum { STRETCH = 1 << 21 }; /* bytes given back at once, where a large page of the system begins */

typedef struct Visit {
    const VolVdb *vdb;
    const VdbGrid *grid;
    VdbTree tree;
    VolVdbGridInfo *info;
    const VolVdbVisitor *visitor;
    void *user;
    unsigned char background[3 * sizeof(double)]; /* one value, as unpacked */
    bool counting;    /* else visiting */
    size_t next_leaf; /* of the tree's, in the walk's order */
    struct Workspace *workspace; /* one per thread */
    atomic_uint *wanted;         /* on a last visit: how many bytes of each stretch are still to be used */
    VolError *err;
} Visit;

/* For one leaf: its values, what unpacking takes, and them as numbers. */
typedef struct Workspace {
    unsigned char values[VDB_LEAF_VALUES * 3 * sizeof(double)];
    unsigned char scratch[2 * VDB_LEAF_VALUES * 3 * sizeof(double)];
    double numbers[VDB_LEAF_VALUES * 3];
} Workspace;

static VolStatus tree_failed(const Visit *visit, VolStatus status, VolError *err)
{
    return vol_vdb_tree_failed(visit->vdb, visit->grid->entry.name, status, err);
}

/* ---- counting ---- */

static void add_to_box(VolVdbGridInfo *info, const int32_t from[3], const int32_t to[3])
{
    for (int k = 0; k < 3; k++) {
        info->box_min[k] = from[k] < info->box_min[k] ? from[k] : info->box_min[k];
        info->box_max[k] = to[k] > info->box_max[k] ? to[k] : info->box_max[k];
    }
}

/* Word x of a leaf's mask holds the 8 x 8 voxels of that x; bit 8 y + z. */
static void count_leaf(VolVdbGridInfo *info, const int32_t origin[3], const uint64_t active[8])
{
    uint64_t any = 0;
    unsigned columns = 0;
    int32_t x0 = 8, x1 = -1;
    for (int x = 0; x < 8; x++) {
        info->active_voxels += (uint64_t)__builtin_popcountll(active[x]);
        any |= active[x];
        if (active[x]) {
            x0 = x < x0 ? x : x0;
            x1 = x;
        }
    }
    info->leaves++;
    if (!any)
        return;
    for (int y = 0; y < 8; y++)
        columns |= (unsigned)(any >> (8 * y)) & 255u;
    const int32_t from[3] = {origin[0] + x0, origin[1] + __builtin_ctzll(any) / 8, origin[2] + __builtin_ctz(columns)};
    const int32_t to[3] = {origin[0] + x1, origin[1] + (63 - __builtin_clzll(any)) / 8,
                           origin[2] + 31 - __builtin_clz(columns)};
    add_to_box(info, from, to);
}

static void count_tile(VolVdbGridInfo *info, const int32_t origin[3], int32_t size)
{
    const int32_t to[3] = {origin[0] + (size - 1), origin[1] + (size - 1), origin[2] + (size - 1)};
    uint64_t edge = (uint64_t)size;
    info->active_voxels += edge * edge * edge;
    info->active_tiles++;
    add_to_box(info, origin, to);
}

/* ---- leaves and tiles ---- */

static void load_mask(const unsigned char *mask, uint64_t active[8])
{
    for (int x = 0; x < 8; x++)
        active[x] = vol_load_u64(mask + 8 * x);
}

static VolStatus show_leaf(const Visit *visit, const VdbLeaf *leaf, Workspace *space, VolError *err)
{
    const VolVdbVisitor *visitor = visit->visitor;
    const VdbTreeKind *kind = visit->tree.codec.kind;
    uint64_t active[8];
    if (!visitor->leaf_double && !visitor->leaf_float)
        return VOL_OK;
    VolStatus status = vol_vdb_unpack_leaf(&visit->tree, leaf, visit->background, space->values, space->scratch, err);
    if (status)
        return tree_failed(visit, status, err);
    load_mask(vol_vdb_leaf_mask(&visit->tree, leaf), active);
    void *numbers = space->numbers;
    if (visitor->leaf_double)
        vol_vdb_to_doubles(kind, space->values, VDB_LEAF_VALUES, numbers);
    else if (kind->value == VOL_VALUE_FLOAT || kind->value == VOL_VALUE_VEC3S)
        numbers = space->values; /* as they are */
    else
        vol_vdb_to_floats(kind, space->values, VDB_LEAF_VALUES, numbers);
    return visitor->leaf_double ? visitor->leaf_double(visit->user, leaf->origin, numbers, active, err)
                                : visitor->leaf_float(visit->user, leaf->origin, numbers, active, err);
}

static VolStatus meet_leaf(Visit *visit)
{
    const VdbLeaf *leaf = &visit->tree.leaves[visit->next_leaf++];
    if (visit->counting) {
        uint64_t active[8];
        load_mask(visit->tree.data + leaf->mask, active);
        count_leaf(visit->info, leaf->origin, active);
        return VOL_OK;
    }
    if (visit->visitor->place)
        return visit->visitor->place(visit->user, leaf->origin, visit->err);
    return show_leaf(visit, leaf, visit->workspace, visit->err);
}

static VolStatus meet_tile(Visit *visit, const int32_t origin[3], int32_t size, const unsigned char *value, bool active)
{
    const VdbTreeKind *kind = visit->tree.codec.kind;
    double wide[3] = {0};
    if (visit->counting) {
        if (active)
            count_tile(visit->info, origin, size);
        return VOL_OK;
    }
    if (!visit->visitor->tile)
        return VOL_OK;
    vol_vdb_to_doubles(kind, value, 1, wide);
    bool differs = false;
    for (int c = 0; c < 3; c++)
        differs = differs || !(wide[c] == visit->info->background[c]);
    return active || differs ? visit->visitor->tile(visit->user, origin, size, wide, active, visit->err) : VOL_OK;
}

/* ---- nodes ---- */

static bool is_on(const unsigned char *mask, uint32_t n) { return mask[n / 8] >> (n % 8) & 1; }

/* An inner node at byte *at, whose 2^(3 log2) entries are cubes of `child_dim` voxels. */
static VolStatus meet_inner(Visit *visit, size_t *at, const int32_t origin[3], int log2, int32_t child_dim)
{
    uint32_t entries = 1u << (3 * log2), axis_mask = (1u << log2) - 1;
    const VdbTree *tree = &visit->tree;
    const unsigned char *children = tree->data + *at, *active = children + entries / 8;
    size_t size = tree->codec.value_size;
    unsigned char *values = vol_alloc((size_t)entries * 3, size);
    if (!values)
        return vol_fail_memory(visit->err, (size_t)entries * 3 * size);
    *at += entries / 4;
    VolStatus status = vol_vdb_unpack_values(tree, at, active, entries, visit->background, values,
                                             values + (size_t)entries * size, visit->err);
    if (status)
        status = tree_failed(visit, status, visit->err);
    for (uint32_t n = 0; n < entries && !status; n++) {
        int32_t child[3] = {origin[0] + (int32_t)(n >> (2 * log2)) * child_dim,
                            origin[1] + (int32_t)(n >> log2 & axis_mask) * child_dim,
                            origin[2] + (int32_t)(n & axis_mask) * child_dim};
        if (!is_on(children, n)) {
            status = meet_tile(visit, child, child_dim, values + n * size, is_on(active, n));
        } else if (log2 == VDB_UPPER_LOG2) {
            status = meet_inner(visit, at, child, VDB_LOWER_LOG2, 8);
        } else {
            *at += VDB_LEAF_MASK_BYTES;
            status = meet_leaf(visit);
        }
    }
    free(values);
    return status;
}

static void load_origin(const unsigned char *p, int32_t origin[3])
{
    for (int k = 0; k < 3; k++)
        origin[k] = (int32_t)vol_load_u32(p + 4 * k);
}

/* By x, then y, then z. */
static int compare_origins(const int32_t a[3], const int32_t b[3])
{
    int k = 0;
    while (k < 2 && a[k] == b[k])
        k++;
    return (a[k] > b[k]) - (a[k] < b[k]);
}

/* The tables of tiles and of children, each in order, are merged.  Where both have an entry the child counts. */
static VolStatus meet_root(Visit *visit)
{
    const unsigned char *data = visit->tree.data;
    size_t size = visit->tree.codec.value_size, at = visit->tree.begin + 4 + size, tile_bytes = 12 + size + 1;
    uint32_t tiles = vol_load_u32(data + at), children = vol_load_u32(data + at + 4);
    const unsigned char *tile = data + at + 8;
    at += 8 + tiles * tile_bytes;
    VolStatus status = VOL_OK;
    while (!status && (tiles || children)) {
        int32_t tile_origin[3], child_origin[3];
        int order = tiles ? -1 : 1; /* below 0: the tile comes first */
        if (tiles)
            load_origin(tile, tile_origin);
        if (children)
            load_origin(data + at, child_origin);
        if (tiles && children)
            order = compare_origins(tile_origin, child_origin);
        if (order <= 0) {
            if (order < 0)
                status = meet_tile(visit, tile_origin, VDB_ROOT_CHILD_DIM, tile + 12, tile[12 + size] != 0);
            tile += tile_bytes;
            tiles--;
        } else {
            at += 12;
            status = meet_inner(visit, &at, child_origin, VDB_UPPER_LOG2, 128);
            children--;
        }
    }
    return status;
}

/* ---- the visit ---- */

static VolStatus count(Visit *visit)
{
    VolVdbGridInfo *info = visit->info;
    const VdbCodec *codec = &visit->tree.codec;
    memcpy(visit->background, visit->tree.data + visit->tree.begin + 4, codec->value_size);
    vol_vdb_to_doubles(codec->kind, visit->background, 1, info->background);
    for (int k = 0; k < 3; k++) {
        info->box_min[k] = INT32_MAX;
        info->box_max[k] = INT32_MIN;
    }
    visit->counting = true;
    VolStatus status = meet_root(visit);
    visit->counting = false;
    visit->next_leaf = 0;
    info->empty = info->active_voxels == 0;
    for (int k = 0; k < 3 && info->empty; k++) {
        info->box_min[k] = 0;
        info->box_max[k] = -1;
    }
    return status;
}

/* ---- memory given back ---- */

/* The file's first stretch begins before it, as large pages have it. */
static size_t bytes_before(const Visit *visit) { return (uintptr_t)visit->vdb->bytes.data % STRETCH; }

/* All that lies in the file. */
static VolStatus count_wanted(Visit *visit)
{
    size_t before = bytes_before(visit), end = before + visit->vdb->bytes.size, stretches = (end + STRETCH - 1) / STRETCH;
    visit->wanted = vol_alloc(stretches, sizeof *visit->wanted);
    if (!visit->wanted)
        return vol_fail_memory(visit->err, stretches * sizeof *visit->wanted);
    for (size_t n = 0; n < stretches; n++)
        atomic_init(&visit->wanted[n], STRETCH);
    atomic_fetch_sub(&visit->wanted[0], (unsigned)before);
    atomic_fetch_sub(&visit->wanted[stretches - 1], (unsigned)(stretches * STRETCH - end));
    return VOL_OK;
}

/* On a last visit what has been used takes no more memory, once a stretch of it is complete: a part of a large page costs
 * much to give back, and brings nothing before the rest. */
static void give_back(const Visit *visit, size_t begin, size_t end)
{
    const VolBytes *file = &visit->vdb->bytes;
    if (!visit->wanted)
        return;
    size_t before = bytes_before(visit), at = before + begin;
    while (at < before + end) {
        size_t n = at / STRETCH, next = (n + 1) * STRETCH, stop = next < before + end ? next : before + end;
        unsigned used = (unsigned)(stop - at);
        if (atomic_fetch_sub(&visit->wanted[n], used) == used)
            vol_bytes_forget(file, n ? n * STRETCH - before : 0, next - before < file->size ? next - before : file->size);
        at = stop;
    }
}

/* Where the n-th leaf begins in the buffers; of the one behind the last: where they end. */
static size_t leaf_begin(const VdbTree *tree, size_t n)
{
    return n < tree->leaf_count ? tree->leaves[n].values - VDB_LEAF_MASK_BYTES : tree->end;
}

static VolStatus show_leaves(void *user, size_t index, int thread, VolError *err)
{
    const Visit *visit = user;
    const VdbTree *tree = &visit->tree;
    size_t first = index * LEAVES_PER_ITEM, end = first + LEAVES_PER_ITEM;
    end = end < tree->leaf_count ? end : tree->leaf_count;
    VolStatus status = VOL_OK;
    for (size_t i = first; i < end && !status; i++)
        status = show_leaf(visit, &tree->leaves[i], &visit->workspace[thread], err);
    give_back(visit, leaf_begin(tree, first), leaf_begin(tree, end));
    return status;
}

static VolStatus run(Visit *visit)
{
    int threads = visit->visitor->threads > 1 && visit->visitor->place ? visit->visitor->threads : 1;
    VolStatus status = count(visit);
    if (!status && visit->visitor->begin)
        status = visit->visitor->begin(visit->user, visit->info, visit->err);
    if (status)
        return status;
    visit->workspace = vol_alloc((size_t)threads, sizeof *visit->workspace);
    if (!visit->workspace)
        return vol_fail_memory(visit->err, (size_t)threads * sizeof *visit->workspace);
    if (visit->visitor->last)
        status = count_wanted(visit);
    give_back(visit, 0, visit->tree.begin); /* other grids */
    give_back(visit, visit->tree.end, visit->vdb->bytes.size);
    if (!status)
        status = meet_root(visit);
    if (visit->visitor->place)
        give_back(visit, visit->tree.begin, visit->tree.buffers);
    if (!status && visit->visitor->place)
        status = vol_parallel(threads, (visit->tree.leaf_count + LEAVES_PER_ITEM - 1) / LEAVES_PER_ITEM, show_leaves,
                              visit, visit->err);
    free(visit->wanted);
    free(visit->workspace);
    return status;
}

static bool is_level_set(const VolVdbEntry *entry)
{
    const VolVdbMeta *meta = vol_meta_find(&entry->meta, "class");
    return meta && strcmp(meta->type, "string") == 0 && meta->size == 9 && memcmp(meta->bytes, "level set", 9) == 0;
}

static VolStatus can_visit(const VolVdb *vdb, const VdbGrid *grid, VolError *err)
{
    const VolVdbEntry *entry = &grid->entry;
    if (!vol_vdb_is_numeric(entry->type))
        return vol_fail(err, VOL_BAD_INPUT, "cannot read grid '%s' of '%s': its type %s is not one of numbers",
                        entry->name, vdb->name, entry->type);
    const VdbGrid *parent = &vdb->grids[grid->parent];
    if (!parent->tree)
        return vol_fail(err, VOL_BAD_INPUT, "cannot read grid '%s' of '%s': its transform '%s' is of an unknown kind",
                        entry->name, vdb->name, parent->entry.map);
    return VOL_OK;
}

VolStatus vol_vdb_visit(const VolVdb *vdb, size_t index, const VolVdbVisitor *visitor, void *user, VolError *err)
{
    const VdbGrid *grid = &vdb->grids[index];
    VolVdbGridInfo info = {.value = vol_vdb_value(&grid->entry), .index_to_world = grid->entry.index_to_world,
                           .level_set = is_level_set(&grid->entry)};
    Visit visit = {.vdb = vdb, .grid = grid, .info = &info, .visitor = visitor, .user = user, .err = err};
    VolStatus status = can_visit(vdb, grid, err);
    if (!status)
        status = vol_vdb_checked_tree(vdb, index, &visit.tree, err);
    for (size_t i = 0; i < vdb->count && !status && visitor->last; i++)
        vdb->grids[i].gone = true;
    if (!status)
        status = run(&visit);
    vol_vdb_tree_free(&visit.tree);
    return status;
}
