/* vol-import: other people's volumes become VDB. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/hash.h"
#include "cmd/shell/program.h"
#include "cmd/shell/stamp.h"
#include "import/import.h"

typedef struct Options {
    const char *array, *component, *dims, *type, *slices, *grid;
    int64_t time_step, header;
    VolVec3 spacing, origin;
    int endian, compression;
    bool half, fill_gaps;
} Options;

static Options options;

#define AT(field) offsetof(Options, field)
static const VolOpt table[] = {
    {.name = "array", .kind = VOL_OPT_TEXT, .offset = AT(array), .value_name = "NAME",
     .help = "which array, or DICOM series (default: the active or only one)"},
    {.name = "component", .kind = VOL_OPT_TEXT, .offset = AT(component), .value_name = "N|magnitude",
     .help = "which component, from 0 (default: the only one, else magnitude)"},
    {.name = "time-step", .kind = VOL_OPT_INT, .offset = AT(time_step), .value_name = "N", .fallback = "0",
     .help = "which time step, from 0"},
    {.name = "spacing", .kind = VOL_OPT_VEC3, .offset = AT(spacing), .value_name = "X,Y,Z",
     .help = "replace the lengths of the voxels' edges"},
    {.name = "origin", .kind = VOL_OPT_VEC3, .offset = AT(origin), .value_name = "X,Y,Z",
     .help = "replace the place of voxel 0,0,0"},
    {.name = "fill-gaps", .kind = VOL_OPT_FLAG, .offset = AT(fill_gaps),
     .help = "missing DICOM slices become NaN, which is empty"},
    {.name = "grid", .kind = VOL_OPT_TEXT, .offset = AT(grid), .value_name = "NAME", .fallback = "density",
     .help = "name of the grid"},
    {.name = "half", .kind = VOL_OPT_FLAG, .offset = AT(half), .help = "save as half precision (loses digits)"},
    {.name = "compression", .kind = VOL_OPT_CHOICE, .offset = AT(compression), .fallback = "blosc",
     .choices = "none|zip|blosc", .help = "of the file"},
    {.help = "Samples without a header:"},
    {.name = "dims", .kind = VOL_OPT_TEXT, .offset = AT(dims), .value_name = "X,Y[,Z]",
     .help = "voxels along the axes; one slice per file without Z"},
    {.name = "type", .kind = VOL_OPT_TEXT, .offset = AT(type), .value_name = "TYPE",
     .help = "u8 i8 u16 i16 u32 i32 u64 i64 f32 f64"},
    {.name = "endian", .kind = VOL_OPT_CHOICE, .offset = AT(endian), .fallback = "little", .choices = "little|big",
     .help = "byte order"},
    {.name = "header", .kind = VOL_OPT_INT, .offset = AT(header), .value_name = "BYTES", .fallback = "0",
     .help = "passed over at the start of every file"},
    {.name = "slices", .kind = VOL_OPT_TEXT, .offset = AT(slices), .value_name = "A:B", .input = true,
     .help = "numbers A to B in the pattern FILE (a.%d, a.%03d)"},
};
enum { ROWS = sizeof table / sizeof *table };

/* Every file that a reader asks for is read here: its digest goes into vol:argsHash. */
typedef struct Account {
    const Run *run;
    uint64_t (*digests)[2];
    size_t count;
} Account;

static VolStatus read_and_account(void *user, const char *path, VolBytes *out, VolError *err)
{
    Account *account = user;
    uint64_t(*longer)[2] = vol_resize(account->digests, account->count + 1, sizeof *account->digests);
    if (!longer)
        return vol_fail_memory(err, (account->count + 1) * sizeof *longer);
    account->digests = longer;
    VolStatus status = run_read(account->run, path, out, err);
    if (status)
        return status;
    vol_hash_bytes(out->data, out->size, account->digests[account->count++]);
    return VOL_OK;
}

static VolStatus parse_component(int64_t *out, VolError *err)
{
    *out = VOL_COMPONENT_DEFAULT;
    if (!options.component)
        return VOL_OK;
    if (strcmp(options.component, "magnitude") == 0)
        return *out = VOL_COMPONENT_MAGNITUDE, VOL_OK;
    if (vol_parse_int(options.component, out) && *out >= 0)
        return VOL_OK;
    return vol_fail(err, VOL_USAGE, "option --component: '%s' is neither a number from 0 nor 'magnitude'",
                    options.component);
}

