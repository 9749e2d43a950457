/* light-solve: a VDB and a transfer function in, the same VDB out with grids of the light that reaches each place. */
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/hash.h"
#include "cmd/shell/program.h"
#include "cmd/shell/stamp.h"
#include "io/vdb.h"
#include "light/on_lattice.h"
#include "light/shadow.h"
#include "load/assembly.h"
#include "load/grids.h"
#include "load/reuse.h"
#include "tf/attenuation.h"
#include "tf/foreign.h"
#include "trace/lights.h"
#include "volume/content_hash.h"

typedef struct Options {
    const char *tf, *grid, *reuse;
    int method;
    bool exact_rays, preview, as_printed;
    double absorption, scalar_step, cone_angle;
    VolVec3 scattering;
    VolLen particle_step, blur_length;
    int64_t sweeps;
    int64_t resolution;
    VolTextList light, clip;
} Options;

static Options options;

enum { SHADOW, CONE, PDE }; /* in the order of METHODS */

#define AT(field) offsetof(Options, field)

#define METHODS "shadow|cone|pde"

static const VolOpt table[] = {
    {.letter = 't', .name = "tf", .kind = VOL_OPT_TEXT, .offset = AT(tf), .value_name = "FILE[#NAME]", .input = true,
     .help = "transfer function or tables (required); NAME: one of several in the file"},
    {0, "grid", VOL_OPT_TEXT, AT(grid), "NAME", NULL, "grid that attenuates (density, or the only scalar one)"},
    {0, "light", VOL_OPT_LIST, AT(light), "SPEC", NULL, "sun:DX,DY,DZ[:R,G,B], point:.., spot:.. (required, repeatable)"},
    {0, "method", VOL_OPT_CHOICE, AT(method), NULL, "shadow", "how light is followed", METHODS},
    {0, "exact-rays", VOL_OPT_FLAG, AT(exact_rays), NULL, NULL, "a ray of its own from every voxel"},
    {0, "absorption", VOL_OPT_REAL, AT(absorption), "S", "1", "optical depth of direct light counts S times"},
    {0, "cone-angle", VOL_OPT_REAL, AT(cone_angle), "DEG", "30", "cone: full angle that light spreads by"},
    {0, "blur-length", VOL_OPT_LENGTH, AT(blur_length), "LEN", "1v", "cone: path over which it spreads by that angle"},
    {0, "scattering", VOL_OPT_RGB, AT(scattering), "R,G,B", "0,0,0", "pde: diffusion, squares of the shortest voxel edge"},
    {0, "preview", VOL_OPT_FLAG, AT(preview), NULL, NULL, "pde: diffusion along one axis after the other"},
    {0, "as-printed", VOL_OPT_FLAG, AT(as_printed), NULL, NULL, "cone, pde: the papers' own schemes"},
    {0, "sweeps", VOL_OPT_INT, AT(sweeps), "K", "20", "pde as printed: sweeps of relaxation"},
    {0, "resolution", VOL_OPT_INT, AT(resolution), "N", "0",
     "a lattice of its own, N voxels along the longest side (0: the volume's voxels)"},
    {.name = "reuse", .kind = VOL_OPT_TEXT, .offset = AT(reuse), .value_name = "LIT.vdb", .input = true, .unrecorded = true,
     .help = "copy lights from there that were solved in the same way, for the same volume"},
    {0, "clip", VOL_OPT_LIST, AT(clip), "NX,NY,NZ,D", NULL, "keep n.x >= D, world units (repeatable)"},
    {0, "particle-step", VOL_OPT_WORLD_LENGTH, AT(particle_step), "LEN", NULL,
     "overrides the file's particle_step: 2 (world units), 1v (voxels)"},
    {0, "scalar-step", VOL_OPT_REAL, AT(scalar_step), "DV", NULL, "overrides the file's scalar_step, units of the field"},
};
enum { ROWS = sizeof table / sizeof *table };

