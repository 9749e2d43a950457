/* One array of a .vti, put together from the pieces. */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "import/vti.h"

/* A lattice of points or cells: the first along each axis, and how many. */
typedef struct Box {
    int64_t first[3], size[3];
} Box;

typedef struct Choice {
    const char *name;
    bool cells;
    const VtiArray *sample; /* the first of the pieces' arrays: all others are to
                               be like it */
    VolSample type;
    int64_t step;
} Choice;

typedef struct Work {
    const Vti *vti;
    Choice choice;
    Box whole;
    size_t voxel;           /* bytes, of all components */
    unsigned char *covered; /* a byte for each voxel */
    unsigned char *out;     /* NULL: only the coverage is found out */
    VolError *err;
} Work;

/* Points of an extent, or cells: on an axis on which the whole image has but one point, one cell.  False: empty.
 * */
static bool box_of(const Vti *vti, const int64_t extent[6], bool cells, Box *out)
{
    for (int a = 0; a < 3; a++) {
        int64_t lo = extent[2 * a], hi = extent[2 * a + 1];
        bool between = cells && vti->whole.extent[2 * a] < vti->whole.extent[2 * a + 1];
        out->first[a] = lo;
        out->size[a] = hi - lo + (between ? 0 : 1);
        if (hi < lo || out->size[a] < 1)
            return false;
    }
    return true;
}

static bool intersect(const Box *a, const Box *b, Box *out)
{
    for (int n = 0; n < 3; n++) {
        int64_t end_a = a->first[n] + a->size[n], end_b = b->first[n] + b->size[n];
        out->first[n] = a->first[n] > b->first[n] ? a->first[n] : b->first[n];
        out->size[n] = (end_a < end_b ? end_a : end_b) - out->first[n];
        if (out->size[n] < 1)
            return false;
    }
    return true;
}

/* False where the number does not fit. */
static bool count_of(const Box *box, int64_t each, uint64_t *count)
{
    *count = (uint64_t)each;
    return each >= 0 && !__builtin_mul_overflow(*count, (uint64_t)box->size[0], count) &&
           !__builtin_mul_overflow(*count, (uint64_t)box->size[1], count) &&
           !__builtin_mul_overflow(*count, (uint64_t)box->size[2], count) && *count <= INT64_MAX / 64;
}

/* Whether a piece has points of the whole image. */
static bool piece_counts(const Vti *vti, size_t piece)
{
    Box whole, box, common;
    return box_of(vti, vti->whole.extent, false, &whole) && box_of(vti, vti->pieces[piece].extent, false, &box) &&
           intersect(&whole, &box, &common);
}

/* ---- Which array ---- */

static bool same_array(const VtiArray *a, const VtiArray *b)
{
    return a->cells == b->cells && strcmp(a->name, b->name) == 0;
}

static bool is_number(const VtiArray *array) { return strcmp(array->type, "String") != 0; }

/* Whether an array before this one in the file, of the pieces that count, has its name: of another piece or time.
 * */
static bool seen_before(const Vti *vti, size_t index)
{
    for (size_t i = 0; i < index; i++)
        if (same_array(&vti->arrays[i], &vti->arrays[index]) && is_number(&vti->arrays[i]) &&
            vti->arrays[i].piece < vti->piece_count && piece_counts(vti, vti->arrays[i].piece))
            return true;
    return false;
}

static const VtiArray *find_named(const Vti *vti, const char *name, bool cells)
{
    for (size_t i = 0; name && i < vti->array_count; i++) {
        const VtiArray *array = &vti->arrays[i];
        if (array->cells == cells && strcmp(array->name, name) == 0 && is_number(array) &&
            array->piece < vti->piece_count && piece_counts(vti, array->piece))
            return array;
    }
    return NULL;
}

static const VtiArray *find_active(const Vti *vti, bool cells)
{
    for (size_t i = 0; i < vti->piece_count; i++)
        if (vti->pieces[i].scalars[cells] && piece_counts(vti, i))
            return find_named(vti, vti->pieces[i].scalars[cells], cells);
    return NULL;
}

/* The named array, of points first; without a name the active scalars, else the only array there is. `list`
 * becomes what there is. */
