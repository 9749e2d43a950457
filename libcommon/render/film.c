#include "render/film.h"

#include <string.h>

typedef struct Out {
    const char **names;
    double *values;
    size_t count;
} Out;

static void put(Out *out, const char *const names[], const double values[], int count)
{
    for (int c = 0; c < count; c++) {
        out->names[out->count] = names[c];
        out->values[out->count++] = values[c];
    }
}

static const double *layer_values(const VolPixelValue *pixel, const VolLayerInfo *layer)
{
    return layer->kind == VOL_LAYER_OF_SUM ? pixel->sum[layer->sum]
           : layer->kind == VOL_LAYER_OF_DEPTH ? &pixel->depth
                                               : &pixel->cells;
}

size_t vol_film_channels(const VolFrame *frame, const VolPixelValue *pixel, const char *names[VOL_FILM_CHANNELS],
                         double values[VOL_FILM_CHANNELS])
{
    static const char *const rgb[] = {"R", "G", "B"}, *const mean[] = {"A"}, *const alpha[] = {"AR", "AG", "AB"};
    const VolScene *scene = frame->prepared->scene;
    Out out = {names, values, 0};
    put(&out, rgb, pixel->color, 3);
    put(&out, mean, &pixel->mean_alpha, 1);
    if (scene->tf->coloured)
        put(&out, alpha, pixel->alpha, 3);
    for (int n = 0; n < VOL_LAYERS; n++)
        if (vol_has_layer(scene->layers, (VolLayer)n))
            put(&out, vol_layers[n].channels, layer_values(pixel, &vol_layers[n]), vol_layers[n].components);
    for (size_t n = 0; n < frame->pass_count; n++) {
        const VolFramePass *pass = &frame->passes[n];
        const char *const pass_names[] = {pass->names[0], pass->names[1], pass->names[2]};
        put(&out, pass_names, pixel->pass[n], 3);
    }
    return out.count;
}

/* What stays float where half is asked for. */
static bool is_data(const char *channel)
{
    bool data = strcmp(channel, "A") == 0;
    for (int n = 0; n < VOL_LAYERS; n++)
        data = data || (vol_layers[n].kind != VOL_LAYER_OF_SUM && vol_layers[n].components &&
                        strcmp(channel, vol_layers[n].channels[0]) == 0);
    return data;
}

static VolStatus add_channels(const VolFrame *frame, bool half, VolPart *part, VolError *err)
{
    const char *names[VOL_FILM_CHANNELS];
    double values[VOL_FILM_CHANNELS];
    VolPixelValue none = {0};
    size_t count = vol_film_channels(frame, &none, names, values);
    for (size_t i = 0; i < count; i++) {
        VolChannel *channel;
        VolPixel type = half && !is_data(names[i]) ? VOL_PIXEL_HALF : VOL_PIXEL_FLOAT;
        VolStatus status = vol_part_add_channel(part, names[i], type, &channel, err);
        if (status)
            return status;
    }
    return VOL_OK;
}

static void find_planes(VolPart *part, VolFilm *film)
{
    const char *names[VOL_FILM_CHANNELS];
    double values[VOL_FILM_CHANNELS];
    VolPixelValue none = {0};
    film->channels = vol_film_channels(film->frame, &none, names, values);
    for (size_t c = 0; c < film->channels; c++)
        film->planes[c] = vol_part_channel(part, names[c])->data;
}

void vol_film_put(void *user, size_t index, const VolPixelValue *pixel)
{
    VolFilm *film = user;
    const char *names[VOL_FILM_CHANNELS];
    double values[VOL_FILM_CHANNELS];
    vol_film_channels(film->frame, pixel, names, values);
    for (size_t c = 0; c < film->channels; c++)
        film->planes[c][index] = (float)values[c];
}

VolStatus vol_film_begin(const VolFrame *frame, int64_t x0, int64_t y0, int64_t width, int64_t height, bool half,
                         VolImage *image, VolFilm *film, VolError *err)
{
    const VolCamera *camera = frame->camera;
    VolBox2 display = {0, 0, (int32_t)(camera->width - 1), (int32_t)(camera->height - 1)};
    VolBox2 data = {(int32_t)x0, (int32_t)y0, (int32_t)(x0 + width - 1), (int32_t)(y0 + height - 1)};
    VolPart *part;
    double world_to_camera[16], world_to_ndc[16];
    *image = (VolImage){0};
    *film = (VolFilm){.frame = frame};
    VolStatus status = vol_image_add_part(image, NULL, data, display, &part, err);
    if (!status)
        status = add_channels(frame, half, part, err);
    vol_camera_matrices(camera, world_to_camera, world_to_ndc);
    if (!status)
        status = vol_part_set_numbers(part, "worldToCamera", VOL_ATTR_M44F, world_to_camera, err);
    if (!status)
        status = vol_part_set_numbers(part, "worldToNDC", VOL_ATTR_M44F, world_to_ndc, err);
    if (!status)
        find_planes(part, film);
    else
        vol_image_free(image);
    return status;
}