typedef struct Job {
    const Run *run;
    VolAssembly assembly; /* its lights are those asked for */
    VolTfCompiled dark;   /* what attenuates, alone */
    VolGrid *mask_grid;   /* or NULL */
    VolLightMask mask;
    VolVdb *lit; /* of --reuse, or NULL */
    VolVdbWriter *writer;
    VolVdbMetaList meta;  /* what all light grids say */
    uint64_t digests[3][2]; /* of the transfer function and its name in the file, the volume */
    size_t digest_count;
    char *prior_history;
} Job;

/* One way of solving: what it makes of all lights goes into the job's writer. */
typedef struct Method {
    const char *name;
    VolStatus (*solve)(Job *job, VolError *err);
} Method;

/* ---- Reading ---- */

static VolStatus read_appearance(Job *job, VolError *err)
{
    VolBytes bytes;
    char *file;
    const char *part;
    if (!options.tf)
        return vol_fail(err, VOL_USAGE, "no transfer function: give -t FILE");
    VolStatus status = vol_tf_split_name(options.tf, access(options.tf, F_OK) == 0, &file, &part, err);
    if (status)
        return status;
    status = run_read(job->run, file, &bytes, err);
    if (!status) {
        vol_hash_bytes(bytes.data, bytes.size, job->digests[job->digest_count++]);
        if (part)
            vol_hash_bytes(part, strlen(part), job->digests[job->digest_count++]);
        status = run_refuse_volume(&bytes, vol_input_name(file), err);
        if (!status)
            status = vol_appearance_read(&bytes, vol_input_name(file), part, &job->run->log, &job->assembly.appearance, err);
        vol_bytes_free(&bytes);
    }
    free(file);
    return status;
}

static VolStatus keep_history(Job *job, const VolVdb *vdb, VolError *err)
{
    const VolVdbMeta *meta = vol_meta_find(vol_vdb_file_meta(vdb), "vol:history");
    if (!meta || job->run->common->no_history)
        return VOL_OK;
    job->prior_history = vol_meta_text(meta);
    return job->prior_history ? VOL_OK : vol_fail_memory(err, meta->size);
}

static bool is_light(const char *name)
{
    return vol_vdb_is_beside(name) && strcmp(name, "mask") != 0;
}

/* All grids but those of light solved before, which are solved anew. */
static VolStatus pass_grids(Job *job, const VolVdb *vdb, VolError *err)
{
    size_t replaced = 0;
    VolStatus status = vol_meta_copy(vol_vdb_writer_file_meta(job->writer), vol_vdb_file_meta(vdb), err);
    for (size_t i = 0; i < vol_vdb_count(vdb) && !status; i++) {
        const char *name = vol_vdb_entry(vdb, i)->name;
        if (is_light(name))
            replaced++;
        else
            status = vol_vdb_pass_grid(job->writer, vdb, i, err);
        if (!status && strcmp(name, "mask") == 0 && !job->mask_grid)
            status = vol_load_field(vdb, "mask", job->run->threads, &job->run->log, &job->mask_grid, err);
    }
    if (replaced)
        vol_note(&job->run->log, "%zu light grids of the input are replaced", replaced);
    return status;
}

static VolStatus load_volume(Job *job, VolError *err)
{
    const char *path = run_input(job->run);
    VolBytes bytes;
    VolVdb *vdb = NULL;
    VolStatus status = run_read(job->run, path, &bytes, err);
    if (status)
        return status;
    if (vol_kind(&bytes) != VOL_KIND_VDB) {
        status = run_wrong_kind("cannot read", vol_input_name(path), "VDB", &bytes, err);
        vol_bytes_free(&bytes);
        return status;
    }
    vol_hash_bytes(bytes.data, bytes.size, job->digests[job->digest_count++]);
    vol_stats_stage(job->run->stats, "read");
    status = vol_vdb_open(bytes, vol_input_name(path), &vdb, err);
    if (!status)
        status = keep_history(job, vdb, err);
    if (!status)
        status = pass_grids(job, vdb, err);
    if (!status) {
        status = vol_load_volume(vdb, options.grid, false, job->run->threads, &job->run->log, &job->assembly.volume, err);
        if (status && !strstr(err->text, vol_input_name(path)))
            vol_fail_within(err, status, "cannot read '%s'", vol_input_name(path));
    }
    vol_vdb_close(vdb);
    vol_stats_stage(job->run->stats, "load");
    return status;
}