static VolStatus parse_raw(const Run *run, VolImportOptions *out, VolError *err)
{
    out->raw = options.dims || options.type;
    if (!out->raw && (run_given(run, "endian") || run_given(run, "header") || run_given(run, "slices")))
        return vol_fail(err, VOL_USAGE,
                        "options --endian, --header and --slices are for raw samples: give --dims and --type");
    if (!out->raw)
        return VOL_OK;
    if (options.array)
        return vol_fail(err, VOL_USAGE, "option --array: raw samples are one array, without a name");
    if (!options.dims || !options.type)
        return vol_fail(err, VOL_USAGE, "raw samples need both --dims and --type");
    double n[3] = {0, 0, 0};
    if (vol_parse_reals(options.dims, n, 2, 3) < 0)
        return vol_fail(err, VOL_USAGE, "option --dims: '%s' is not X,Y,Z", options.dims);
    for (int a = 0; a < 3; a++) {
        bool left_out = a == 2 && n[a] == 0 && strchr(options.dims, ',') == strrchr(options.dims, ',');
        if (!left_out && !(n[a] >= 1 && n[a] <= INT32_MAX && n[a] == floor(n[a])))
            return vol_fail(err, VOL_USAGE, "option --dims: '%s': whole numbers from 1", options.dims);
        out->dims[a] = (int64_t)n[a];
    }
    if (!vol_sample_named(options.type, &out->type))
        return vol_fail(err, VOL_USAGE, "option --type: '%s' is none of u8 i8 u16 i16 u32 i32 u64 i64 f32 f64",
                        options.type);
    if (options.header < 0)
        return vol_fail(err, VOL_USAGE, "option --header: the number of bytes may not be negative");
    out->big_endian = options.endian == 1;
    out->header = options.header;
    return VOL_OK;
}

static VolStatus parse_options(const Run *run, VolImportOptions *out, VolError *err)
{
    *out = (VolImportOptions){.array = options.array,
                              .time_step = options.time_step,
                              .fill_gaps = options.fill_gaps,
                              .spacing_given = run_given(run, "spacing"),
                              .origin_given = run_given(run, "origin"),
                              .spacing = options.spacing,
                              .origin = options.origin};
    const VolVec3 *s = &options.spacing;
    if (out->spacing_given && !(s->x > 0 && s->y > 0 && s->z > 0))
        return vol_fail(err, VOL_USAGE, "option --spacing: lengths are greater than 0");
    if (options.time_step < 0)
        return vol_fail(err, VOL_USAGE, "option --time-step: steps count from 0");
    if (!options.grid[0])
        return vol_fail(err, VOL_USAGE, "option --grid: the name is empty");
    VolStatus status = parse_component(&out->component, err);
    return status ? status : parse_raw(run, out, err);
}

/* The operands, or the files that --slices makes of the one pattern.  Every name is allocated. */
static VolStatus list_inputs(const Run *run, char ***out, size_t *count, VolError *err)
{
    const VolTextList *words = &run->line->operands;
    int64_t first = 0, last = 0;
    *count = words->count ? words->count : 1;
    if (options.slices) {
        const char *colon = strchr(options.slices, ':');
        char *begin = vol_format_text("%.*s", colon ? (int)(colon - options.slices) : 0, options.slices);
        bool good = begin && colon && vol_parse_int(begin, &first) && vol_parse_int(colon + 1, &last);
        free(begin);
        if (!good || first < 0 || last < first || last - first >= 1 << 20)
            return vol_fail(err, VOL_USAGE, "option --slices: '%s' is not A:B with A <= B", options.slices);
        if (words->count != 1)
            return vol_fail(err, VOL_USAGE, "option --slices goes with one pattern");
        *count = (size_t)(last - first) + 1;
    }
    char **names = *out = vol_alloc_zero(*count, sizeof *names);
    VolStatus status = names ? VOL_OK : vol_fail_memory(err, *count * sizeof *names);
    for (size_t i = 0; !status && i < *count; i++) {
        if (options.slices)
            status = vol_fill_slice_number(words->words[0], first + (int64_t)i, &names[i], err);
        else if (!(names[i] = vol_copy_text(words->count ? words->words[i] : "-")))
            status = vol_fail_memory(err, 1);
    }
    return status;
}