static const VtiArray *choose(const Vti *vti, const char *name, char *list, size_t list_size)
{
    for (int cells = 0; cells < 2; cells++) {
        const VtiArray *array = name ? find_named(vti, name, cells) : find_active(vti, cells);
        if (array)
            return array;
    }
    const VtiArray *only = NULL;
    size_t count = 0, length = 0;
    snprintf(list, list_size, "none");
    for (int cells = 0; cells < 2; cells++)
        for (size_t i = 0; i < vti->array_count && count < 100; i++) {
            const VtiArray *array = &vti->arrays[i];
            if (array->cells != cells || !is_number(array) || array->piece >= vti->piece_count ||
                !piece_counts(vti, array->piece) || seen_before(vti, i))
                continue;
            only = array;
            if (length < list_size) {
                int n = snprintf(list + length, list_size - length, "%s%s (%" PRId64 ", %s)", count ? ", " : "",
                                 array->name[0] ? array->name : "(unnamed)", array->components,
                                 cells ? "cells" : "points");
                length += n > 0 ? (size_t)n : 0;
            }
            count++;
        }
    return !name && count == 1 ? only : NULL;
}

static VolStatus choose_array(const Vti *vti, const VolImportOptions *options, Choice *out, VolError *err)
{
    static const char *const spellings[VOL_SAMPLE_F64 + 1] = {
        [VOL_SAMPLE_U8] = "UInt8",   [VOL_SAMPLE_I8] = "Int8",    [VOL_SAMPLE_U16] = "UInt16",
        [VOL_SAMPLE_I16] = "Int16",  [VOL_SAMPLE_U32] = "UInt32", [VOL_SAMPLE_I32] = "Int32",
        [VOL_SAMPLE_U64] = "UInt64", [VOL_SAMPLE_I64] = "Int64",  [VOL_SAMPLE_F32] = "Float32",
        [VOL_SAMPLE_F64] = "Float64"};
    char list[600];
    const VtiArray *array = choose(vti, options->array, list, sizeof list);
    if (!array && options->array)
        return vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': there is no array '%s': there are %s", vti->file,
                        options->array, list);
    if (!array)
        return vol_fail(err, VOL_BAD_INPUT,
                        "cannot import '%s': no scalars are active, and one array "
                        "is to be chosen by --array: there are %s",
                        vti->file, list);
    int64_t times = vti->times ? vti->times : 1;
    /* A step too far is refused later, with how many there are. */
    *out = (Choice){.name = array->name,
                    .cells = array->cells,
                    .sample = array,
                    .step = options->time_step < times ? options->time_step : 0};
    out->type = VOL_SAMPLE_U8; /* what bits become */
    if (!array->type[0] || (!vol_vti_bits(array) && !vol_sample_spelt(array->type, spellings, &out->type)))
        return vol_fail(err, VOL_BAD_INPUT,
                        "cannot import '%s': values of type '%.40s' are not read "
                        "(array '%.80s')",
                        vti->file, array->type, array->name);
    if (array->components < 1)
        return vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': array '%.80s' has %" PRId64 " components",
                        vti->file, array->name, array->components);
    return VOL_OK;
}

/* Whether the array's list of time steps names the step. */
static bool lists_step(const VtiArray *array, int64_t step)
{
    int64_t one;
    for (const char *at = array->steps; vol_vti_integers(at, &one, 1) == 1;) {
        if (one == step)
            return true;
        char *end;
        (void)strtoll(at, &end, 10);
        at = end;
    }
    return false;
}

/* The chosen array of a piece at the time step: the one that lists it, else one that lists none. */
static const VtiArray *array_of(const Vti *vti, size_t piece, const Choice *choice)
{
    const VtiArray *always = NULL;
    size_t end = piece + 1 < vti->piece_count ? vti->pieces[piece + 1].first_array : vti->array_count;
    for (size_t i = vti->pieces[piece].first_array; i < end; i++) {
        const VtiArray *array = &vti->arrays[i];
        if (array->piece != piece || !same_array(array, choice->sample) || !is_number(array))
            continue;
        if (vti->times && array->steps && lists_step(array, choice->step))
            return array;
        if ((!vti->times || !array->steps || !array->steps[0]) && !always)
            always = array;
    }
    return always;
}

/* ---- Its pieces ---- */

static VolStatus check_alike(const Work *work, const VtiArray *array)
{
    const VtiArray *sample = work->choice.sample;
    char name[300];
    if (strcmp(array->type, sample->type) == 0 && array->components == sample->components)
        return VOL_OK;
    return vol_fail(work->err, VOL_BAD_INPUT,
                    "cannot import '%s': %s has %" PRId64 " components of type %.40s, in piece %zu %" PRId64
                    " of %.40s",
                    work->vti->file, vol_vti_array_name(work->vti, array, name, sizeof name), array->components,
                    array->type, sample->piece + 1, sample->components, sample->type);
}