static VolStatus open_lit(Job *job, VolError *err)
{
    VolBytes bytes;
    if (!options.reuse)
        return VOL_OK;
    const char *name = vol_input_name(options.reuse);
    VolStatus status = run_read(job->run, options.reuse, &bytes, err);
    if (status)
        return status;
    if (vol_kind(&bytes) != VOL_KIND_VDB) {
        status = run_wrong_kind("cannot reuse", name, "VDB", &bytes, err);
        vol_bytes_free(&bytes);
        return status;
    }
    return vol_vdb_open(bytes, name, &job->lit, err);
}

/* ---- The scene ---- */

static VolStatus check_options(const Run *run, VolError *err)
{
    if (!options.light.count)
        return vol_fail(err, VOL_USAGE, "no light: give --light SPEC");
    if (!(options.absorption >= 0))
        return vol_fail(err, VOL_USAGE, "--absorption wants a number of at least 0");
    if (options.method == CONE && run_given(run, "absorption"))
        return vol_fail(err, VOL_USAGE, "--absorption is for shadow and pde, not for --method cone");
    if (!(options.cone_angle >= 0 && options.cone_angle < 180))
        return vol_fail(err, VOL_USAGE, "--cone-angle wants degrees from 0 to less than 180");
    if (!(options.blur_length.value >= 0))
        return vol_fail(err, VOL_USAGE, "--blur-length wants a length of at least 0");
    if (!(options.scattering.x >= 0 && options.scattering.y >= 0 && options.scattering.z >= 0))
        return vol_fail(err, VOL_USAGE, "--scattering wants numbers of at least 0");
    if (options.sweeps < 0 || options.sweeps > 1000000)
        return vol_fail(err, VOL_USAGE, "--sweeps wants a number from 0 to 1000000");
    if (run_given(run, "resolution") && options.resolution < 2)
        return vol_fail(err, VOL_USAGE, "--resolution wants at least 2 voxels");
    if (options.resolution > 65536)
        return vol_fail(err, VOL_USAGE, "--resolution wants at most 65536 voxels");
    if (run_given(run, "particle-step") && !(options.particle_step.value > 0))
        return vol_fail(err, VOL_USAGE, "--particle-step wants a length above 0");
    if (run_given(run, "scalar-step") && !(options.scalar_step > 0))
        return vol_fail(err, VOL_USAGE, "--scalar-step wants a value above 0");
    return VOL_OK;
}

static VolStatus set_scene(Job *job, VolError *err)
{
    VolAssembly *assembly = &job->assembly;
    VolScene *scene = &assembly->scene;
    double voxel = vol_volume_voxel(&assembly->volume);
    const VolAppearanceSettings settings = {
        .particle_step = options.particle_step.value * (options.particle_step.voxels ? voxel : 1),
        .scalar_step = options.scalar_step,
        .threads = job->run->threads,
        .cpu = job->run->cpu};
    VolStatus status = vol_assemble_appearance(assembly, &settings, &job->run->log, err);
    if (!status)
        status = vol_assemble_clips(assembly, options.clip.words, options.clip.count, err);
    if (!status)
        status = vol_tf_attenuation_of(scene->tf, &job->dark, err);
    if (status)
        return status;
    vol_assembly_explains_nothing(assembly, &job->run->log);
    scene->tf = &job->dark;
    scene->lights = NULL;
    scene->light_count = 0;
    scene->estimator = VOL_ESTIMATE_EXACT;
    scene->step = voxel;
    scene->skip = true;
    scene->cpu = job->run->cpu;
    scene->termination_opacity = vol_shadow_termination(options.absorption);
    if (job->mask_grid)
        status = vol_light_mask_new(scene, job->mask_grid, job->run->threads, &job->mask, err);
    return status;
}

/* ---- What light grids say of themselves ---- */

static VolStatus say_hash(Job *job, const char *name, const uint64_t digest[2], VolError *err)
{
    char hex[33];
    vol_hash_hex(digest, hex);
    return vol_meta_set_text(&job->meta, name, hex, err);
}

