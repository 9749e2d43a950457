#include "render/light_layers.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/mem.h"

/* A scene with one part of the light. */
typedef struct VolLightLayer {
    VolScene scene;
    VolLit lit;
    VolLight *lights;
    VolPrepared prepared;
} VolLightLayer;

/* Light n of the scene and its grid. */
static void take_light(VolLightLayer *layer, const VolScene *scene, size_t n)
{
    layer->lights[layer->scene.light_count++] = scene->lights[n];
    layer->lit.grids[layer->lit.grid_count++] = scene->lit->grids[n];
}

static VolStatus begin_layer(VolLightLayer *layer, const VolScene *scene, VolError *err)
{
    VolStatus status = vol_lit_begin(scene->lit->grid_count, &layer->lit, err);
    if (status)
        return status;
    layer->lit.grid_count = 0;
    layer->lit.phase = scene->lit->phase;
    layer->scene = *scene;
    layer->scene.layers = 1u << VOL_LAYER_SCATTER;
    layer->scene.lit = &layer->lit;
    layer->scene.light_count = 0;
    layer->lights = vol_alloc(scene->light_count, sizeof *layer->lights);
    layer->scene.lights = layer->lights;
    return layer->lights ? VOL_OK : vol_fail_memory(err, scene->light_count * sizeof *layer->lights);
}

/* Its grids and lights are there: makes a pass of it. */
static VolStatus end_layer(VolLightLayers *all, const char *name, VolError *err)
{
    VolLightLayer *layer = &all->layers[all->count];
    VolFramePass *pass = &all->passes[all->count++];
    vol_lit_settle(&layer->lit, &layer->scene.volume);
    for (int c = 0; c < 3; c++)
        snprintf(pass->names[c], sizeof pass->names[c], "%s.%c", name, "RGB"[c]);
    pass->prepared = &layer->prepared;
    return vol_scene_prepare(&layer->scene, &layer->prepared, err);
}

static VolStatus make_direct(const VolScene *scene, const int *number, int k, VolLightLayers *all, VolError *err)
{
    char name[16];
    VolLightLayer *layer = &all->layers[all->count];
    VolStatus status = begin_layer(layer, scene, err);
    for (size_t n = 0; n < scene->light_count && !status; n++)
        if (number[n] == k)
            take_light(layer, scene, n);
    snprintf(name, sizeof name, "direct.%d", k);
    return status ? status : end_layer(all, name, err);
}

static VolStatus make_indirect(const VolScene *scene, VolLightLayers *all, VolError *err)
{
    VolLightLayer *layer = &all->layers[all->count];
    VolStatus status = begin_layer(layer, scene, err);
    for (size_t n = vol_lit_direct_count(scene); n < scene->lit->grid_count && !status; n++)
        layer->lit.grids[layer->lit.grid_count++] = scene->lit->grids[n];
    return status ? status : end_layer(all, "indirect", err);
}

static VolStatus check(const VolScene *scene, VolError *err)
{
    if (!scene->lit)
        return vol_fail(err, VOL_USAGE, "--aov direct and indirect want light grids in the input");
    if (scene->lit->total)
        return vol_fail(err, VOL_USAGE, "--aov direct and indirect: the input has the total of light alone");
    return VOL_OK;
}

VolStatus vol_light_layers_make(const VolScene *scene, const int *number, VolLightLayers *out, VolError *err)
{
    bool direct = vol_has_layer(scene->layers, VOL_LAYER_DIRECT);
    bool indirect = vol_has_layer(scene->layers, VOL_LAYER_INDIRECT);
    *out = (VolLightLayers){0};
    if (!direct && !indirect)
        return VOL_OK;
    VolStatus status = check(scene, err);
    if (status)
        return status;
    out->layers = vol_alloc_zero(VOL_PASSES, sizeof *out->layers);
    out->passes = vol_alloc_zero(VOL_PASSES, sizeof *out->passes);
    if (!out->layers || !out->passes)
        return vol_fail_memory(err, VOL_PASSES * sizeof *out->layers);
    for (size_t n = 0; n < scene->light_count && direct && !status; n++) {
        if (n > 0 && number[n] == number[n - 1]) /* they ascend */
            continue;
        if (out->count == VOL_PASSES - 1)
            return vol_fail(err, VOL_USAGE, "--aov direct: there are more than %d lights", VOL_PASSES - 1);
        status = make_direct(scene, number, number[n], out, err);
    }
    if (!status && indirect)
        status = make_indirect(scene, out, err);
    return status;
}

void vol_light_layers_free(VolLightLayers *layers)
{
    for (size_t n = 0; n < VOL_PASSES && layers->layers; n++) {
        vol_prepared_free(&layers->layers[n].prepared);
        vol_lit_free(&layers->layers[n].lit);
        free(layers->layers[n].lights);
    }
    free(layers->layers);
    free(layers->passes);
    *layers = (VolLightLayers){0};
}
