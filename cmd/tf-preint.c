/* tf-preint: pre-integration tables of a transfer function. */
#include <inttypes.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/hash.h"
#include "cmd/shell/program.h"
#include "cmd/shell/stamp.h"
#include "inspect/tf_plot.h"
#include "load/appearance.h"
#include "load/grids.h"
#include "tf/write.h"

typedef struct Options {
    int64_t size, octaves;
    const char *range, *part, *plot, *volume, *grid;
    VolLen step;
} Options;

static Options options;

#define AT(field) offsetof(Options, field)
static const VolOpt table[] = {
    {0, "size", VOL_OPT_INT, AT(size), "N", "256", "nodes along each axis"},
    {0, "range", VOL_OPT_TEXT, AT(range), "LO,HI", NULL, "values of the first and last node (the nodes' own)"},
    {0, "step", VOL_OPT_WORLD_LENGTH, AT(step), "LEN", NULL, "length of the segments: 2 (world units), 1v (particle_step)"},
    {0, "part", VOL_OPT_TEXT, AT(part), "LIST", "tf,integrals,full", "what to write"},
    {0, "octaves", VOL_OPT_INT, AT(octaves), "N", "1", "full tables for LEN, 2 LEN, 4 LEN, ..: how many"},
    {.name = "plot", .kind = VOL_OPT_TEXT, .offset = AT(plot), .value_name = "FILE.png", .unrecorded = true,
     .help = "draw the functions (on a terminal: instead of tables)"},
    {.name = "volume", .kind = VOL_OPT_TEXT, .offset = AT(volume), .value_name = "VOL.vdb", .input = true,
     .help = "plot over its histogram; tabulate what it can need"},
    {0, "grid", VOL_OPT_TEXT, AT(grid), "NAME", NULL, "the volume's grid (density, or the only scalar one)"},
};

typedef struct Job {
    const Run *run;
    char *json;            /* the transfer function's text */
    VolVolume volume;      /* of --volume, or none */
    VolInspection inspection;
    const VolSeries *data; /* its histogram */
    VolTables *tables;
    uint64_t digests[3][2]; /* of the volume, the transfer function, and its name in the file */
    size_t digest_count;
} Job;

static void add_digest(Job *job, const VolBytes *bytes)
{
    vol_hash_bytes(bytes->data, bytes->size, job->digests[job->digest_count++]);
}

static VolStatus parse_parts(unsigned *parts, VolError *err)
{
    static const char *const names[] = {"tf", "integrals", "full"};
    char piece[16];
    *parts = 0;
    for (const char *rest = options.part; rest;) {
        unsigned bit = 0;
        rest = vol_cut_text(rest, ',', piece, sizeof piece);
        for (unsigned i = 0; i < 3; i++)
            bit |= strcmp(piece, names[i]) == 0 ? 1u << i : 0;
        if (!bit)
            return vol_fail(err, VOL_USAGE, "--part '%s': want some of tf, integrals, full, separated by commas",
                            options.part);
        *parts |= bit;
    }
    return VOL_OK;
}

static VolStatus parse_options(const Run *run, unsigned *parts, VolPreintOptions *out, VolError *err)
{
    double range[2] = {0};
    VolStatus status = parse_parts(parts, err);
    if (status)
        return status;
    bool full = *parts & VOL_TABLES_FULL;
    int64_t most = full ? VOL_PREINT_MOST_NODES : 1 << 20;
    if (options.size < 2 || options.size > most)
        return vol_fail(err, VOL_USAGE, "--size wants 2 to %" PRId64 "%s", most, full ? " for the full table" : "");
    if (options.octaves < 1 || options.octaves > 16)
        return vol_fail(err, VOL_USAGE, "--octaves wants 1 to 16");
    if (run_given(run, "step") && !(options.step.value > 0))
        return vol_fail(err, VOL_USAGE, "--step wants a length above 0");
    if (options.step.voxels && !options.volume)
        return vol_fail(err, VOL_USAGE, "--step in voxels: of which volume, --volume must say");
    if (options.range && (vol_parse_reals(options.range, range, 2, 2) != 2 || !(range[0] < range[1])))
        return vol_fail(err, VOL_USAGE, "--range '%s': want LO,HI with LO below HI", options.range);
    if (!full && (run_given(run, "step") || run_given(run, "octaves")))
        vol_warn(&run->log, "--%s has no effect without the part full", run_given(run, "step") ? "step" : "octaves");
    if (options.grid && !options.volume)
        vol_warn(&run->log, "--grid has no effect without --volume");
    *out = (VolPreintOptions){.lo = range[0], .hi = range[1], .n = (size_t)options.size, .step = options.step.value,
                              .octaves = full ? (size_t)options.octaves : 0, .change = INFINITY, .threads = run->threads,
                              .cpu = run->cpu};
    return VOL_OK;
}

