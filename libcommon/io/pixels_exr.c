#include "io/pixels_exr.h"

#include <ctype.h>
#include <string.h>
#include <strings.h>

/* What a channel's name ends with, and what comes before the last dot. */
static const char *last_name(const char *name)
{
    const char *dot = strrchr(name, '.');
    return dot ? dot + 1 : name;
}

static size_t layer_length(const char *name)
{
    size_t tail = strlen(last_name(name)), all = strlen(name);
    return all > tail ? all - tail - 1 : 0;
}

static bool one_of(const char *name, size_t length, const char *const *list, size_t count)
{
    for (size_t i = 0; i < count; i++)
        if (strlen(list[i]) == length && strncasecmp(name, list[i], length) == 0)
            return true;
    return false;
}

static bool has_name(const VolChannel *channel, const char *const *list, size_t count)
{
    const char *name = last_name(channel->name);
    return one_of(name, strlen(name), list, count);
}

#define NAMED(channel, ...) \
    has_name(channel, (const char *const[]){__VA_ARGS__}, sizeof((const char *const[]){__VA_ARGS__}) / sizeof(char *))

/* 0 to 3: R, G, B, A; -1: none of them. */
static int color_index(const VolChannel *channel)
{
    return NAMED(channel, "R", "red") ? 0 : NAMED(channel, "G", "green") ? 1 : NAMED(channel, "B", "blue") ? 2
           : NAMED(channel, "A", "alpha") ? 3 : -1;
}

static bool same_layer(const VolChannel *a, const VolChannel *b)
{
    size_t length = layer_length(a->name);
    return layer_length(b->name) == length && strncmp(a->name, b->name, length) == 0;
}

/* The first of the layer's channels that is colour `index`. */
static const VolChannel *color_of(const VolPart *part, const VolChannel *layer, int index)
{
    for (size_t i = 0; i < part->channel_count; i++)
        if (color_index(&part->channels[i]) == index && same_layer(&part->channels[i], layer))
            return &part->channels[i];
    return NULL;
}

static bool layer_has(const VolPart *part, const VolChannel *layer, const char *name)
{
    for (size_t i = 0; i < part->channel_count; i++)
        if (same_layer(&part->channels[i], layer) && strcasecmp(last_name(part->channels[i].name), name) == 0)
            return true;
    return false;
}

/* Luminance stands alone: Y beside X is a coordinate, beside RY and BY it is a third of a colour. */
static bool is_luminance(const VolPart *part, const VolChannel *channel)
{
    return NAMED(channel, "Y", "L", "luminance", "gray", "grey") && !layer_has(part, channel, "X") &&
           !layer_has(part, channel, "RY") && !layer_has(part, channel, "BY");
}

/* The whole picture of a renderer, as programs call it. */
static bool is_beauty(const char *name, size_t length)
{
    static const char *const names[] = {"rgba", "rgb", "beauty", "combined", "color", "colour", "main", "image"};
    size_t start = length;
    while (start > 0 && name[start - 1] != '.')
        start--;
    return one_of(name + start, length - start, names, sizeof names / sizeof *names);
}

/* The name without case, number at its end, or what stands between words: "AOV_depth01" is depth. */
static size_t plain_name(const char *name, size_t length, char *plain, size_t room)
{
    size_t n = 0;
    for (size_t i = 0; i < length && n + 1 < room; i++)
        if (isalnum((unsigned char)name[i]))
            plain[n++] = (char)tolower((unsigned char)name[i]);
    while (n > 0 && isdigit((unsigned char)plain[n - 1]))
        n--;
    if (n > 3 && memcmp(plain, "aov", 3) == 0)
        memmove(plain, plain + 3, n -= 3);
    plain[n] = 0;
    return n;
}