/* Every piece that has the array is checked, needed or not; *sum is how many voxels they have together. */
static VolStatus check_pieces(const Work *work, uint64_t *sum)
{
    *sum = 0;
    for (size_t i = 0; i < work->vti->piece_count; i++) {
        Box box, common;
        const VtiArray *array = array_of(work->vti, i, &work->choice);
        uint64_t values = 0, voxels = 0;
        if (!array || !box_of(work->vti, work->vti->pieces[i].extent, work->choice.cells, &box) ||
            !intersect(&box, &work->whole, &common))
            continue;
        VolStatus status = check_alike(work, array);
        if (!status && (!count_of(&box, array->components, &values) || !count_of(&common, 1, &voxels)))
            status = vol_fail(work->err, VOL_BAD_INPUT, "cannot import '%s': the extent of piece %zu is too large",
                              work->vti->file, i + 1);
        if (!status)
            status = vol_vti_find(work->vti, array, work->choice.type, values, work->err);
        if (status)
            return status;
        *sum += voxels;
    }
    return VOL_OK;
}

static size_t at_whole(const Work *work, int64_t x, int64_t y, int64_t z)
{
    const Box *w = &work->whole;
    return (size_t)(((z - w->first[2]) * w->size[1] + y - w->first[1]) * w->size[0] + x - w->first[0]);
}

/* Covers what is not covered yet and, where samples are given, copies them there; false: there was nothing to
 * cover. */
static bool cover(const Work *work, const Box *box, const Box *common, const unsigned char *samples)
{
    bool any = false;
    for (int64_t z = common->first[2]; z < common->first[2] + common->size[2]; z++)
        for (int64_t y = common->first[1]; y < common->first[1] + common->size[1]; y++) {
            size_t to = at_whole(work, common->first[0], y, z);
            size_t from = (size_t)(((z - box->first[2]) * box->size[1] + y - box->first[1]) * box->size[0] +
                                   common->first[0] - box->first[0]);
            for (int64_t x = 0; x < common->size[0]; x++, to++, from++) {
                if (work->covered[to])
                    continue;
                any = true;
                if (!work->out || samples)
                    work->covered[to] = 1;
                if (samples)
                    memcpy(work->out + to * work->voxel, samples + from * work->voxel, work->voxel);
            }
        }
    return any;
}

static VolStatus get_piece(const Work *work, const VtiArray *array, const Box *box, const Box *common)
{
    size_t voxels = (size_t)(box->size[0] * box->size[1] * box->size[2]);
    size_t values = voxels * (size_t)array->components;
    if (memcmp(box, &work->whole, sizeof *box) == 0 && !memchr(work->covered, 1, voxels)) {
        memset(work->covered, 1, voxels);
        return vol_vti_get(work->vti, array, work->choice.type, values, work->out, work->err);
    }
    unsigned char *samples = vol_alloc(voxels, work->voxel);
    if (!samples)
        return vol_fail_memory(work->err, voxels * work->voxel);
    VolStatus status = vol_vti_get(work->vti, array, work->choice.type, values, samples, work->err);
    if (!status)
        cover(work, box, common, samples);
    free(samples);
    return status;
}

/* The last piece holds where several overlap, as with VTK; so they are taken from the last to the first, and one
 * that adds nothing is not unpacked. */
static VolStatus go_through_pieces(const Work *work)
{
    VolStatus status = VOL_OK;
    for (size_t i = work->vti->piece_count; !status && i-- > 0;) {
        Box box, common;
        const VtiArray *array = array_of(work->vti, i, &work->choice);
        if (!array || !box_of(work->vti, work->vti->pieces[i].extent, work->choice.cells, &box) ||
            !intersect(&box, &work->whole, &common))
            continue;
        bool needed = cover(work, &box, &common, NULL);
        if (needed && work->out)
            status = get_piece(work, array, &box, &common);
    }
    return status;
}

/* The first place that no piece with the array covers; where a piece without the array lies there, it is named. */
static VolStatus fail_hole(const Work *work, size_t hole)
{
    const Vti *vti = work->vti;
    const int64_t *e = vti->whole.extent;
    int64_t nx = work->whole.size[0], ny = work->whole.size[1], at = (int64_t)hole;
    const Box place = {{e[0] + at % nx, e[2] + at / nx % ny, e[4] + at / nx / ny}, {1, 1, 1}};
    char what[200] = "no piece covers it", step[60] = "";
    for (size_t i = 0; i < vti->piece_count; i++) {
        Box box, common;
        const int64_t *p = vti->pieces[i].extent;
        if (!box_of(vti, p, work->choice.cells, &box) || !intersect(&box, &place, &common))
            continue;
        snprintf(what, sizeof what,
                 "piece %zu (extent %" PRId64 " %" PRId64 " %" PRId64 " %" PRId64 " %" PRId64 " %" PRId64
                 ") is without the array",
                 i + 1, p[0], p[1], p[2], p[3], p[4], p[5]);
    }
    if (vti->times)
        snprintf(step, sizeof step, " at time step %" PRId64, work->choice.step);
    return vol_fail(work->err, VOL_BAD_INPUT,
                    "cannot import '%s': array '%.80s' (%s) has no value%s at %" PRId64 " %" PRId64 " %" PRId64
                    " of WholeExtent %" PRId64 " %" PRId64 " %" PRId64 " %" PRId64 " %" PRId64 " %" PRId64 ": %s",
                    vti->file, work->choice.name, work->choice.cells ? "cells" : "points", step, place.first[0],
                    place.first[1], place.first[2], e[0], e[1], e[2], e[3], e[4], e[5], what);
}

