/* vol-gen: makes volumes. */
#include <stdlib.h>
#include <string.h>

#include "cmd/shell/program.h"
#include "cmd/shell/stamp.h"
#include "procedural/field_vdb.h"

typedef struct Options {
    const char *size, *extent, *transform, *grid;
    VolTextList params;
    double sparse;
    int type, compression;
    bool list, half, twice;
} Options;

static Options options;

#define AT(field) offsetof(Options, field)
static const VolOpt table[] = {
    {.name = "size", .kind = VOL_OPT_TEXT, .offset = AT(size), .value_name = "N|NX,NY,NZ", .fallback = "64",
     .help = "voxels along the axes"},
    {.name = "param", .kind = VOL_OPT_LIST, .offset = AT(params), .value_name = "K=V",
     .help = "set a parameter of the field (repeatable)"},
    {.name = "extent", .kind = VOL_OPT_TEXT, .offset = AT(extent), .value_name = "X0,Y0,Z0,X1,Y1,Z1",
     .fallback = "-1,-1,-1,1,1,1", .help = "world places of the first and last voxel centres"},
    {.name = "transform", .kind = VOL_OPT_TEXT, .offset = AT(transform), .value_name = "A,B,..",
     .help = "index to world by rows, 12 numbers: the images of x, y, z, then the origin's place"},
    {.name = "grid", .kind = VOL_OPT_TEXT, .offset = AT(grid), .value_name = "NAME", .fallback = "density",
     .help = "name of the grid"},
    {.name = "half", .kind = VOL_OPT_FLAG, .offset = AT(half), .help = "save as half precision"},
    {.name = "double", .kind = VOL_OPT_FLAG, .offset = AT(twice), .help = "save as double precision"},
    {.name = "sparse", .kind = VOL_OPT_REAL, .offset = AT(sparse), .value_name = "THRESHOLD",
     .help = "only the leaves with a value farther than this from 0; no box"},
    {.name = "compression", .kind = VOL_OPT_CHOICE, .offset = AT(compression), .fallback = "blosc",
     .choices = "none|zip|blosc", .help = "of the file"},
    {.name = "list", .kind = VOL_OPT_FLAG, .offset = AT(list), .help = "list the fields and their parameters"},
};
enum { ROWS = sizeof table / sizeof *table };

static VolStatus parse_dims(const char *text, int32_t dims[3], VolError *err)
{
    double n[3];
    int count = vol_parse_reals(text, n, 1, 3);
    if (count != 1 && count != 3)
        return vol_fail(err, VOL_USAGE, "option --size: '%s' is neither N nor NX,NY,NZ", text);
    for (int i = 0; i < 3; i++) {
        double wanted = n[count == 1 ? 0 : i];
        if (!(wanted >= 1 && wanted <= 65536 && wanted == floor(wanted)))
            return vol_fail(err, VOL_USAGE, "option --size: '%s': whole numbers from 1 to 65536", text);
        dims[i] = (int32_t)wanted;
    }
    return VOL_OK;
}

static VolStatus parse_transform(const int32_t dims[3], VolAffine *out, VolError *err)
{
    double n[12];
    VolAffine inverse;
    if (options.transform) {
        if (vol_parse_reals(options.transform, n, 12, 12) != 12)
            return vol_fail(err, VOL_USAGE, "option --transform: '%s' is not 12 numbers", options.transform);
        memcpy(out->m, n, sizeof n);
        if (!vol_affine_invert(out, &inverse))
            return vol_fail(err, VOL_USAGE, "option --transform: '%s' cannot be inverted", options.transform);
        return VOL_OK;
    }
    if (vol_parse_reals(options.extent, n, 6, 6) != 6)
        return vol_fail(err, VOL_USAGE, "option --extent: '%s' is not 6 numbers", options.extent);
    *out = vol_field_extent(dims, vol_vec3(n[0], n[1], n[2]), vol_vec3(n[3], n[4], n[5]));
    if (!vol_affine_invert(out, &inverse))
        return vol_fail(err, VOL_USAGE, "option --extent: '%s' is flat", options.extent);
    return VOL_OK;
}

static VolStatus list_fields(const Run *run, VolError *err)
{
    return run_write_text(run, vol_field_list(), err);
}