/* A layer, or a part, that is named after something other than colours. */
static bool is_data(const char *name, size_t length)
{
    static const char *const names[] = {
        "depth", "z", "zdepth", "depthz", "worlddepth", "distance", "n", "ng", "ns", "nn", "normal", "normals",
        "worldnormal", "worldnormals", "cameranormal", "cameranormals", "viewnormal", "viewnormals",
        "shadingnormal", "geometricnormal", "bumpnormal", "bumpnormals", "tangent", "p", "pworld", "pw", "pref",
        "pobject", "pcamera", "po", "position", "positions", "worldposition", "cameraposition", "objectposition",
        "point", "points", "pointposition", "uv", "uvs", "uvw", "st", "texcoord", "texturecoordinates", "motion",
        "motionvector", "motionvectors", "motionvec", "mv", "vector", "vectors", "velocity", "velocities",
        "opticalflow", "id", "ids", "objectid", "materialid", "instanceid", "primitiveid", "renderid", "nodeid",
        "shapeid", "elementid", "objectindex", "materialindex", "indexob", "indexma"};
    size_t start = length;
    char plain[64];
    while (start > 0 && name[start - 1] != '.')
        start--;
    size_t n = plain_name(name + start, length - start, plain, sizeof plain);
    return one_of(plain, n, names, sizeof names / sizeof *names) || strncmp(plain, "crypto", 6) == 0 ||
           strncmp(plain, "ucrypto", 7) == 0;
}

static bool holds_data(const VolPart *part, const VolChannel *channel)
{
    size_t layer = layer_length(channel->name);
    return layer ? is_data(channel->name, layer) : part->name && is_data(part->name, strlen(part->name));
}

enum { DATA = 10, NO_PICTURE = 20 };

/* Nowhere in the part is there a green or blue that is meant as a colour. */
static bool is_red_alone(const VolPart *part, const VolChannel *channel)
{
    bool others = false;
    for (size_t i = 0; i < part->channel_count; i++)
        others |= (color_index(&part->channels[i]) == 1 || color_index(&part->channels[i]) == 2) &&
                  !holds_data(part, &part->channels[i]);
    return color_index(channel) == 0 && !others;
}

/* How far from being the picture are the colours that begin with this channel?  The lower the better. */
static int rank_of_colors(const VolPart *part, const VolChannel *channel, VolPixelsUse use)
{
    size_t layer = layer_length(channel->name);
    bool beauty = is_beauty(channel->name, layer) || (part->name && is_beauty(part->name, strlen(part->name)));
    if (color_index(channel) == 0 && color_of(part, channel, 1) && color_of(part, channel, 2))
        return layer ? (beauty ? 2 : 3) : (beauty ? 0 : 1);
    if (is_luminance(part, channel))
        return layer ? 5 : 4;
    if (is_red_alone(part, channel))
        return layer ? 7 : 6;
    return part->channel_count == 1 && use != VOL_PIXELS_COLOR ? 8 : NO_PICTURE;
}

static int rank_of(const VolPart *part, const VolChannel *channel, VolPixelsUse use)
{
    int rank = rank_of_colors(part, channel, use);
    return rank < NO_PICTURE && holds_data(part, channel) ? DATA + rank : rank;
}

static void take_channels(const VolPart *part, const VolChannel *first, VolColors *out)
{
    size_t length = layer_length(first->name);
    if (length >= sizeof out->layer)
        length = sizeof out->layer - 1;
    memcpy(out->layer, first->name, length);
    out->layer[length] = 0;
    out->channels[0] = first;
    out->count = 1;
    if (color_index(first) != 0 || !color_of(part, first, 1) || !color_of(part, first, 2))
        return;
    for (int c = 1; c < 4; c++)
        if ((out->channels[c] = color_of(part, first, c)))
            out->count = c + 1;
}

VolColors vol_exr_colors(const VolImage *image, VolPixelsUse use)
{
    VolColors best = {0};
    int best_rank = use == VOL_PIXELS_COLOR ? DATA : NO_PICTURE;
    bool data = false, chroma = false;
    for (size_t p = 0; p < image->part_count; p++) {
        const VolPart *part = &image->parts[p];
        for (size_t c = 0; c < part->channel_count; c++) {
            int rank = rank_of(part, &part->channels[c], use);
            if (rank < best_rank) {
                best_rank = rank;
                best = (VolColors){.part = p};
                take_channels(part, &part->channels[c], &best);
            } else if (rank == best_rank && best.count) {
                best.rivals++;
            }
            data |= rank >= DATA && rank < NO_PICTURE;
            chroma |= NAMED(&part->channels[c], "Y") && layer_has(part, &part->channels[c], "RY") &&
                      layer_has(part, &part->channels[c], "BY");
        }
    }
    best.only_data = !best.count && data;
    best.only_chroma = !best.count && !data && chroma;
    return best;
}