/* What is taken of a file that holds more than one grid can. */
static void tell_choices(const Run *run, const char *name, const VolSampled *image)
{
    if (image->times > 1 && !run_given(run, "time-step"))
        vol_warn(&run->log, "'%s': time step 0 of %lld is taken; --time-step N takes another", name,
                 (long long)image->times);
    if (image->components > 1 && !options.component)
        vol_warn(&run->log, "'%s': the magnitude of %lld components is taken; --component N takes one", name,
                 (long long)image->components);
}

static void tell_spacing(const Run *run, const char *name, const VolImported *imported)
{
    char axes[16] = "";
    for (int a = 0; a < 3; a++)
        if (imported->spacing_made[a])
            snprintf(axes + strlen(axes), sizeof axes - strlen(axes), "%s%c", *axes ? ", " : "", "xyz"[a]);
    if (*axes)
        vol_warn(&run->log,
                 "'%s': the file gives no spacing along %s (0, negative or not finite): 1 is taken; --spacing sets it", name,
                 axes);
}

static VolStatus import_inputs(const Run *run, const char *const *names, size_t count, Account *account,
                               VolImported *out, VolError *err)
{
    VolImportOptions wanted;
    VolImportFiles files = {read_and_account, account};
    VolSampled image = {0};
    VolStatus status = parse_options(run, &wanted, err);
    if (!status)
        status = vol_import_open(names, count, &wanted, &files, &run->log, &image, err);
    vol_stats_stage(run->stats, "read");
    const char *name = vol_input_name(names[0]);
    if (!status)
        tell_choices(run, name, &image);
    if (!status)
        status = vol_import_convert(&image, name, &wanted, out, err);
    vol_stats_stage(run->stats, "convert");
    vol_sampled_free(&image);
    if (status)
        return status;
    tell_spacing(run, name, out);
    if (options.half && (out->store != VOL_STORE_FLOAT || out->largest > 65504))
        return vol_fail(err, VOL_USAGE, "option --half: the samples of '%s' do not fit (they reach %g)", name,
                        out->largest);
    if (options.half)
        out->store = VOL_STORE_HALF;
    if (out->non_finite)
        vol_note(&run->log, "'%s': %llu voxels are NaN or infinite", name, (unsigned long long)out->non_finite);
    if (out->inexact)
        vol_warn(&run->log, "'%s': %llu integers beyond 2^53 are rounded", name, (unsigned long long)out->inexact);
    vol_stats_count(run->stats, "non_finite_voxels", out->non_finite);
    return VOL_OK;
}

static VolStatus write_vdb(const Run *run, const VolImported *imported, const Account *account, VolError *err)
{
    VolVdbWriter *writer = NULL;
    VolVdbMetaList meta = {0};
    VolBytes bytes = {0};
    VolStatus status = vol_vdb_writer_new((VolVdbCompression)options.compression, &writer, err);
    if (!status)
        status = run_stamp_vdb(run, NULL, (const uint64_t(*)[2])account->digests, account->count,
                               vol_vdb_writer_file_meta(writer), err);
    if (!status)
        status = run_stamp_grid(run, &meta, err);
    if (!status)
        status = vol_import_write(imported, options.grid, &meta, writer, err);
    if (!status)
        status = vol_vdb_finish(writer, &bytes, err);
    vol_stats_stage(run->stats, "encode");
    if (!status)
        status = run_write(run, &bytes, true, err);
    vol_meta_free(&meta);
    vol_bytes_free(&bytes);
    vol_vdb_writer_free(writer);
    return status;
}

static VolStatus vol_import(const Run *run, VolError *err)
{
    char **names = NULL;
    size_t count = 0;
    Account account = {.run = run};
    VolImported imported = {0};
    run_warn_of_name(run, run->common->output, "VDB");
    VolStatus status = list_inputs(run, &names, &count, err);
    if (!status)
        status = import_inputs(run, (const char *const *)names, count, &account, &imported, err);
    if (!status)
        status = write_vdb(run, &imported, &account, err);
    vol_imported_free(&imported);
    free(account.digests);
    for (size_t i = 0; names && i < count; i++)
        free(names[i]);
    free(names);
    return status;
}

int main(int argc, char **argv)
{
    const Program program = {.name = "vol-import",
                             .summary = "turn other people's volumes into VDB",
                             .operands = "[FILE ...]",
                             .table = table,
                             .rows = ROWS,
                             .options = &options,
                             .max_operands = -1,
                             .main = vol_import};
    return program_main(&program, argc, argv);
}
