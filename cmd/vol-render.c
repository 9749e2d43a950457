/* vol-render: VDB and a transfer function in, the image out as EXR. */
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/hash.h"
#include "base/memory.h"
#include "cmd/shell/program.h"
#include "cmd/shell/stamp.h"
#include "io/exr.h"
#include "io/vdb.h"
#include "load/assembly.h"
#include "load/grids.h"
#include "render/backdrop.h"
#include "render/camera.h"
#include "render/film.h"
#include "render/frame.h"
#include "render/light_layers.h"
#include "render/probe.h"
#include "tf/foreign.h"

typedef struct Options {
    const char *tf, *grid, *camera, *aov, *background;
    int estimator, depth, integrator;
    bool precise, skip;
    VolLen step;
    VolLen particle_step;
    double scalar_step, fov, ortho;
    VolSize2 size;
    VolCrop crop;
    VolVec3 eye, look_at, up;
    int64_t samples;
    VolTextList probe, clip, light;
} Options;

static Options options;

#define AT(field) offsetof(Options, field)

static const VolOpt table[] = {
    {.letter = 't', .name = "tf", .kind = VOL_OPT_TEXT, .offset = AT(tf), .value_name = "FILE[#NAME]", .input = true,
     .help = "transfer function or tables (required); NAME: one of several in the file"},
    {0, "grid", VOL_OPT_TEXT, AT(grid), "NAME", NULL, "grid to render (density, or the only scalar one)"},
    {0, "estimator", VOL_OPT_CHOICE, AT(estimator), NULL, "exact", "how rays are integrated",
     "exact|full|integrals|direct"},
    {0, "integrator", VOL_OPT_CHOICE, AT(integrator), NULL, "march", "how light is found", "march"},
    {0, "step", VOL_OPT_LENGTH, AT(step), "LEN", "1v", "step of estimators that march: 0.5v (voxels), 0.1w (world units)"},
    {0, "precise", VOL_OPT_FLAG, AT(precise), NULL, NULL, "in double precision"},
    {0, "particle-step", VOL_OPT_WORLD_LENGTH, AT(particle_step), "LEN", NULL,
     "overrides the file's particle_step: 2 (world units), 1v (voxels)"},
    {0, "scalar-step", VOL_OPT_REAL, AT(scalar_step), "DV", NULL, "overrides the file's scalar_step, units of the field"},
    {0, "size", VOL_OPT_SIZE, AT(size), "WxH", "512x512", "size of the picture in pixels"},
    {0, "eye", VOL_OPT_VEC3, AT(eye), "X,Y,Z", NULL, "where the camera is (from +z, all in view)"},
    {0, "look-at", VOL_OPT_VEC3, AT(look_at), "X,Y,Z", NULL, "the point looked at (the middle of the volume)"},
    {0, "up", VOL_OPT_VEC3, AT(up), "X,Y,Z", "0,1,0", "upwards in the picture"},
    {0, "fov", VOL_OPT_REAL, AT(fov), "DEG", "40", "vertical angle of view"},
    {0, "ortho", VOL_OPT_REAL, AT(ortho), "HEIGHT", NULL, "orthographic, this high in world units"},
    {.name = "camera", .kind = VOL_OPT_TEXT, .offset = AT(camera), .value_name = "FILE", .input = true,
     .help = "the camera of an EXR file's worldToCamera and worldToNDC"},
    {0, "samples", VOL_OPT_INT, AT(samples), "N", "1", "N x N rays per pixel, at the centres of its strata"},
    {.name = "probe", .kind = VOL_OPT_LIST, .offset = AT(probe), .value_name = "X,Y", .unrecorded = true,
     .help = "no image: the pixel's channels as JSON on stdout (repeatable; -v traces)"},
    {.name = "crop", .kind = VOL_OPT_CROP, .offset = AT(crop), .value_name = "WxH+X+Y", .unrecorded = true,
     .help = "only this part of the picture, as the data window"},
    {0, "clip", VOL_OPT_LIST, AT(clip), "NX,NY,NZ,D", NULL, "keep n.x >= D, world units (repeatable)"},
    {.name = "background", .kind = VOL_OPT_TEXT, .offset = AT(background), .value_name = "R,G,B|FILE", .fallback = "0,0,0",
     .input = true, .help = "what lies behind: a colour or a picture of the same size"},
    {0, "light", VOL_OPT_LIST, AT(light), "SPEC", NULL,
     "sun:DX,DY,DZ[:R,G,B], point:.., spot:.. (repeatable; none: headlight)"},
    {0, "aov", VOL_OPT_TEXT, AT(aov), "LIST", NULL, "layers: Z,normal,surface,scatter,emit,steps,direct,indirect"},
    {0, "depth", VOL_OPT_CHOICE, AT(depth), NULL, "float", "channels' type; half clamps and counts", "float|half"},
    {.name = "skip", .kind = VOL_OPT_FLAG, .offset = AT(skip), .fallback = "yes", .hidden = true, .unrecorded = true,
     .help = "leave out what cannot be seen"},
};
enum { ROWS = sizeof table / sizeof *table, TABLE_NODES = 512 };