/* In 17 digits, so that equal texts are equal planes. */
static VolStatus say_clips(Job *job, VolError *err)
{
    char *text = vol_copy_text("");
    for (size_t i = 0; i < job->assembly.scene.clip_count && text; i++) {
        const VolClip *clip = &job->assembly.clips[i];
        char *longer = vol_format_text("%s%s%.17g,%.17g,%.17g,%.17g", text, i ? " " : "", clip->normal.x, clip->normal.y,
                                       clip->normal.z, clip->d);
        free(text);
        text = longer;
    }
    VolStatus status = text ? vol_meta_set_text(&job->meta, "light:clip", text, err) : vol_fail_memory(err, 64);
    free(text);
    return status;
}

/* World units. */
static double blur_length(const Job *job)
{
    double voxel = vol_volume_voxel(&job->assembly.volume);
    return options.blur_length.value * (options.blur_length.voxels ? voxel : 1);
}

static VolStatus say_options(Job *job, VolError *err)
{
    uint64_t digest[2] = {0};
    char hex[33] = "none";
    const VolVolume mask = vol_volume_of_grid(job->mask_grid);
    VolStatus status = job->mask_grid ? vol_volume_hash(&mask, 1, job->run->threads, digest, err) : VOL_OK;
    if (status)
        return status;
    if (job->mask_grid)
        vol_hash_hex(digest, hex);
    char *own = options.method == CONE
                    ? vol_format_text(" cone-angle=%.17g blur-length=%.17g", options.cone_angle, blur_length(job))
                : options.method == PDE
                    ? vol_format_text(" scattering=%.17g,%.17g,%.17g%s sweeps=%" PRId64, options.scattering.x,
                                      options.scattering.y, options.scattering.z, options.preview ? " preview" : "",
                                      options.sweeps)
                    : vol_copy_text("");
    char *text = own ? vol_format_text("exact-rays absorption=%.17g resolution=%" PRId64 " mask=%s%s%s", options.absorption,
                                       options.resolution, hex, own, options.as_printed ? " as-printed" : "")
                     : NULL;
    free(own);
    status = text ? vol_meta_set_text(&job->meta, "light:options", text, err) : vol_fail_memory(err, 64);
    free(text);
    return status;
}

static VolStatus describe(Job *job, const Method *method, VolError *err)
{
    const VolAssembly *assembly = &job->assembly;
    const double unit = assembly->scene.unit ? assembly->scene.unit : 1;
    uint64_t digest[2];
    VolStatus status = run_stamp_grid(job->run, &job->meta, err);
    if (!status)
        status = vol_meta_set_text(&job->meta, "light:method", method->name, err);
    if (!status)
        status = say_clips(job, err);
    if (!status)
        status = vol_volume_hash(&assembly->volume, unit, job->run->threads, digest, err);
    if (!status)
        status = say_hash(job, "light:volume", digest, err);
    if (!status && !assembly->appearance.tables) { /* tables are not compared */
        status = vol_tf_attenuation_hash(&assembly->appearance.tf, digest, err);
        if (!status)
            status = say_hash(job, "light:tf", digest, err);
    }
    if (!status)
        status = say_options(job, err);
    vol_stats_stage(job->run->stats, "prepare");
    return status;
}

/* ---- Writing ---- */

#define ALL_LIGHTS SIZE_MAX

/* Light k's; or, for the sum of all, one behind the other. */
static VolStatus say_lights(const Job *job, size_t k, VolVdbMetaList *meta, VolError *err)
{
    if (k != ALL_LIGHTS) {
        VolStatus status = vol_meta_set_text(meta, "light:spec", options.light.words[k], err);
        return status ? status
                      : vol_meta_set(meta, "light:rgb", "vec3d", job->assembly.lights[k].rgb, 3 * sizeof(double), err);
    }
    char *text = vol_copy_text("");
    for (size_t i = 0; i < options.light.count && text; i++) {
        char *longer = vol_format_text("%s%s%s", text, i ? " " : "", options.light.words[i]);
        free(text);
        text = longer;
    }
    VolStatus status = text ? vol_meta_set_text(meta, "light:spec", text, err) : vol_fail_memory(err, 64);
    free(text);
    return status;
}

