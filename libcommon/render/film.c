#include "render/film.h"

#include <string.h>

static const struct {
    const char *name;
    unsigned bit;
} layer_names[] = {{"Z", VOL_LAYER_Z},             {"normal", VOL_LAYER_NORMAL}, {"surface", VOL_LAYER_SURFACE},
                   {"scatter", VOL_LAYER_SCATTER}, {"emit", VOL_LAYER_EMIT},     {"steps", VOL_LAYER_STEPS}};

VolStatus vol_layers_parse(const char *list, unsigned *layers, VolError *err)
{
    *layers = 0;
    for (const char *at = list; *at;) {
        size_t length = strcspn(at, ","), i, count = sizeof layer_names / sizeof *layer_names;
        for (i = 0; i < count; i++)
            if (strlen(layer_names[i].name) == length && memcmp(layer_names[i].name, at, length) == 0)
                break;
        if (i == count)
            return vol_fail(err, VOL_USAGE, "--aov: no layer '%.*s' (Z, normal, surface, scatter, emit, steps)", (int)length,
                            at);
        *layers |= layer_names[i].bit;
        at += length;
        if (*at == ',' && !*++at)
            return vol_fail(err, VOL_USAGE, "--aov: '%s' ends with a comma", list);
    }
    return VOL_OK;
}

typedef struct Out {
    const char **names;
    double *values;
    size_t count;
} Out;

static void put(Out *out, const char *name, double value)
{
    out->names[out->count] = name;
    out->values[out->count++] = value;
}

static void put3(Out *out, const char *const names[3], const double values[3])
{
    for (int c = 0; c < 3; c++)
        put(out, names[c], values[c]);
}

size_t vol_film_channels(const VolFrame *frame, const VolPixelValue *pixel, const char *names[VOL_FILM_CHANNELS],
                         double values[VOL_FILM_CHANNELS])
{
    static const char *const rgb[] = {"R", "G", "B"}, *const alpha[] = {"AR", "AG", "AB"},
                             *const normal[] = {"normal.X", "normal.Y", "normal.Z"},
                             *const surface[] = {"surface.R", "surface.G", "surface.B"},
                             *const scatter[] = {"scatter.R", "scatter.G", "scatter.B"},
                             *const emit[] = {"emit.R", "emit.G", "emit.B"};
    unsigned layers = frame->scene->layers;
    Out out = {names, values, 0};
    put3(&out, rgb, pixel->color);
    put(&out, "A", pixel->mean_alpha);
    if (frame->scene->tf->coloured)
        put3(&out, alpha, pixel->alpha);
    if (layers & VOL_LAYER_Z)
        put(&out, "Z", pixel->depth);
    if (layers & VOL_LAYER_NORMAL)
        put3(&out, normal, pixel->normal);
    if (layers & VOL_LAYER_SURFACE)
        put3(&out, surface, pixel->surface);
    if (layers & VOL_LAYER_SCATTER)
        put3(&out, scatter, pixel->scatter);
    if (layers & VOL_LAYER_EMIT)
        put3(&out, emit, pixel->emit);
    if (layers & VOL_LAYER_STEPS)
        put(&out, "steps", pixel->cells);
    return out.count;
}

static VolStatus add_channels(const VolFrame *frame, bool half, VolPart *part, VolError *err)
{
    const char *names[VOL_FILM_CHANNELS];
    double values[VOL_FILM_CHANNELS];
    VolPixelValue none = {0};
    size_t count = vol_film_channels(frame, &none, names, values);
    for (size_t i = 0; i < count; i++) {
        bool data = strcmp(names[i], "Z") == 0 || strcmp(names[i], "A") == 0 || strcmp(names[i], "steps") == 0;
        VolChannel *channel;
        VolStatus status =
            vol_part_add_channel(part, names[i], half && !data ? VOL_PIXEL_HALF : VOL_PIXEL_FLOAT, &channel, err);
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