/* ---- The volume ---- */

static VolStatus inspect_volume(Job *job, const VolVdb *vdb, size_t size, VolError *err)
{
    size_t index;
    char label[VOL_VDB_LABEL] = "";
    VolStatus status = vol_vdb_find(vdb, options.grid, &index, err);
    if (!status)
        vol_vdb_label(vdb, index, label, sizeof label);
    if (!status)
        status = vol_inspect_vdb(vdb, size, false, &job->inspection, err);
    for (size_t i = 0; !status && !job->data && i < job->inspection.series_count; i++)
        if (strcmp(job->inspection.series[i].name, label) == 0)
            job->data = &job->inspection.series[i];
    return status;
}

static VolStatus load_volume(Job *job, VolError *err)
{
    VolBytes bytes;
    VolVdb *vdb = NULL;
    const char *name = vol_input_name(options.volume);
    VolStatus status = run_read(job->run, options.volume, &bytes, err);
    if (status)
        return status;
    if (vol_kind(&bytes) != VOL_KIND_VDB) {
        status = run_wrong_kind("--volume", name, "VDB", &bytes, err);
        vol_bytes_free(&bytes);
        return status;
    }
    add_digest(job, &bytes);
    size_t size = bytes.size;
    status = vol_vdb_open(bytes, name, &vdb, err);
    if (!status)
        status = inspect_volume(job, vdb, size, err);
    if (!status) /* the last: it consumes the file */
        status = vol_load_volume(vdb, options.grid, false, job->run->threads, &job->run->log, &job->volume, err);
    vol_vdb_close(vdb);
    return status ? vol_fail_within(err, status, "--volume '%s'", name) : VOL_OK;
}

/* ---- The transfer function ---- */

/* As it is, unless its scalar_step is the data's to say. */
static VolStatus settle_own(Job *job, const VolBytes *bytes, VolTf *own, VolError *err)
{
    double lo = 0, hi = 0;
    VolStatus status = VOL_OK;
    if (!(own->scalar_step > 0) && job->volume.kind != VOL_VOLUME_NONE) {
        vol_volume_range(&job->volume, &lo, &hi);
        vol_tf_settle_step(own, lo, hi);
        own->scalar_step_given = true;
        status = vol_tf_write(own, &job->json, err);
    } else {
        job->json = vol_format_text("%.*s", (int)bytes->size, (const char *)bytes->data);
        status = job->json ? VOL_OK : vol_fail_memory(err, bytes->size);
    }
    vol_tf_free(own);
    return status;
}

/* Our own file as it is; another program's as we would write it, its fractions stretched over the data. */
static VolStatus settle_text(Job *job, const VolBytes *bytes, VolTf *tf, VolTfUnits units, const VolTables *tables,
                             VolError *err)
{
    VolTf own;
    if (tables) {
        job->json = vol_copy_text(tables->json);
        return job->json ? VOL_OK : vol_fail_memory(err, strlen(tables->json));
    }
    if (vol_tf_parse(bytes, "", &own, NULL, NULL) == VOL_OK)
        return settle_own(job, bytes, &own, err);
    if (units.relative && job->volume.kind == VOL_VOLUME_NONE)
        return vol_fail(err, VOL_USAGE, "its values are fractions of the data's range: name the data by --volume");
    if (job->volume.kind != VOL_VOLUME_NONE) {
        vol_appearance_settle(tf, units, &job->volume, &job->run->log);
    } else if (units.step != VOL_STEP_WORLD) {
        vol_warn(&job->run->log, "its opacities hold for a length that depends on the volume (--volume): %s",
                 "taken for 1 world unit");
        tf->particle_step = 1;
    }
    return vol_tf_write(tf, &job->json, err);
}

static VolStatus load_tf(Job *job, VolError *err)
{
    const char *word = run_input(job->run), *part;
    char *file;
    VolBytes bytes;
    VolTf tf;
    VolTables *tables = NULL;
    VolTfUnits units;
    VolStatus status = vol_tf_split_name(word, strcmp(word, "-") == 0 || access(word, F_OK) == 0, &file, &part, err);
    if (status)
        return status;
    status = run_read(job->run, file, &bytes, err);
    if (!status) {
        add_digest(job, &bytes);
        if (part)
            vol_hash_bytes(part, strlen(part), job->digests[job->digest_count++]);
        status = run_refuse_volume(&bytes, vol_input_name(file), err);
        if (!status)
            status = vol_load_transfer_function(&bytes, vol_input_name(file), part, &job->run->log, &tf, &units, &tables,
                                                err);
        if (!status) {
            status = settle_text(job, &bytes, &tf, units, tables, err);
            if (status)
                vol_fail_within(err, status, "cannot use transfer function '%s'", vol_input_name(file));
            vol_tf_free(&tf);
        }
        vol_tables_free(tables);
        vol_bytes_free(&bytes);
    }
    free(file);
    return status;
}