static VolStatus check_coverage(Work *work, uint64_t voxels, uint64_t sum)
{
    /* Far more than the pieces have: where, a map of that size need not tell. */
    if (voxels > sum && voxels > 1 << 24)
        return vol_fail(work->err, VOL_BAD_INPUT,
                        "cannot import '%s': array '%.80s' (%s) has %" PRIu64 " of the %" PRIu64
                        " values that WholeExtent asks for: pieces are missing",
                        work->vti->file, work->choice.name, work->choice.cells ? "cells" : "points", sum, voxels);
    work->covered = vol_alloc_zero((size_t)voxels, 1);
    if (!work->covered)
        return vol_fail_memory(work->err, (size_t)voxels);
    VolStatus status = go_through_pieces(work);
    const unsigned char *hole = status ? NULL : memchr(work->covered, 0, (size_t)voxels);
    return hole ? fail_hole(work, (size_t)(hole - work->covered)) : status;
}

/* ---- The image ---- */

/* Samples of cells lie in the middle between the points. */
static void place(const Vti *vti, const Work *work, VolSampled *out)
{
    memcpy(out->index_to_world.m[3], vti->origin, sizeof vti->origin);
    for (int a = 0; a < 3; a++) {
        bool between = work->choice.cells && vti->whole.extent[2 * a] < vti->whole.extent[2 * a + 1];
        out->dims[a] = work->whole.size[a];
        for (int to = 0; to < 3; to++) {
            double step = vti->direction[3 * to + a] * vti->spacing[a];
            out->index_to_world.m[a][to] = step;
            out->index_to_world.m[3][to] += step * ((double)vti->whole.extent[2 * a] + (between ? 0.5 : 0.0));
        }
    }
}

static VolStatus assemble(Work *work, VolSampled *out)
{
    uint64_t voxels, values, sum;
    if (!count_of(&work->whole, 1, &voxels) || !count_of(&work->whole, out->components, &values))
        return vol_fail(work->err, VOL_BAD_INPUT, "cannot import '%s': its WholeExtent is too large",
                        work->vti->file);
    VolStatus status = check_pieces(work, &sum);
    if (!status)
        status = check_coverage(work, voxels, sum);
    if (status)
        return status;
    memset(work->covered, 0, (size_t)voxels);
    work->voxel = (size_t)out->components * vol_sample_size(out->type);
    double bytes = (double)voxels * (double)work->voxel;
    status = bytes > VOL_WORTH_A_CHECK ? vol_check_memory(bytes, work->err) : VOL_OK;
    if (status)
        return vol_fail_within(work->err, status, "cannot import '%s'", work->vti->file);
    work->out = out->bytes.data = vol_alloc((size_t)voxels, work->voxel);
    out->bytes.size = (size_t)voxels * work->voxel;
    return work->out ? go_through_pieces(work) : vol_fail_memory(work->err, out->bytes.size);
}

VolStatus vol_vti_image(const Vti *vti, const VolImportOptions *options, VolSampled *out, VolError *err)
{
    Work work = {.vti = vti, .err = err};
    if (!box_of(vti, vti->whole.extent, false, &work.whole))
        return vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': it holds no image: its WholeExtent is empty",
                        vti->file);
    VolStatus status = choose_array(vti, options, &work.choice, err);
    if (status)
        return status;
    (void)box_of(vti, vti->whole.extent, work.choice.cells, &work.whole);
    out->type = work.choice.type;
    out->big_endian = vti->big_endian;
    out->components = work.choice.sample->components;
    out->times = vti->times ? vti->times : 1;
    place(vti, &work, out);
    vol_sampled_order(out);
    out->time_stride = 0; /* only the step that was asked for is read */
    status = assemble(&work, out);
    free(work.covered);
    return status;
}