/* What the grid of light k says, its domain left out. */
static VolStatus meta_of_light(const Job *job, size_t k, VolVdbMetaList *meta, VolError *err)
{
    VolStatus status = vol_meta_copy(meta, &job->meta, err);
    return status ? status : say_lights(job, k, meta, err);
}

static VolStatus meta_of_grid(const Job *job, const VolLightLattice *lattice, size_t k, VolVdbMetaList *meta,
                              VolError *err)
{
    VolStatus status = meta_of_light(job, k, meta, err);
    if (!status)
        status = vol_meta_set_text(meta, "vol:domain", "box", err);
    if (!status)
        status = vol_meta_set_vec3i(meta, "vol:domainMin", lattice->lo, err);
    if (!status)
        status = vol_meta_set_vec3i(meta, "vol:domainMax", lattice->hi, err);
    return status;
}

/* Light k of --reuse, if it is there. */
static VolStatus reuse(Job *job, const char *part, const char *name, size_t k, bool *found, VolError *err)
{
    VolVdbMetaList meta = {0};
    *found = false;
    if (!job->lit)
        return VOL_OK;
    VolStatus status = meta_of_light(job, k, &meta, err);
    if (!status)
        status = vol_reuse_light(job->lit, part, &meta, name, job->writer, found, err);
    vol_meta_free(&meta);
    if (status == VOL_BAD_INPUT)
        vol_fail_within(err, status, "cannot reuse '%s'", vol_input_name(options.reuse));
    return status;
}

/* `values`: per leaf 512 times `channels`; `elsewhere`: the background. */
static VolStatus put_grid(Job *job, const char *name, const VolLightLattice *lattice, int channels, const float *values,
                          double elsewhere, size_t k, VolError *err)
{
    VolVdbNewGrid grid = {.name = name, .store = channels == 3 ? VOL_STORE_VEC3S : VOL_STORE_FLOAT,
                          .index_to_world = lattice->index_to_world,
                          .background = {elsewhere, elsewhere, elsewhere}, .grid_class = "unknown"};
    VolStatus status = meta_of_grid(job, lattice, k, &grid.meta, err);
    if (!status)
        status = vol_vdb_begin_grid(job->writer, &grid, err);
    vol_meta_free(&grid.meta);
    for (size_t i = 0; i < lattice->leaf_count && !status; i++)
        status = vol_vdb_put_leaf(job->writer, lattice->leaves[i].origin,
                                  values + i * VOL_LIGHT_LEAF_POINTS * (size_t)channels, lattice->leaves[i].active, err);
    if (!status)
        status = vol_vdb_end_grid(job->writer, err);
    return status;
}

/* ---- Methods ---- */

typedef struct Counts {
    VolShadowCounts rays;
    uint64_t points, leaves, reused;
} Counts;

static VolStatus solve_indirect(Job *job, const VolLightLattice *lattice, const char *name, size_t k, VolError *err)
{
    const VolConeOptions cone = {.angle = options.cone_angle, .blur_length = blur_length(job),
                                 .as_printed = options.as_printed, .threads = job->run->threads};
    size_t values = lattice->leaf_count * VOL_LIGHT_LEAF_POINTS;
    float *light = vol_alloc_zero(values, 3 * sizeof *light);
    VolStatus status = light ? VOL_OK : vol_fail_memory(err, values * 3 * sizeof *light);
    if (!status)
        status = vol_cone_on_lattice(&job->assembly.scene, &job->assembly.lights[k], lattice, &cone, light, err);
    if (status == VOL_USAGE)
        vol_fail_within(err, status, "light '%s'", options.light.words[k]);
    vol_stats_stage(job->run->stats, "indirect");
    if (!status)
        status = put_grid(job, name, lattice, 3, light, 0, k, err);
    free(light);
    return status;
}