/* Everything the picture is made from. */
typedef struct Job {
    const Run *run;
    VolAssembly assembly;
    VolPrepared prepared; /* of the assembly's scene */
    VolCamera camera;
    float *picture; /* the background, if it is one */
    VolFrame frame;
    VolLightLayers light_layers;
    uint64_t digests[5][2]; /* of the transfer function and its name in the file, the volume, the camera, the background */
    size_t digest_count;
    bool told_why; /* a warning has given the reason for a picture of nothing */
    char *prior_history;
} Job;

static void add_digest(Job *job, const VolBytes *bytes)
{
    vol_hash_bytes(bytes->data, bytes->size, job->digests[job->digest_count++]);
}

static void add_text_digest(Job *job, const char *text)
{
    vol_hash_bytes(text, strlen(text), job->digests[job->digest_count++]);
}

/* All that is taken of its file. */
static void add_camera_digest(Job *job, const VolAttr *to_camera, const VolAttr *to_ndc)
{
    char text[32 * 24];
    size_t length = 0;
    for (int i = 0; i < 32; i++)
        length += (size_t)snprintf(text + length, sizeof text - length, "%.9g ",
                                   (i < 16 ? to_camera : to_ndc)->number[i % 16]);
    add_text_digest(job, text);
}

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
        add_digest(job, &bytes);
        if (part)
            add_text_digest(job, part);
        status = run_refuse_volume(&bytes, vol_input_name(file), err);
        if (!status)
            status = vol_appearance_read(&bytes, vol_input_name(file), part, &job->run->log, &job->assembly.appearance, err);
        vol_bytes_free(&bytes);
    }
    free(file);
    return status;
}

static double world_length(const Job *job, VolLen length)
{
    return length.value * (length.voxels ? vol_volume_voxel(&job->assembly.volume) : 1);
}

static VolStatus refuse_step(const Job *job, VolError *err)
{
    double of_unit = vol_appearance_steps(&job->assembly.volume, world_length(job, (VolLen){1, options.step.voxels}));
    const char *unit = options.step.voxels ? "v" : "w";
    return vol_fail(err, VOL_USAGE,
                    "--step %g%s: a ray through the whole volume would take %.3g steps, more than %g: give %.2g%s or more",
                    options.step.value, unit, of_unit / options.step.value, VOL_MOST_STEPS,
                    1.01 * of_unit / VOL_MOST_STEPS, unit);
}