/* ---- Output ---- */

static VolStatus write_plot(const Job *job, VolError *err)
{
    VolBytes png;
    const VolTables *t = job->tables;
    VolStatus status = vol_tf_plot(&t->tf, &t->compiled, t->preint.lo, t->preint.hi, job->data, &png, err);
    if (!status)
        status = run_write_to(job->run, options.plot, &png, true, err);
    return status;
}

static VolStatus write_tables(const Job *job, unsigned parts, VolError *err)
{
    VolImage image;
    VolBytes bytes = {0};
    VolStatus status = vol_tables_to_image(job->tables, parts, &image, err);
    if (status)
        return status;
    status = run_stamp_exr(job->run, NULL, (const uint64_t(*)[2])job->digests, job->digest_count, &image, err);
    if (!status)
        status = vol_exr_write(&image, VOL_EXR_ZIP, job->run->threads, &bytes, NULL, err);
    vol_image_free(&image);
    vol_stats_stage(job->run->stats, "encode");
    if (!status)
        status = run_write(job->run, &bytes, true, err);
    vol_bytes_free(&bytes);
    return status;
}

static void count_work(const Job *job)
{
    const VolPreint *preint = &job->tables->preint;
    VolStats *stats = job->run->stats;
    vol_stats_stage(stats, "build");
    vol_stats_count(stats, "nodes", preint->n);
    for (size_t o = 0; o < preint->octave_count; o++) {
        uint64_t out = preint->n - 1 - preint->octaves[o].band; /* two triangles of this side */
        vol_stats_count(stats, "entries", (uint64_t)preint->n * preint->n - out * (out + 1));
        vol_stats_count(stats, "skipped.entries", out * (out + 1));
    }
}

static VolStatus make(Job *job, unsigned parts, bool tables_wanted, VolPreintOptions build, VolError *err)
{
    const char *name = vol_input_name(run_input(job->run));
    if (!tables_wanted)
        build.octaves = 0;
    if (options.step.voxels)
        build.step *= vol_volume_voxel(&job->volume);
    if (job->volume.kind != VOL_VOLUME_NONE && build.octaves) { /* the step may be the transfer function's own */
        VolTf tf;
        VolBytes text = {(unsigned char *)job->json, strlen(job->json)};
        VolStatus status = vol_tf_parse(&text, name, &tf, NULL, err);
        if (status)
            return status;
        build.change = vol_volume_change(&job->volume, build.step > 0 ? build.step : tf.particle_step);
        vol_tf_free(&tf);
    }
    VolStatus status = vol_tables_build(job->json, name, build, &job->run->log, &job->tables, err);
    if (status)
        return status;
    count_work(job);
    if (parts & VOL_TABLES_FULL && job->tables->compiled.model == VOL_MODEL_CLASSIC)
        vol_warn(&job->run->log, "the model is classic: its particles are shaded, which the full table cannot do");
    if (options.plot)
        status = write_plot(job, err);
    return !status && tables_wanted ? write_tables(job, parts, err) : status;
}

static VolStatus tf_preint(const Run *run, VolError *err)
{
    Job job = {.run = run};
    unsigned parts;
    VolPreintOptions build;
    /* Who looks at a plot from a terminal has no use for tables there. */
    bool tables_wanted = !options.plot || strcmp(run->common->output, "-") != 0 ||
                         run_check_output(run, true, NULL) == VOL_OK;
    VolStatus status = parse_options(run, &parts, &build, err);
    if (!status && options.plot && strcmp(options.plot, "-") == 0)
        status = vol_fail(err, VOL_USAGE, "option --plot: wants a file, stdout is for tables");
    if (!status && tables_wanted)
        status = run_check_output(run, true, err);
    if (!status && tables_wanted)
        run_warn_of_name(run, run->common->output, "EXR");
    if (!status && options.plot)
        run_warn_of_name(run, options.plot, "PNG");
    if (!status && options.volume)
        status = load_volume(&job, err);
    if (!status)
        status = load_tf(&job, err);
    vol_stats_stage(run->stats, "read");
    if (!status)
        status = make(&job, parts, tables_wanted, build, err);
    vol_tables_free(job.tables);
    vol_inspection_free(&job.inspection);
    vol_volume_free(&job.volume);
    free(job.json);
    return status;
}

int main(int argc, char **argv)
{
    static const Program program = {.name = "tf-preint",
                                    .summary = "make pre-integration tables of a transfer function",
                                    .operands = "[TF]",
                                    .table = table,
                                    .rows = sizeof table / sizeof *table,
                                    .options = &options,
                                    .max_operands = 1,
                                    .also = &options.plot,
                                    .main = tf_preint};
    return program_main(&program, argc, argv);
}
