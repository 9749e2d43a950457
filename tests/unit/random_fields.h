/* Random small fields from a seed: one RGB grid, and three scalar ones of its channels, built from the same leaves and
 * tiles.  Some are boxes, some of these one voxel thin, some have voxels that are not finite. */
#ifndef TESTS_UNIT_RANDOM_FIELDS_H
#define TESTS_UNIT_RANDOM_FIELDS_H

#include "tests/unit/random_scene.h"

typedef struct RandomFields {
    VolGrid *rgb, *channel[3];
    int32_t lo[3], hi[3]; /* voxels that carry values */
} RandomFields;

/* The RGB grid's, then the channels'. */
typedef struct FieldBuilders {
    VolGridBuilder *of[4];
} FieldBuilders;

static inline void fields_begin(const VolGridSource *source, FieldBuilders *out)
{
    VolGridSource each = *source;
    each.is_rgb = true;
    bool made = !vol_grid_begin(&each, &out->of[0], NULL);
    for (int c = 0; c < 3; c++) {
        each.is_rgb = false;
        each.background = source->background_rgb[c];
        made = made && !vol_grid_begin(&each, &out->of[1 + c], NULL);
    }
    if (!made)
        abort();
}

static inline void fields_leaf(FieldBuilders *to, const int32_t origin[3], const float values[3 * 512],
                               const uint64_t active[8])
{
    float plane[512];
    bool taken = !vol_grid_leaf(to->of[0], origin, values, NULL, active, NULL);
    for (int c = 0; c < 3; c++) {
        for (int n = 0; n < 512; n++)
            plane[n] = values[3 * n + c];
        taken = taken && !vol_grid_leaf(to->of[1 + c], origin, plane, NULL, active, NULL);
    }
    if (!taken)
        abort();
}

static inline void fields_tile(FieldBuilders *to, const int32_t origin[3], int32_t size, const double rgb[3], bool active)
{
    bool taken = !vol_grid_tile_rgb(to->of[0], origin, size, rgb, active, NULL);
    for (int c = 0; c < 3; c++)
        taken = taken && !vol_grid_tile(to->of[1 + c], origin, size, rgb[c], active, NULL);
    if (!taken)
        abort();
}

static inline void fields_finish(FieldBuilders *from, RandomFields *out)
{
    bool made = !vol_grid_finish(from->of[0], &out->rgb, NULL);
    for (int c = 0; c < 3; c++)
        made = made && !vol_grid_finish(from->of[1 + c], &out->channel[c], NULL);
    if (!made)
        abort();
}

static inline void fields_free(RandomFields *fields)
{
    vol_grid_free(fields->rgb);
    for (int c = 0; c < 3; c++)
        vol_grid_free(fields->channel[c]);
}

static inline void random_color(Random *r, double out[3])
{
    for (int c = 0; c < 3; c++)
        out[c] = random_below(r, 4) ? (double)(float)random_unit(r) : 0;
}

static inline void random_leaf(Random *r, const RandomFields *fields, const int32_t origin[3], bool holes, FieldBuilders *to)
{
    float values[3 * 512];
    uint64_t active[8] = {0};
    for (int n = 0; n < 512; n++) {
        const int32_t at[3] = {origin[0] + (n >> 6), origin[1] + (n >> 3 & 7), origin[2] + (n & 7)};
        bool inside = true;
        for (int a = 0; a < 3; a++)
            inside = inside && at[a] >= fields->lo[a] && at[a] <= fields->hi[a];
        for (int c = 0; c < 3; c++)
            values[3 * n + c] = (float)random_unit(r);
        if (inside && holes && random_below(r, 60) == 0)
            values[3 * n + random_below(r, 3)] = random_below(r, 2) ? NAN : INFINITY;
        active[n >> 6] |= (uint64_t)inside << (n & 63);
    }
    fields_leaf(to, origin, values, active);
}

/* `holes`: some voxels may not be finite. */
__attribute__((unused)) static void random_fields(Random *r, bool holes, RandomFields *out)
{
    VolGridSource source = {.box = random_below(r, 2) != 0};
    FieldBuilders to;
    random_color(r, source.background_rgb);
    for (int a = 0; a < 3; a++) {
        out->lo[a] = random_below(r, 300) - 150;
        out->hi[a] = out->lo[a] + (random_below(r, 6) == 0 ? 0 : random_below(r, 20));
        source.box_min[a] = out->lo[a];
        source.box_max[a] = out->hi[a];
        for (int b = 0; b < 3; b++)
            source.index_to_world.m[a][b] = (a == b ? (random_below(r, 2) ? 0.5 : -2) : 0) + random_in(r, -0.2, 0.2);
        source.index_to_world.m[3][a] = random_in(r, -9, 9);
    }
    fields_begin(&source, &to);
    for (int32_t x = out->lo[0] & ~7; x <= out->hi[0]; x += 8)
        for (int32_t y = out->lo[1] & ~7; y <= out->hi[1]; y += 8)
            for (int32_t z = out->lo[2] & ~7; z <= out->hi[2]; z += 8) {
                const int32_t origin[3] = {x, y, z};
                double color[3];
                bool whole = true; /* an active tile lies inside the active bounding box */
                for (int a = 0; a < 3; a++)
                    whole = whole && origin[a] >= out->lo[a] && origin[a] + 7 <= out->hi[a];
                random_color(r, color);
                if (whole && random_below(r, 2) == 0)
                    fields_tile(&to, origin, 8, color, true);
                else
                    random_leaf(r, out, origin, holes && random_below(r, 2), &to);
            }
    fields_finish(&to, out);
}

#endif