/* Fits it to the volume. */
static VolStatus fit_appearance(Job *job, VolError *err)
{
    VolScene *scene = &job->assembly.scene;
    if (run_given(job->run, "particle-step") && !(options.particle_step.value > 0))
        return vol_fail(err, VOL_USAGE, "--particle-step wants a length above 0");
    if (run_given(job->run, "scalar-step") && !(options.scalar_step > 0))
        return vol_fail(err, VOL_USAGE, "--scalar-step wants a value above 0");
    scene->estimator = (VolEstimator)options.estimator;
    scene->step = world_length(job, options.step);
    if (!(scene->step > 0))
        return vol_fail(err, VOL_USAGE, "--step wants a length above 0");
    if (scene->estimator != VOL_ESTIMATE_EXACT && vol_appearance_steps(&job->assembly.volume, scene->step) > VOL_MOST_STEPS)
        return refuse_step(job, err);
    VolAppearanceSettings settings = {.particle_step = world_length(job, options.particle_step),
                                      .scalar_step = options.scalar_step,
                                      .full = scene->estimator == VOL_ESTIMATE_FULL,
                                      .integrals = scene->estimator == VOL_ESTIMATE_INTEGRALS,
                                      .step = scene->step,
                                      .nodes = TABLE_NODES,
                                      .threads = job->run->threads,
                                      .cpu = job->run->cpu};
    VolStatus status = vol_assemble_appearance(&job->assembly, &settings, &job->run->log, err);
    vol_stats_stage(job->run->stats, "tables");
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

/* Whether the transfer function has anything that light falls on. */
static bool is_lit_up(const VolTf *tf) { return tf->scatter.count || tf->surface.count || tf->isosurface_count; }

static VolStatus load_light(Job *job, const VolVdb *vdb, VolError *err)
{
    if (!vol_has_light_grids(vdb))
        return VOL_OK;
    if (options.light.count)
        return vol_fail(err, VOL_USAGE, "--light together with light grids: they say where light comes from");
    if (!is_lit_up(&job->assembly.appearance.tf))
        return VOL_OK;
    VolStatus status = vol_load_light_grids(vdb, job->run->threads, &job->run->log, &job->assembly.light_grids, err);
    if (status && status != VOL_USAGE && !strstr(err->text, vol_input_name(run_input(job->run))))
        vol_fail_within(err, status, "cannot read '%s'", vol_input_name(run_input(job->run)));
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
    add_digest(job, &bytes);
    vol_stats_stage(job->run->stats, "read");
    status = vol_vdb_open(bytes, vol_input_name(path), &vdb, err);
    if (!status)
        status = keep_history(job, vdb, err);
    if (!status)
        status = load_light(job, vdb, err);
    if (!status) {
        status = vol_load_volume(vdb, options.grid, options.precise, job->run->threads, &job->run->log,
                                 &job->assembly.volume, err);
        if (status && !strstr(err->text, vol_input_name(path)))
            vol_fail_within(err, status, "cannot read '%s'", vol_input_name(path));
    }
    vol_vdb_close(vdb);
    vol_stats_stage(job->run->stats, "load");
    return status;
}

static VolStatus set_lights(Job *job, VolError *err)
{
    const VolTextList *lights = &options.light;
    VolStatus status = vol_assemble_lights(&job->assembly, lights->words, lights->count, err);
    if (!status)
        status = vol_assemble_light_grids(&job->assembly, err);
    const VolTfCompiled *tf = job->assembly.scene.tf;
    if (!status && lights->count && (tf->has_scatter || tf->has_emit) && tf->model == VOL_MODEL_HYBRID)
        vol_warn(&job->run->log, "--light shades surfaces only: without light grids particles stay unlit");
    return status;
}

/* The camera of another picture: the matrices of the first part that has them. */
static VolStatus camera_from_file(Job *job, VolError *err)
{
    VolBytes bytes;
    VolImage image;
    VolStatus status = run_read(job->run, options.camera, &bytes, err);
    if (status)
        return status;
    status = vol_exr_read_header(&bytes, vol_input_name(options.camera), &image, err);
    vol_bytes_free(&bytes);
    if (status)
        return status;
    const VolAttr *to_camera = NULL, *to_ndc = NULL;
    for (size_t p = 0; p < image.part_count && !(to_camera && to_ndc); p++) {
        to_camera = vol_part_attr(&image.parts[p], "worldToCamera");
        to_ndc = vol_part_attr(&image.parts[p], "worldToNDC");
    }
    if (!to_camera || !to_ndc || to_camera->type != VOL_ATTR_M44F || to_ndc->type != VOL_ATTR_M44F)
        status = vol_fail(err, VOL_BAD_INPUT, "it has no worldToCamera and worldToNDC");
    else
        status = vol_camera_from_matrices(to_camera->number, to_ndc->number, options.size.width, options.size.height,
                                          &job->camera, err);
    if (!status)
        add_camera_digest(job, to_camera, to_ndc);
    vol_image_free(&image);
    return status ? vol_fail_within(err, status, "cannot use the camera of '%s'", vol_input_name(options.camera)) : VOL_OK;
}

static VolStatus set_camera(Job *job, VolError *err)
{
    const Run *run = job->run;
    VolStatus status;
    if (options.camera) {
        if (run_given(run, "eye") || run_given(run, "look-at") || run_given(run, "ortho") || run_given(run, "fov") ||
            run_given(run, "up"))
            return vol_fail(err, VOL_USAGE, "--camera together with --eye, --look-at, --up, --fov or --ortho");
        status = camera_from_file(job, err);
    } else {
        if (run_given(run, "ortho") && run_given(run, "fov"))
            return vol_fail(err, VOL_USAGE, "--ortho together with --fov");
        VolCameraSettings settings = {
            .width = options.size.width, .height = options.size.height, .has_eye = run_given(run, "eye"),
            .has_look_at = run_given(run, "look-at"), .has_up = run_given(run, "up"), .eye = options.eye,
            .look_at = options.look_at, .up = options.up, .orthographic = run_given(run, "ortho"),
            .fov_degrees = options.fov, .ortho_height = options.ortho};
        status = vol_camera_set(&settings, &job->assembly.volume, &job->camera, err);
    }
    job->told_why = !status && vol_camera_behind(&job->camera, &job->assembly.volume);
    if (job->told_why)
        vol_warn(&run->log, "the volume lies behind the camera");
    return status;
}

static VolStatus set_backdrop(Job *job, VolError *err)
{
    double *color = job->frame.backdrop.color;
    bool is_file;
    VolStatus status = vol_backdrop_parse(options.background, access(options.background, F_OK) == 0, color, &is_file, err);
    if (status || !is_file) {
        add_text_digest(job, options.background);
        job->assembly.scene.background_max = fmax(fabs(color[0]), fmax(fabs(color[1]), fabs(color[2])));
        return status;
    }
    VolBytes bytes;
    VolPixels pixels;
    const char *name = vol_input_name(options.background);
    status = run_read(job->run, options.background, &bytes, err);
    if (status)
        return status;
    add_digest(job, &bytes);
    status = vol_pixels_read(&bytes, name, VOL_PIXELS_COLOR, &job->run->log, &pixels, err);
    vol_bytes_free(&bytes);
    if (!status)
        status = vol_backdrop_fit(&pixels, name, options.size.width, options.size.height, &job->run->log, &job->picture,
                                  &job->assembly.scene.background_max, err);
    vol_pixels_free(&pixels);
    job->frame.backdrop.picture = job->picture;
    return status;
}

/* Fainter than this, nothing is seen on most screens. */
#define FAINT 0.02

/* Almost black ones, too, when all of the frame has been rendered. */
static void warn_of_faintness(const Job *job, const VolFrameCounts *counts)
{
    const VolTfCompiled *tf = job->assembly.scene.tf;
    const VolLog *log = &job->run->log;
    const char *faint = "the picture is nearly empty: nothing is brighter or more opaque";
    double step = job->assembly.appearance.tf.particle_step;
    if (job->told_why || counts->strongest >= FAINT)
        return;
    if (!(counts->strongest > 0))
        vol_warn(log, "the picture is empty: no ray meets anything that the transfer function shows");
    else if (tf->has_scatter || tf->has_absorb || tf->has_emit)
        vol_warn(log, "%s than %.2g; opacities hold for %g world units, %.3g voxels (--particle-step)", faint,
                 counts->strongest, step, step / vol_volume_voxel(&job->assembly.volume));
    else
        vol_warn(log, "%s than %.2g", faint, counts->strongest);
}

static VolStatus set_scene(Job *job, VolError *err)
{
    VolScene *scene = &job->assembly.scene;
    scene->precise = options.precise;
    scene->skip = options.skip;
    scene->cpu = job->run->cpu;
    if (options.samples < 1 || options.samples > 1024)
        return vol_fail(err, VOL_USAGE, "--samples wants 1 to 1024");
    VolStatus status = options.aov ? vol_layers_parse(options.aov, &scene->layers, err) : VOL_OK;
    if (!status)
        status = set_lights(job, err);
    if (!status)
        status = vol_assemble_clips(&job->assembly, options.clip.words, options.clip.count, err);
    if (!status)
        status = set_camera(job, err);
    if (!status)
        status = set_backdrop(job, err);
    if (!status)
        status = vol_scene_prepare(scene, &job->prepared, err);
    if (!status && vol_assembly_explains_nothing(&job->assembly, &job->run->log))
        job->told_why = true;
    if (!status)
        status = vol_light_layers_make(scene, job->assembly.light_grids.number, &job->light_layers, err);
    job->frame.passes = job->light_layers.passes;
    job->frame.pass_count = job->light_layers.count;
    job->frame.prepared = &job->prepared;
    job->frame.camera = &job->camera;
    job->frame.samples = (int)options.samples;
    return status;
}

static VolStatus probe(Job *job, VolError *err)
{
    VolBytes text;
    VolStatus status = vol_probe_json(&job->frame, options.probe.words, options.probe.count,
                                      job->run->common->verbose > 0, &text, err);
    if (!status)
        status = run_write_to(job->run, "-", &text, false, err);
    return status;
}

static VolStatus check_crop(VolCrop *crop, VolError *err)
{
    if (!crop->width)
        *crop = (VolCrop){options.size.width, options.size.height, 0, 0};
    if (crop->x < 0 || crop->y < 0 || crop->x + crop->width > options.size.width ||
        crop->y + crop->height > options.size.height)
        return vol_fail(err, VOL_USAGE, "--crop %" PRId64 "x%" PRId64 "+%" PRId64 "+%" PRId64 " reaches beyond the picture",
                        crop->width, crop->height, crop->x, crop->y);
    return VOL_OK;
}

static void show_progress(void *user, double fraction)
{
    run_progress(user, fraction);
}

static void count_work(const Job *job, const VolFrameCounts *counts)
{
    VolStats *stats = job->run->stats;
    const VolSkipped *skipped = &counts->skipped;
    const VolVolumeCounts held = vol_volume_counts(&job->assembly.volume);
    bool exact = options.estimator == 0;
    char features[200];
    vol_stats_count(stats, "rays", counts->rays);
    vol_stats_count(stats, exact ? "cells" : "samples", counts->cells);
    if (!exact)
        vol_stats_count(stats, "steps", counts->steps);
    vol_stats_count(stats, "active_voxels", held.active_voxels);
    vol_stats_count(stats, "bricks.total", held.parts);
    vol_stats_count(stats, "bricks.stored", held.stored_parts);
    vol_stats_count(stats, "bricks.entered", skipped->bricks_entered);
    vol_stats_count(stats, "skipped.bricks", job->prepared.space.bricks_skipped);
    vol_stats_count(stats, "skipped.blocks", skipped->blocks);
    vol_stats_count(stats, exact ? "skipped.cells" : "skipped.samples",
                    skipped->cells_met > counts->cells ? skipped->cells_met - counts->cells : 0);
    vol_stats_count(stats, "skipped.rays", counts->rays_missed);
    vol_stats_count(stats, "skipped.ends_of_rays", skipped->rays_ended);
    vol_stats_count(stats, "rays_in_double", skipped->rays_in_double);
    vol_features_skipped(&job->prepared, features, sizeof features);
    vol_stats_text(stats, "skipped.features", features);
    vol_stats_real(stats, "termination_opacity", job->prepared.termination_opacity);
}

static VolStatus write_image(Job *job, VolImage *image, VolError *err)
{
    VolBytes bytes = {0};
    uint64_t clamped = 0;
    VolStatus status = run_stamp_exr(job->run, job->prior_history, (const uint64_t(*)[2])job->digests, job->digest_count,
                                     image, err);
    if (!status)
        status = vol_exr_write(image, VOL_EXR_ZIP, job->run->threads, &bytes, &clamped, err);
    if (clamped)
        vol_warn(&job->run->log, "%" PRIu64 " values lay beyond half's range and were clamped to 65504", clamped);
    vol_stats_count(job->run->stats, "half_clamped", clamped);
    vol_stats_stage(job->run->stats, "encode");
    if (!status)
        status = run_write(job->run, &bytes, true, err);
    vol_bytes_free(&bytes);
    vol_stats_stage(job->run->stats, "write");
    return status;
}

static VolStatus render(Job *job, VolError *err)
{
    VolCrop crop = options.crop;
    VolFrameCounts counts;
    VolImage image;
    VolStatus status = check_crop(&crop, err);
    if (status)
        return status;
    VolFilm film;
    status = vol_film_begin(&job->frame, crop.x, crop.y, crop.width, crop.height, options.depth == 1, &image, &film, err);
    if (status)
        return vol_fail_within(err, status, "--size %" PRId64 "x%" PRId64, options.size.width, options.size.height);
    vol_stats_stage(job->run->stats, "prepare");
    VolFrameJob all = {.frame = &job->frame,
                       .x0 = crop.x,
                       .y0 = crop.y,
                       .width = crop.width,
                       .height = crop.height,
                       .threads = job->run->threads,
                       .put = vol_film_put,
                       .put_user = &film,
                       .progress = show_progress,
                       .progress_user = (void *)job->run};
    status = vol_frame_render(&all, &counts, err);
    vol_stats_stage(job->run->stats, "render");
    count_work(job, &counts);
    if (!status && crop.width == options.size.width && crop.height == options.size.height)
        warn_of_faintness(job, &counts);
    if (!status)
        status = write_image(job, &image, err);
    vol_image_free(&image);
    return status;
}

static void warn_of_unused(const Run *run)
{
    if (options.estimator == VOL_ESTIMATE_EXACT && run_given(run, "step"))
        vol_warn(&run->log, "--step has no effect: the estimator exact takes no steps (full, integrals and direct do)");
    if (options.probe.count && (run_given(run, "crop") || run_given(run, "depth")))
        vol_warn(&run->log, "--%s has no effect: with --probe there is no image", run_given(run, "crop") ? "crop" : "depth");
}

static void warn_of_unused_steps(const Job *job)
{
    const VolTf *tf = &job->assembly.appearance.tf;
    if (run_given(job->run, "particle-step") && !tf->scatter.count && !tf->absorb.count && !tf->emit.count)
        vol_warn(&job->run->log, "--particle-step has no effect: the transfer function has no particles");
    if (run_given(job->run, "scalar-step") && !tf->surface.count)
        vol_warn(&job->run->log, "--scalar-step has no effect: the transfer function has no soft surfaces");
}

/* Before anything is read: whether there is memory for R, G, B and A at least. */
static VolStatus check_size(const Run *run, VolError *err)
{
    enum { LEAST = 4 * sizeof(float), MOST_ACROSS = 1 << 20 };
    VolCrop part = options.crop;
    if (options.size.width > MOST_ACROSS || options.size.height > MOST_ACROSS)
        return vol_fail(err, VOL_USAGE, "--size %" PRId64 "x%" PRId64 ": more than %d pixels across", options.size.width,
                        options.size.height, MOST_ACROSS);
    VolStatus status = options.probe.count ? VOL_OK : check_crop(&part, err);
    if (status || options.probe.count)
        return status;
    status = vol_check_memory((double)part.width * (double)part.height * LEAST, err);
    if (!status)
        return VOL_OK;
    return vol_fail_within(err, status, "--%s %" PRId64 "x%" PRId64 " (--crop renders parts)",
                           run_given(run, "crop") ? "crop" : "size", part.width, part.height);
}

static VolStatus vol_render(const Run *run, VolError *err)
{
    Job job = {.run = run};
    VolStatus status = options.probe.count ? VOL_OK : run_check_output(run, true, err);
    warn_of_unused(run);
    if (!status)
        status = check_size(run, err);
    if (!status && !options.probe.count)
        run_warn_of_name(run, run->common->output, "EXR");
    if (!status)
        status = read_appearance(&job, err);
    if (!status)
        status = load_volume(&job, err);
    if (!status)
        status = fit_appearance(&job, err);
    if (!status)
        warn_of_unused_steps(&job);
    if (!status)
        status = set_scene(&job, err);
    if (!status)
        status = options.probe.count ? probe(&job, err) : render(&job, err);
    vol_light_layers_free(&job.light_layers);
    vol_prepared_free(&job.prepared);
    vol_assembly_free(&job.assembly);
    free(job.picture);
    free(job.prior_history);
    return status;
}

int main(int argc, char **argv)
{
    static const Program program = {.name = "vol-render",
                                    .summary = "render a volume to an EXR image",
                                    .operands = "[IN.vdb]",
                                    .table = table,
                                    .rows = ROWS,
                                    .options = &options,
                                    .max_operands = 1,
                                    .main = vol_render};
    return program_main(&program, argc, argv);
}
