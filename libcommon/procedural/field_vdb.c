#include "procedural/field_vdb.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "base/pool.h"

enum { LEAF = 8, LEAF_VOXELS = LEAF * LEAF * LEAF };

/* One layer of leaves: all of equal x. */
typedef struct Layer {
    const VolFieldCase *field;
    const VolFieldBox *box;
    int32_t x;          /* of the leaves' origins */
    size_t leaves_z;
    double *values;     /* LEAF_VOXELS per leaf */
    uint64_t (*active)[LEAF];
    bool *kept;
    uint64_t *non_finite;
} Layer;

VolAffine vol_field_extent(const int32_t dims[3], VolVec3 lo, VolVec3 hi)
{
    const double a[3] = {lo.x, lo.y, lo.z}, b[3] = {hi.x, hi.y, hi.z};
    VolAffine out = {0};
    for (int i = 0; i < 3; i++) {
        out.m[i][i] = dims[i] > 1 ? (b[i] - a[i]) / (dims[i] - 1) : b[i] - a[i];
        out.m[3][i] = dims[i] > 1 ? a[i] : a[i] + 0.5 * (b[i] - a[i]);
    }
    return out;
}

static VolStatus fill_leaf(void *user, size_t index, int thread, VolError *err)
{
    (void)thread, (void)err;
    Layer *layer = user;
    const VolFieldBox *box = layer->box;
    int32_t origin[3] = {layer->x, (int32_t)(index / layer->leaves_z) * LEAF,
                         (int32_t)(index % layer->leaves_z) * LEAF};
    double *values = layer->values + index * LEAF_VOXELS;
    uint64_t *active = layer->active[index];
    bool kept = !box->sparse;

    memset(active, 0, sizeof *layer->active);
    layer->non_finite[index] = 0;
    for (int n = 0; n < LEAF_VOXELS; n++) {
        int32_t i = origin[0] + n / (LEAF * LEAF), j = origin[1] + n / LEAF % LEAF, k = origin[2] + n % LEAF;
        values[n] = 0;
        if (i >= box->dims[0] || j >= box->dims[1] || k >= box->dims[2])
            continue;
        values[n] = vol_field_value(layer->field, vol_apply(&box->index_to_world, vol_vec3(i, j, k)));
        active[n / 64] |= UINT64_C(1) << n % 64;
        layer->non_finite[index] += isfinite(values[n]) ? 0 : 1;
        kept = kept || !(fabs(values[n]) <= box->threshold);
    }
    layer->kept[index] = kept;
    return VOL_OK;
}

static double largest_of(const double *values)
{
    double largest = 0;
    for (int n = 0; n < LEAF_VOXELS; n++)
        if (isfinite(values[n]))
            largest = fmax(largest, fabs(values[n]));
    return largest;
}

static VolStatus put_leaf(const Layer *layer, size_t index, VolVdbWriter *writer, VolError *err)
{
    int32_t origin[3] = {layer->x, (int32_t)(index / layer->leaves_z) * LEAF,
                         (int32_t)(index % layer->leaves_z) * LEAF};
    const double *values = layer->values + index * LEAF_VOXELS;
    if (layer->box->store == VOL_STORE_DOUBLE)
        return vol_vdb_put_leaf_double(writer, origin, values, layer->active[index], err);
    float single[LEAF_VOXELS];
    for (int n = 0; n < LEAF_VOXELS; n++)
        single[n] = (float)values[n];
    return vol_vdb_put_leaf(writer, origin, single, layer->active[index], err);
}

static VolStatus begin_grid(const VolFieldBox *box, VolVdbWriter *writer, VolError *err)
{
    VolVdbNewGrid grid = {.name = box->grid, .store = box->store, .index_to_world = box->index_to_world};
    VolStatus status = vol_meta_copy(&grid.meta, &box->meta, err);
    if (!status && !box->sparse) {
        int32_t first[3] = {0, 0, 0}, last[3] = {box->dims[0] - 1, box->dims[1] - 1, box->dims[2] - 1};
        status = vol_meta_set_text(&grid.meta, "vol:domain", "box", err);
        if (!status)
            status = vol_meta_set_vec3i(&grid.meta, "vol:domainMin", first, err);
        if (!status)
            status = vol_meta_set_vec3i(&grid.meta, "vol:domainMax", last, err);
    }
    if (!status)
        status = vol_vdb_begin_grid(writer, &grid, err);
    vol_meta_free(&grid.meta);
    return status;
}