static VolStatus indirect_of(Job *job, size_t k, VolError *err)
{
    VolLightLattice lattice;
    char name[40];
    bool found;
    snprintf(name, sizeof name, "light.%zu.indirect", k);
    VolStatus status = reuse(job, "indirect", name, k, &found, err);
    if (status || found)
        return status;
    status = vol_light_lattice_new(&job->assembly.scene, &job->assembly.lights[k], options.resolution, job->run->threads,
                                   &lattice, err);
    if (!status)
        status = solve_indirect(job, &lattice, name, k, err);
    vol_light_lattice_free(&lattice);
    return status;
}

static VolStatus shadow_of(Job *job, const VolPrepared *prepared, size_t k, const char *name, Counts *counts,
                           VolError *err)
{
    const VolLight *light = &job->assembly.lights[k];
    VolLightLattice lattice;
    int channels = vol_shadow_channels(&job->assembly.scene);
    VolStatus status = vol_light_lattice_new(&job->assembly.scene, light, options.resolution, job->run->threads, &lattice,
                                             err);
    VolShadow shadow = {.prepared = prepared, .light = light, .lattice = &lattice, .mask = &job->mask,
                        .absorption = options.absorption,
                        .threads = job->run->threads};
    size_t values = lattice.leaf_count * VOL_LIGHT_LEAF_POINTS;
    if (!status) {
        shadow.T = vol_alloc(values, (size_t)channels * sizeof *shadow.T);
        status = shadow.T ? VOL_OK : vol_fail_memory(err, values * (size_t)channels * sizeof *shadow.T);
    }
    if (!status)
        status = vol_shadow_rays(&shadow, &counts->rays, err);
    vol_stats_stage(job->run->stats, "shadows");
    if (!status)
        status = put_grid(job, name, &lattice, channels, shadow.T, 1, k, err);
    vol_stats_stage(job->run->stats, "encode");
    counts->points += lattice.points;
    counts->leaves += lattice.leaf_count;
    free(shadow.T);
    vol_light_lattice_free(&lattice);
    return status;
}

static VolStatus solve_shadow(Job *job, VolError *err)
{
    VolPrepared prepared;
    Counts counts = {0};
    VolStats *stats = job->run->stats;
    VolStatus status = vol_scene_prepare(&job->assembly.scene, &prepared, err);
    for (size_t k = 0; k < options.light.count && !status; k++) {
        char name[40];
        bool found;
        snprintf(name, sizeof name, "light.%zu.direct", k);
        status = reuse(job, "direct", name, k, &found, err);
        counts.reused += found;
        if (!status && !found)
            status = shadow_of(job, &prepared, k, name, &counts, err);
        if (!status && options.method == CONE)
            status = indirect_of(job, k, err);
        run_progress(job->run, (double)(k + 1) / (double)options.light.count);
    }
    vol_stats_count(stats, "lights", options.light.count);
    vol_stats_count(stats, "points", counts.points);
    vol_stats_count(stats, "leaves", counts.leaves);
    vol_stats_count(stats, "rays", counts.rays.rays);
    vol_stats_count(stats, "cells", (uint64_t)counts.rays.cells);
    vol_stats_count(stats, "skipped.solved_lights", counts.reused);
    vol_stats_count(stats, "skipped.rays", counts.rays.missed);
    vol_stats_count(stats, "skipped.bricks", prepared.space.bricks_skipped);
    vol_prepared_free(&prepared);
    return status;
}

static VolStatus total_of(Job *job, const VolPrepared *prepared, const VolLightLattice *lattice, VolError *err)
{
    const double edge = vol_volume_voxel(&job->assembly.volume), square = edge * edge;
    const VolPdeOptions pde = {.lights = job->assembly.lights, .light_count = options.light.count,
                               .spread = {options.scattering.x * square, options.scattering.y * square,
                                          options.scattering.z * square},
                               .absorption = options.absorption, .preview = options.preview,
                               .as_printed = options.as_printed, .sweeps = (int)options.sweeps,
                               .mask = job->mask_grid, .occluders = job->mask_grid ? &job->mask : NULL,
                               .threads = job->run->threads};
    size_t values = lattice->leaf_count * VOL_LIGHT_LEAF_POINTS;
    double residual = 0;
    float *light = vol_alloc_zero(values, 3 * sizeof *light);
    VolStatus status = light ? vol_pde_on_lattice(prepared, lattice, &pde, light, &residual, err)
                             : vol_fail_memory(err, values * 3 * sizeof *light);
    if (residual > 1e-4)
        vol_warn(&job->run->log, "light among blanks and occluders may be off by %.1g of its largest", residual);
    vol_stats_stage(job->run->stats, "light");
    if (!status)
        status = put_grid(job, "light.total", lattice, 3, light, 0, ALL_LIGHTS, err);
    free(light);
    return status;
}

