/* Random small scenes from a seed, for tests of the ray kernels: sparse or dense grids (some with holes, plateaus and
 * values exactly at isosurfaces), sheared and mirrored transforms, transfer functions with jumps, spikes, isosurfaces and
 * every kind of term. */
#ifndef TESTS_UNIT_RANDOM_SCENE_H
#define TESTS_UNIT_RANDOM_SCENE_H

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Of the tables; a test may ask for finer ones. */
#ifndef RANDOM_SCENE_NODES
#define RANDOM_SCENE_NODES 33
#endif

#include "volume/grid.h"
#include "trace/lights.h"
#include "trace/trace.h"
#include "tf/tf.h"

typedef struct Random {
    uint64_t state;
} Random;

static inline uint64_t random_bits(Random *r)
{
    uint64_t z = (r->state += 0x9e3779b97f4a7c15u);
    z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
    z = (z ^ z >> 27) * 0x94d049bb133111ebu;
    return z ^ z >> 31;
}
static inline double random_unit(Random *r) { return (double)(random_bits(r) >> 11) * 0x1p-53; }
static inline double random_in(Random *r, double lo, double hi) { return lo + (hi - lo) * random_unit(r); }
static inline int random_below(Random *r, int n) { return (int)(random_bits(r) % (uint64_t)n); }

/* `--seed N` on the command line: random scenes N+1, N+2, ... */
static inline uint64_t seed_before_first(int argc, char **argv)
{
    uint64_t seed = argc == 3 && strcmp(argv[1], "--seed") == 0 ? strtoull(argv[2], NULL, 10) : 0;
    printf("# seeds from %llu\n", (unsigned long long)seed + 1);
    return seed;
}

/* NO_PLATEAUS: no values exactly at knots and no holes, where rounding decides the side of a jump.  BOUNDED: the values of
 * each brick end at a quarter, above or below, and so do many stretches of the transfer function.  WILD: opacities next to
 * 0 and 1, spikes, lengths far from the voxels', and sometimes single voxels of enormous values. */
enum {
    RANDOM_NO_PLATEAUS = 1,
    RANDOM_NO_DELTAS = 2,
    RANDOM_UNSHADED = 4,
    RANDOM_BOUNDED = 8,
    RANDOM_WILD = 16,
    RANDOM_LIT = 32
};

typedef struct RandomScene {
    VolGrid *grid;
    VolTf tf;
    VolTfCompiled compiled;
    VolPreint tables;
    VolTfIntegrals integrals;
    VolLight lights[3];
    VolClip clip;
    VolScene scene;
    VolPrepared prepared;
    int32_t lo[3], hi[3];
    int exponent; /* values and nodes are times 2^this */
} RandomScene;

static inline double random_value(Random *r, int style)
{
    double v = random_unit(r);
    if (style == 1)
        v = floor(v * 5) / 4; /* plateaus, and values exactly at knots */
    if (style == 2 && v < 0.6)
        v = 0;
    return v;
}

/* What fills and faults look like. */
static float poked_value(Random *r)
{
    static const float values[] = {1e5f, -1e5f, 1e10f, 1e15f, -1e15f, 1e20f, -1e20f, 1e30f, 3e38f, -3e38f, 1e-30f, 1e-38f};
    return values[random_below(r, (int)(sizeof values / sizeof *values))];
}

