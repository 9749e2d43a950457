#include "cli/values.h"

#include <ctype.h>
#include <errno.h>
#include <limits.h>
#include <stdlib.h>
#include <string.h>

static bool parse_pixels(const char *text, int64_t *out) /* a count of pixels along one axis */
{
    return vol_parse_int(text, out) && *out >= 1 && *out <= INT32_MAX;
}

static bool parse_size(const char *text, VolSize2 *out)
{
    char width[32];
    const char *height = vol_cut_text(text, 'x', width, sizeof width);
    return height && parse_pixels(width, &out->width) && parse_pixels(height, &out->height);
}

static bool parse_crop(const char *text, VolCrop *out)
{
    char size[64], x[32];
    VolSize2 extent;
    const char *place = vol_cut_text(text, '+', size, sizeof size);
    if (!place || !parse_size(size, &extent))
        return false;
    const char *y = vol_cut_text(place, '+', x, sizeof x);
    if (!y || !vol_parse_int(x, &out->x) || !vol_parse_int(y, &out->y))
        return false;
    if (llabs(out->x) > INT32_MAX || llabs(out->y) > INT32_MAX)
        return false;
    out->width = extent.width;
    out->height = extent.height;
    return true;
}

static bool parse_length(const char *text, bool bare_is_world, VolLen *out)
{
    char number[512];
    size_t length = strlen(text);
    out->voxels = false;
    if (bare_is_world && vol_parse_real(text, &out->value))
        return out->value >= 0;
    if (length < 2 || length > sizeof number || (text[length - 1] != 'v' && text[length - 1] != 'w'))
        return false;
    memcpy(number, text, length - 1);
    number[length - 1] = 0;
    out->voxels = text[length - 1] == 'v';
    return vol_parse_real(number, &out->value) && out->value >= 0;
}

/* Index of `text` in "one|two|three", or -1. */
static int choice_index(const char *choices, const char *text)
{
    int index = 0;
    for (const char *rest = choices; rest; index++) {
        char choice[64];
        rest = vol_cut_text(rest, '|', choice, sizeof choice);
        if (!strcmp(choice, text))
            return index;
    }
    return -1;
}

static size_t field_size(VolOptKind kind)
{
    static const size_t sizes[] = {
        [VOL_OPT_FLAG] = sizeof(bool),         [VOL_OPT_INT] = sizeof(int64_t),   [VOL_OPT_REAL] = sizeof(double),
        [VOL_OPT_TEXT] = sizeof(const char *), [VOL_OPT_CHOICE] = sizeof(int),    [VOL_OPT_LIST] = sizeof(VolTextList),
        [VOL_OPT_VEC3] = sizeof(VolVec3),      [VOL_OPT_RGB] = sizeof(VolVec3),   [VOL_OPT_SIZE] = sizeof(VolSize2),
        [VOL_OPT_CROP] = sizeof(VolCrop),      [VOL_OPT_LENGTH] = sizeof(VolLen),
        [VOL_OPT_WORLD_LENGTH] = sizeof(VolLen),
    };
    return sizes[kind];
}

void vol_clear_value(const VolOpt *option, void *options)
{
    memset((char *)options + option->offset, 0, field_size(option->kind));
}

static VolStatus bad_value(const VolOpt *option, const char *text, const char *why, VolError *err)
{
    return vol_fail(err, VOL_USAGE, "bad value '%s' for '--%s': %s", text, option->name, why);
}

VolStatus vol_store_value(VolArena **arena, const VolOpt *option, void *options, const char *text, VolError *err)
{
    void *field = (char *)options + option->offset;
    double v[3];
    int index;
    switch (option->kind) {
    case VOL_OPT_FLAG:
        *(bool *)field = true;
        return VOL_OK;
    case VOL_OPT_TEXT:
        *(const char **)field = text;
        return VOL_OK;
    case VOL_OPT_LIST:
        return vol_list_append(arena, field, text, err);
    case VOL_OPT_INT:
        return vol_parse_int(text, field) ? VOL_OK : bad_value(option, text, "a whole number is needed", err);
    case VOL_OPT_REAL:
        return vol_parse_real(text, field) ? VOL_OK : bad_value(option, text, "a finite number is needed", err);
    case VOL_OPT_CHOICE:
        index = choice_index(option->choices, text);
        if (index < 0)
            return vol_fail(err, VOL_USAGE, "bad value '%s' for '--%s': one of %s is needed", text, option->name,
                            option->choices);
        *(int *)field = index;
        return VOL_OK;
    case VOL_OPT_VEC3:
    case VOL_OPT_RGB:
        if (vol_parse_reals(text, v, 3, 3) != 3)
            return bad_value(option, text, "three finite numbers A,B,C are needed", err);
        *(VolVec3 *)field = vol_vec3(v[0], v[1], v[2]);
        return VOL_OK;
    case VOL_OPT_SIZE:
        return parse_size(text, field) ? VOL_OK : bad_value(option, text, "WxH is needed, each at least 1", err);
    case VOL_OPT_CROP:
        return parse_crop(text, field) ? VOL_OK : bad_value(option, text, "WxH+X+Y is needed, W and H at least 1", err);
    case VOL_OPT_LENGTH:
        return parse_length(text, false, field)
                   ? VOL_OK
                   : bad_value(option, text, "a length with its unit is needed: 0.5v (voxels) or 0.5w (world units)", err);
    case VOL_OPT_WORLD_LENGTH:
        return parse_length(text, true, field)
                   ? VOL_OK
                   : bad_value(option, text, "a length is needed: 0.5v (voxels), 0.5w or 0.5 (world units)", err);
    }
    abort(); /* a kind that is not in the enumeration */
}