static VolStatus parse_field(const Run *run, const char *name, VolFieldCase *field, VolFieldBox *box,
                             VolError *err)
{
    VolStatus status = vol_field_find(name, field, err);
    for (size_t i = 0; !status && i < options.params.count; i++)
        status = vol_field_set(field, options.params.words[i], err);
    if (!status)
        status = parse_dims(options.size, box->dims, err);
    if (!status)
        status = parse_transform(box->dims, &box->index_to_world, err);
    if (!status && options.half && options.twice)
        status = vol_fail(err, VOL_USAGE, "options --half and --double exclude each other");
    if (!status && options.sparse < 0)
        status = vol_fail(err, VOL_USAGE, "option --sparse: the threshold may not be negative");
    if (!status && !options.grid[0])
        status = vol_fail(err, VOL_USAGE, "option --grid: the name is empty");
    field->seed = (uint64_t)run->common->seed;
    box->grid = options.grid;
    box->store = options.half ? VOL_STORE_HALF : options.twice ? VOL_STORE_DOUBLE : VOL_STORE_FLOAT;
    box->sparse = run_given(run, "sparse");
    box->threshold = options.sparse;
    return status;
}

static void show_progress(void *user, double fraction) { run_progress(user, fraction); }

static VolStatus write_field(const Run *run, const VolFieldCase *field, VolFieldBox *box, VolVdbWriter *writer,
                             VolError *err)
{
    Run shown = *run;
    VolFieldCounts counts = {0};
    VolBytes bytes = {0};
    box->progress = show_progress;
    box->progress_user = &shown;

    VolStatus status = run_stamp_grid(run, &box->meta, err);
    if (!status)
        status = run_stamp_vdb(run, NULL, NULL, 0, vol_vdb_writer_file_meta(writer), err);
    if (!status)
        status = vol_field_write(field, box, run->threads, writer, &counts, err);
    if (!status && counts.largest > 65504)
        status = vol_fail(err, VOL_USAGE, "option --half: values up to %g do not fit (65504 is the most)",
                          counts.largest);
    vol_stats_stage(run->stats, "field");
    if (!status)
        status = vol_vdb_finish(writer, &bytes, err);
    vol_stats_stage(run->stats, "encode");
    vol_stats_count(run->stats, "leaves", counts.leaves);
    vol_stats_count(run->stats, "skipped.leaves", counts.skipped_leaves);
    if (!status && counts.non_finite)
        vol_warn(&run->log, "field '%s': %llu voxels are not finite", field->field->name,
                 (unsigned long long)counts.non_finite);
    if (!status && box->sparse && !counts.leaves)
        vol_warn(&run->log, "field '%s': nothing exceeds the threshold, the grid is empty", field->field->name);
    if (!status)
        status = run_write(run, &bytes, true, err);
    vol_bytes_free(&bytes);
    return status;
}

static VolStatus vol_gen(const Run *run, VolError *err)
{
    const VolTextList *words = &run->line->operands;
    bool field_word = words->count >= 1 && strcmp(words->words[0], "field") == 0;
    if (options.list || (field_word && words->count == 2 && strcmp(words->words[1], "list") == 0))
        return list_fields(run, err);
    if (words->count && !field_word)
        return vol_fail(err, VOL_USAGE, "unknown kind of volume '%s': there is 'field'", words->words[0]);
    if (words->count != 2)
        return vol_fail(err, VOL_USAGE, "what to make is missing: 'field NAME' ('field list' lists the names)");
    run_warn_of_name(run, run->common->output, "VDB");

    VolFieldCase field;
    VolFieldBox box = {0};
    VolVdbWriter *writer = NULL;
    VolStatus status = parse_field(run, words->words[1], &field, &box, err);
    if (!status)
        status = vol_vdb_writer_new((VolVdbCompression)options.compression, &writer, err);
    if (!status)
        status = write_field(run, &field, &box, writer, err);
    vol_meta_free(&box.meta);
    vol_vdb_writer_free(writer);
    return status;
}

int main(int argc, char **argv)
{
    const Program program = {.name = "vol-gen",
                             .summary = "make volumes from recipes",
                             .operands = "field NAME",
                             .table = table,
                             .rows = ROWS,
                             .options = &options,
                             .max_operands = 2,
                             .record_operands = true,
                             .main = vol_gen};
    return program_main(&program, argc, argv);
}