__attribute__((unused)) static VolGrid *random_grid(Random *r, int flags, RandomScene *s)
{
    const double unit = ldexp(1, s->exponent);
    VolGridSource source = {.background = unit * (random_below(r, 4) ? 0 : random_unit(r)), .box = random_below(r, 2) != 0};
    for (int a = 0; a < 3; a++) {
        s->lo[a] = random_below(r, 300) - 150;
        int extent = random_below(r, 6) == 0 ? 1 : 1 + random_below(r, 20);
        s->hi[a] = s->lo[a] + extent - 1;
        source.box_min[a] = s->lo[a];
        source.box_max[a] = s->hi[a];
    }
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            source.index_to_world.m[i][j] = (i == j ? (random_below(r, 2) ? 0.5 : -0.5) : 0) + random_in(r, -0.2, 0.2);
    VolVec3 middle = {0.5 * (s->lo[0] + s->hi[0]), 0.5 * (s->lo[1] + s->hi[1]), 0.5 * (s->lo[2] + s->hi[2])};
    VolVec3 at = vol_apply_linear(&source.index_to_world, middle);
    source.index_to_world.m[3][0] = -at.x;
    source.index_to_world.m[3][1] = -at.y;
    source.index_to_world.m[3][2] = -at.z;
    VolGridBuilder *builder;
    VolGrid *grid;
    if (vol_grid_begin(&source, &builder, NULL))
        abort();
    bool plain = flags & RANDOM_NO_PLATEAUS, poked = flags & RANDOM_WILD && random_below(r, 3) == 0;
    int style = plain ? 0 : random_below(r, 3), holes = !plain && random_below(r, 4) == 0;
    for (int32_t x = s->lo[0] & ~7; x <= s->hi[0]; x += 8)
        for (int32_t y = s->lo[1] & ~7; y <= s->hi[1]; y += 8)
            for (int32_t z = s->lo[2] & ~7; z <= s->hi[2]; z += 8) {
                float values[512];
                uint64_t active[8] = {0};
                int32_t origin[3] = {x, y, z};
                bool whole = true; /* an active tile lies inside the active bounding box */
                for (int a = 0; a < 3; a++)
                    whole = whole && origin[a] >= s->lo[a] && origin[a] + 7 <= s->hi[a];
                if (whole && random_below(r, 3) == 0) {
                    if (vol_grid_tile(builder, origin, 8, unit * random_unit(r), true, NULL))
                        abort();
                    continue;
                }
                double least = -INFINITY, most = INFINITY;
                if (flags & RANDOM_BOUNDED) {
                    double quarter = 0.25 * random_below(r, 5);
                    *(random_below(r, 2) ? &least : &most) = quarter;
                }
                for (int n = 0; n < 512; n++) {
                    int32_t at_voxel[3] = {x + (n >> 6), y + (n >> 3 & 7), z + (n & 7)};
                    int inside = 1;
                    for (int a = 0; a < 3; a++)
                        inside &= at_voxel[a] >= s->lo[a] && at_voxel[a] <= s->hi[a];
                    values[n] = inside ? (float)(unit * fmin(fmax(random_value(r, style), least), most))
                                       : (float)source.background;
                    if (inside && holes && random_below(r, 60) == 0)
                        values[n] = random_below(r, 2) ? NAN : INFINITY;
                    if (inside && poked && random_below(r, 100) == 0)
                        values[n] = poked_value(r);
                    if (inside)
                        active[n >> 6] |= (uint64_t)1 << (n & 63);
                }
                if (vol_grid_leaf(builder, origin, values, NULL, active, NULL))
                    abort();
            }
    if (vol_grid_finish(builder, &grid, NULL))
        abort();
    return grid;
}

static double random_opacity(Random *r, int flags)
{
    static const double extremes[] = {1e-8, 1e-4, 0.999, 0.9999999, 1};
    if (flags & RANDOM_WILD && random_below(r, 4) == 0)
        return extremes[random_below(r, 5)];
    return random_below(r, 3) ? round(random_unit(r) * 0.9 * 1e4) / 1e4 : 0;
}

/* From 0 up to 1 and down again within a millionth to a tenth of the range. */
static void random_spike(Random *r, char *text, size_t size, const char *key, int exponent)
{
    double v = random_in(r, 0, 1), width = pow(10, random_in(r, -6, -1));
    size_t n = strlen(text);
    snprintf(text + n, size - n, ", \"%s\": [[%.17g, 0], [%.17g, 1, [1, 0.5, 0.2]], [%.17g, 0]]", key,
             ldexp(v - width, exponent), ldexp(v, exponent), ldexp(v + width, exponent));
}

static void random_nodes(Random *r, int flags, char *text, size_t size, const char *key, int color, int exponent)
{
    if (flags & RANDOM_WILD && random_below(r, 4) == 0) {
        random_spike(r, text, size, key, exponent);
        return;
    }
    size_t n = strlen(text);
    n += (size_t)snprintf(text + n, size - n, ", \"%s\": [", key);
    int count = random_below(r, 8) ? 1 + random_below(r, 5) : 10 + random_below(r, 30);
    double v = flags & RANDOM_BOUNDED ? 0.25 * random_below(r, 4) : random_in(r, -0.2, 0.5);
    for (int i = 0; i < count; i++) {
        n += (size_t)snprintf(text + n, size - n, "%s[%.17g, %.9g", i ? ", " : "", ldexp(round(v * 1e3) / 1e3, exponent),
                              random_opacity(r, flags));
        if (color)
            n += (size_t)snprintf(text + n, size - n, ", [%.3f, %.3f, %.3f]", random_unit(r), random_unit(r),
                                  random_unit(r));
        n += (size_t)snprintf(text + n, size - n, "]");
        if (flags & RANDOM_BOUNDED && random_below(r, 3)) {
            v += 0.25 * (i == 0 ? random_below(r, 2) : 1 + random_below(r, 2));
            continue;
        }
        v += random_below(r, 4) == 0 && i == 0 ? 0 : random_below(r, 3) ? random_in(r, 0.05, 0.4) : 0.01;
    }
    snprintf(text + n, size - n, "]");
}