static VolStatus solve_pde(Job *job, VolError *err)
{
    const VolLight everywhere = {.kind = VOL_LIGHT_SUN, .direction = {0, 0, 1}}; /* a spot's lattice would end at its cone */
    VolPrepared prepared;
    VolLightLattice lattice = {0};
    VolStatus status = vol_scene_prepare(&job->assembly.scene, &prepared, err);
    if (!status)
        status = vol_light_lattice_new(&job->assembly.scene, &everywhere, options.resolution, job->run->threads, &lattice,
                                       err);
    if (!status)
        status = total_of(job, &prepared, &lattice, err);
    vol_stats_count(job->run->stats, "lights", options.light.count);
    vol_stats_count(job->run->stats, "points", lattice.points);
    vol_light_lattice_free(&lattice);
    vol_prepared_free(&prepared);
    return status;
}

/* In the order of METHODS; `cone` has shadows, too. */
static const Method methods[] = {{"shadow", solve_shadow}, {"cone", solve_shadow}, {"pde", solve_pde}};

/* ---- The program ---- */

static void leave_out_blanks(Job *job)
{
    if (job->mask.volume.kind)
        job->assembly.scene.volume = job->mask.volume;
}

static VolStatus write_vdb(Job *job, VolError *err)
{
    VolBytes bytes = {0};
    VolStatus status = run_stamp_vdb(job->run, job->prior_history, (const uint64_t(*)[2])job->digests, job->digest_count,
                                     vol_vdb_writer_file_meta(job->writer), err);
    if (!status)
        status = vol_vdb_finish(job->writer, &bytes, err);
    vol_stats_stage(job->run->stats, "encode");
    if (!status)
        status = run_write(job->run, &bytes, true, err);
    vol_bytes_free(&bytes);
    return status;
}

static VolStatus work(Job *job, VolError *err)
{
    const Method *method = &methods[options.method];
    VolStatus status = vol_assemble_lights(&job->assembly, options.light.words, options.light.count, err);
    if (!status)
        status = read_appearance(job, err);
    if (!status)
        status = load_volume(job, err);
    if (!status)
        status = open_lit(job, err);
    if (!status)
        status = set_scene(job, err);
    if (!status)
        status = describe(job, method, err);
    if (!status)
        leave_out_blanks(job);
    if (!status)
        status = method->solve(job, err);
    return status ? status : write_vdb(job, err);
}

static VolStatus light_solve(const Run *run, VolError *err)
{
    Job job = {.run = run};
    VolStatus status = run_check_output(run, true, err);
    if (!status)
        status = check_options(run, err);
    run_warn_of_name(run, run->common->output, "VDB");
    if (!status)
        status = vol_vdb_writer_new(VOL_COMPRESS_BLOSC, &job.writer, err);
    if (!status)
        status = work(&job, err);
    vol_vdb_close(job.lit);
    vol_vdb_writer_free(job.writer);
    vol_meta_free(&job.meta);
    if (job.dark.intervals)
        vol_tf_compiled_free(&job.dark);
    vol_light_mask_free(&job.mask);
    vol_grid_free(job.mask_grid);
    vol_assembly_free(&job.assembly);
    free(job.prior_history);
    return status;
}

int main(int argc, char **argv)
{
    static const Program program = {.name = "light-solve",
                                    .summary = "solve for the light that reaches each place of a volume",
                                    .operands = "[IN.vdb]",
                                    .table = table,
                                    .rows = ROWS,
                                    .options = &options,
                                    .max_operands = 1,
                                    .main = light_solve};
    return program_main(&program, argc, argv);
}