enum { LEAVES_PER_CHECK = 1 << 15, LEAST_ENCODED = 150 }; /* bytes of a leaf in a file: its mask, twice, and a block */

static VolStatus cannot_hold(const VolFieldBox *box, VolStatus status, VolError *err)
{
    return status ? vol_fail_within(err, status, "cannot hold %dx%dx%d voxels", box->dims[0], box->dims[1], box->dims[2])
                  : VOL_OK;
}

/* The tree's memory for so many leaves: values, masks, and the nodes above. */
static double leaf_bytes(const VolFieldBox *box, double leaves)
{
    return leaves * (LEAF_VOXELS * (box->store == VOL_STORE_DOUBLE ? 8.0 : 4.0) + 160);
}

static VolStatus write_layers(Layer *layer, size_t leaves, int threads, VolVdbWriter *writer,
                              VolFieldCounts *counts, VolError *err)
{
    const VolFieldBox *box = layer->box;
    VolStatus status = VOL_OK;
    for (layer->x = 0; !status && layer->x < box->dims[0]; layer->x += LEAF) {
        status = vol_parallel(threads, leaves, fill_leaf, layer, err);
        for (size_t i = 0; !status && i < leaves; i++) {
            counts->leaves += layer->kept[i];
            counts->skipped_leaves += !layer->kept[i];
            counts->non_finite += layer->kept[i] ? layer->non_finite[i] : 0;
            if (layer->kept[i] && box->store == VOL_STORE_HALF)
                counts->largest = fmax(counts->largest, largest_of(layer->values + i * LEAF_VOXELS));
            if (layer->kept[i] && counts->leaves % LEAVES_PER_CHECK == 0)
                status = cannot_hold(box, vol_check_memory(leaf_bytes(box, LEAVES_PER_CHECK), err), err);
            if (layer->kept[i] && !status)
                status = put_leaf(layer, i, writer, err);
        }
        if (!status && box->progress)
            box->progress(box->progress_user, fmin(1, (layer->x + LEAF) / (double)box->dims[0]));
    }
    return status;
}

/* What is needed for certain, before any of it is taken; of a sparse grid, whose leaves nobody knows yet, one layer's.  The
 * tree's libraries are there by now: they count where the address space is limited. */
static VolStatus foresee(const VolFieldBox *box, double leaves_per_layer, VolError *err)
{
    double layers = ceil(box->dims[0] / (double)LEAF), bytes = leaves_per_layer * LEAF_VOXELS * sizeof(double);
    if (!box->sparse)
        bytes += leaf_bytes(box, leaves_per_layer * layers) + 2 * LEAST_ENCODED * leaves_per_layer * layers;
    return bytes > VOL_WORTH_A_CHECK ? cannot_hold(box, vol_check_memory(bytes, err), err) : VOL_OK;
}

VolStatus vol_field_write(const VolFieldCase *field, const VolFieldBox *box, int threads, VolVdbWriter *writer,
                          VolFieldCounts *counts, VolError *err)
{
    size_t leaves_y = ((size_t)box->dims[1] + LEAF - 1) / LEAF,
           leaves_z = ((size_t)box->dims[2] + LEAF - 1) / LEAF;
    size_t leaves = leaves_y * leaves_z;
    Layer layer = {.field = field, .box = box, .leaves_z = leaves_z};
    VolStatus status = begin_grid(box, writer, err);
    if (!status)
        status = foresee(box, (double)leaves, err);
    if (status)
        return status;
    layer.values = vol_alloc(leaves, LEAF_VOXELS * sizeof *layer.values);
    layer.active = vol_alloc(leaves, sizeof *layer.active);
    layer.kept = vol_alloc(leaves, sizeof *layer.kept);
    layer.non_finite = vol_alloc(leaves, sizeof *layer.non_finite);

    *counts = (VolFieldCounts){0};
    if (!layer.values || !layer.active || !layer.kept || !layer.non_finite)
        status = vol_fail_memory(err, leaves * LEAF_VOXELS * sizeof(double));
    if (!status)
        status = write_layers(&layer, leaves, threads, writer, counts, err);
    if (!status)
        status = vol_vdb_end_grid(writer, err);
    free(layer.values);
    free(layer.active);
    free(layer.kept);
    free(layer.non_finite);
    return status;
}