/* Near 1, or anything. */
static double random_length(Random *r, int flags, double lo, double hi)
{
    return flags & RANDOM_WILD && random_below(r, 3) == 0 ? pow(10, random_in(r, -38, 38))
                                                               : round(random_in(r, lo, hi) * 1e3) / 1e3;
}

__attribute__((unused)) static void random_tf(Random *r, int flags, int exponent, char *text, size_t size)
{
    static const char *const models[] = {"hybrid", "unshaded", "classic"};
    int model = flags & RANDOM_UNSHADED ? 1 : random_below(r, 3);
    snprintf(text, size, "{\"pellucid\": \"transfer-function/1\", \"model\": \"%s\", \"interpolate\": \"%s\", "
                         "\"particle_step\": %.9g, \"scalar_step\": %.9g",
             models[model], random_below(r, 2) ? "extinction" : "opacity", random_length(r, flags, 0.2, 2),
             ldexp(round(random_in(r, 0.05, 0.5) * 1e3) / 1e3, exponent));
    if (random_below(r, 4))
        random_nodes(r, flags, text, size, "scatter", 1, exponent);
    if (random_below(r, 2) && model != 2)
        random_nodes(r, flags, text, size, "surface", 1, exponent);
    if (random_below(r, 3) == 0)
        random_nodes(r, flags, text, size, "absorb", 1, exponent);
    if (random_below(r, 3) == 0)
        random_nodes(r, flags, text, size, "emit", 1, exponent);
    size_t n = strlen(text);
    if (!(flags & RANDOM_NO_DELTAS) && random_below(r, 2)) {
        n += (size_t)snprintf(text + n, size - n, ", \"isosurfaces\": [");
        for (int i = 0, count = 1 + random_below(r, 3); i < count; i++) {
            double value = random_below(r, 2) ? 0.25 * random_below(r, 5) : round(random_unit(r) * 100) / 100;
            n += (size_t)snprintf(text + n, size - n, "%s{\"value\": %.17g, \"opacity\": %.3f}", i ? ", " : "",
                                  ldexp(value, exponent), random_unit(r));
        }
        n += (size_t)snprintf(text + n, size - n, "]");
    }
    if (flags & RANDOM_LIT) {
        double shininess = pow(10, random_in(r, -1, 4));
        n += (size_t)snprintf(text + n, size - n, ", \"shading\": {\"specular\": %.3f, \"shininess\": %.9g}", random_unit(r),
                              random_below(r, 4) ? round(shininess) : shininess);
    }
    snprintf(text + n, size - n, "}");
}

/* Up to three lights of any kind, some of them inside the volume, as bright as makes colours about 1. */
__attribute__((unused)) static size_t random_lights(Random *r, VolLight *lights)
{
    size_t count = 1 + (size_t)random_below(r, 3);
    for (size_t n = 0; n < count; n++) {
        double near = random_below(r, 2) ? 3 : 15, strength = random_unit(r), green = random_unit(r);
        char at[100], to[100], text[400] = "";
        snprintf(at, sizeof at, "%.9g,%.9g,%.9g", random_in(r, -near, near), random_in(r, -near, near),
                 random_in(r, -near, near));
        snprintf(to, sizeof to, "%.9g,%.9g,%.9g", random_in(r, -1, 1), random_in(r, -1, 1), random_in(r, -1, 1));
        int kind = random_below(r, 4);
        if (kind == 1)
            snprintf(text, sizeof text, "sun:%s", to);
        if (kind == 2)
            snprintf(text, sizeof text, "point:%s", at);
        if (kind == 3)
            snprintf(text, sizeof text, "spot:%s,%s,%.9g", at, to, random_in(r, 1, 170));
        if (kind > 1)
            strength *= near * near / 3;
        size_t used = strlen(text);
        snprintf(text + used, sizeof text - used, ":%.9g,%.9g,%.9g", strength, strength * green, strength);
        lights[n] = vol_light_head();
        if (kind > 0 && vol_light_parse(text, &lights[n], NULL))
            abort();
    }
    return count;
}

/* The transfer function in `text` with its tables; over the range that they have by default where `options` has none. */
static inline void scene_look(RandomScene *s, const char *text, const VolPreintOptions *options)
{
    VolError err;
    VolBytes bytes = {(unsigned char *)(uintptr_t)text, strlen(text)};
    VolPreintOptions wanted = *options;
    VolStatus status = vol_tf_parse(&bytes, "test", &s->tf, NULL, &err);
    if (!status)
        status = vol_tf_compile(&s->tf, NULL, &s->compiled, &err);
    if (!status && wanted.lo == wanted.hi)
        vol_preint_default_range(&s->compiled, &wanted.lo, &wanted.hi);
    if (!status)
        status = vol_preint_build(&s->compiled, &wanted, &s->tables, &err);
    if (!status)
        status = vol_tf_integrals_new(&s->compiled, &s->integrals, &err);
    if (!status)
        return;
    printf("# %s\n# %s\n", err.text, text);
    abort();
}

__attribute__((unused)) static void random_scene(Random *r, int flags, RandomScene *s)
{
    char text[16384];
    memset(s, 0, sizeof *s);
    s->grid = random_grid(r, flags, s);
    random_tf(r, flags, s->exponent, text, sizeof text);
    scene_look(s, text, &(VolPreintOptions){.n = RANDOM_SCENE_NODES, .step = 0.2, .octaves = 1, .change = INFINITY,
                                            .threads = 1});
    s->lights[0] = vol_light_head();
    vol_light_parse("sun:1,-2,0.5:1,0.5,0.25", &s->lights[1], NULL);
    s->clip = (VolClip){{random_in(r, -1, 1), random_in(r, -1, 1), random_in(r, -1, 1)}, -1};
    s->scene = (VolScene){.volume = vol_volume_of_grid(s->grid), .tf = &s->compiled, .lights = s->lights, .skip = true,
                          .preint = &s->tables, .integrals = &s->integrals,
                          .light_count = random_below(r, 2) ? 2 : 1, .clips = &s->clip,
                          .clip_count = (size_t)random_below(r, 2), .step = 0.2,
                          .layers = random_below(r, 2) ? 1u << VOL_LAYER_Z : 0};
}

__attribute__((unused)) static void random_scene_free(RandomScene *s)
{
    vol_grid_free(s->grid);
    vol_preint_free(&s->tables);
    vol_tf_integrals_free(&s->integrals);
    vol_tf_compiled_free(&s->compiled);
    vol_tf_free(&s->tf);
}

/* A ray towards the volume; now and then along an axis, through voxel centres, or from inside. */
__attribute__((unused)) static VolRay random_ray(Random *r, const RandomScene *s)
{
    VolVec3 index = {random_in(r, s->lo[0], s->hi[0]), random_in(r, s->lo[1], s->hi[1]), random_in(r, s->lo[2], s->hi[2])};
    VolVec3 direction = {random_in(r, -1, 1), random_in(r, -1, 1), random_in(r, -1, 1)};
    if (random_below(r, 3) == 0) {
        index = vol_vec3(floor(index.x), floor(index.y), floor(index.z));
        direction = vol_vec3(random_below(r, 3) - 1, random_below(r, 3) - 1, random_below(r, 3) - 1);
        direction = vol_apply_linear(&s->grid->index_to_world, direction);
    }
    if (vol_length(direction) == 0)
        direction = vol_vec3(0, 0, 1);
    direction = vol_scale(direction, 1 / vol_length(direction));
    VolVec3 target = vol_apply(&s->grid->index_to_world, index);
    double back = random_below(r, 5) ? 30 : 0;
    return (VolRay){vol_along(target, -back, direction), direction, 0, INFINITY};
}

/* Up to `most` rays that meet the domain, cut to it. */
static inline size_t random_packet(Random *r, const RandomScene *s, size_t most, VolRay *rays)
{
    size_t count = 0;
    for (int tries = 0; tries < 100 && count < most; tries++) {
        rays[count] = random_ray(r, s);
        count += vol_ray_clip(&s->scene, &rays[count]);
    }
    return count;
}

/* Of a scene that was prepared. */
static inline void end_scene(RandomScene *s)
{
    vol_prepared_free(&s->prepared);
    random_scene_free(s);
}

/* A packet of rays through the scene's kernel. */
static inline void trace_rays(const VolPrepared *prepared, const VolRay *rays, size_t count, VolRadiance *out)
{
    VolScratch scratch;
    if (vol_scratch_new(prepared, &scratch, NULL))
        abort();
    memset(out, 0, count * sizeof *out);
    vol_trace_rays(&(VolTraceCall){.prepared = prepared, .scratch = &scratch, .rays = rays, .count = count, .out = out});
    vol_scratch_free(&scratch);
}

#endif
