/* Light grids at places on the rays of a packet.
 *
 * Places are times from a base that each ray moves along with it, so that in float no place is lost in the distance: of
 * each lattice a lane knows the cell that it was in at its base, and how it moves from there.
 *
 * PARAMETERS  VOL_DOUBLE
 * PROVIDES    LitRays, lit_begin(), lit_move(), lit_place(); LitPlaces, lit_direct(), lit_around(); lit_on_particles(),
 *             lit_evenly() */
#ifndef VOL_TRACE_LIT_TMPL_H
#define VOL_TRACE_LIT_TMPL_H

#include "trace/gather_tmpl.h"
#include "trace/light_paths_tmpl.h"
#include "trace/reach.h"

/* A grid, and where its lattice is along the rays: index space at the base, and per world unit. */
typedef struct LitGrid {
    Gather gather;
    ints cell[3];
    reals f[3], d[3];
} LitGrid;

typedef struct LitLight {
    LightPath path;
    reals phase[3]; /* of suns */
} LitLight;

typedef struct LitRays {
    double base[LANES]; /* times of the bases */
    LitLight *lights;
    LitGrid *grids;
} LitRays;

_Static_assert(sizeof(LitRays) <= VOL_LIT_HEAD && sizeof(LitLight) <= VOL_LIT_EACH && sizeof(LitGrid) <= VOL_LIT_EACH,
               "the room for light grids");

/* ---- Places ---- */

/* The lanes of `mask` have their base at t. */
static inline void lit_move(RayPacket *l, ints mask, const double t[LANES])
{
    const VolLit *of = l->scene->lit;
    FOR_LANES(i, mask_bits(mask)) {
        const VolRay *ray = &l->rays[i < l->count ? i : 0];
        l->lit->base[i] = t[i];
        for (size_t n = 0; n < of->grid_count; n++) {
            LitGrid *grid = &l->lit->grids[n];
            if (of->lattice[n] == n)
                gather_place(of->grids[n], vol_add(ray->origin, vol_scale(ray->direction, t[i])), i, grid->cell, grid->f);
        }
    }
}

/* Times along the rays as places. */
static inline reals lit_place(const RayPacket *l, ints mask, const double t[LANES])
{
    reals at = reals_all(0);
    FOR_LANES(i, mask_bits(mask))
        at[i] = (real)(t[i] - l->lit->base[i]);
    return at;
}

static inline void set_directions(const RayPacket *l, const VolGrid *field, LitGrid *grid)
{
    for (size_t i = 0; i < LANES; i++) {
        VolVec3 d = vol_apply_linear(&field->world_to_index, l->rays[i < l->count ? i : 0].direction);
        grid->d[0][i] = (real)d.x;
        grid->d[1][i] = (real)d.y;
        grid->d[2][i] = (real)d.z;
    }
}

/* What the phase function makes of light that comes from a sun. */
static inline void set_phases(const RayPacket *l, const VolLight *light, LitLight *out)
{
    for (size_t i = 0; i < LANES; i++) {
        double rgb[3];
        vol_phase_at(&l->scene->lit->phase, -vol_dot(light->direction, l->rays[i < l->count ? i : 0].direction), rgb);
        for (int c = 0; c < 3; c++)
            out->phase[c][i] = (real)rgb[c];
    }
}

/* Where the scene has light grids. */
static inline void lit_begin(RayPacket *l)
{
    const VolLit *of = l->scene->lit;
    const VolScene *scene = l->scene;
    if (!of)
        return;
    char *room = l->scratch->lit_room;
    LitRays *lit = l->lit = (LitRays *)room;
    lit->lights = (LitLight *)(room + VOL_LIT_HEAD);
    lit->grids = (LitGrid *)(room + VOL_LIT_HEAD + scene->light_count * VOL_LIT_EACH);
    for (size_t n = 0; n < scene->light_count; n++) {
        light_path(l, &scene->lights[n], &lit->lights[n].path);
        if (!vol_light_stands(&scene->lights[n]))
            set_phases(l, &scene->lights[n], &lit->lights[n]);
    }
    for (size_t n = 0; n < of->grid_count; n++) {
        gather_begin(&lit->grids[n].gather, &l->scratch->lit[n]);
        if (of->lattice[n] == n)
            set_directions(l, of->grids[n], &lit->grids[n]);
    }
}

/* ---- Grids ---- */

ALWAYS_INLINE void lit_look_up(const RayPacket *l, size_t n, reals at, ints mask, reals out[3])
{
    const LitGrid *lattice = &l->lit->grids[l->scene->lit->lattice[n]];
    ints cell[3];
    reals f[3];
    for (int a = 0; a < 3; a++)
        gather_split(lattice->cell[a], reals_fma(at, lattice->d[a], lattice->f[a]), &cell[a], &f[a]);
    gather_rgb(&l->lit->grids[n].gather, cell, f, mask, out);
}

/* Of all grids that have any: 0 where none does. */
static inline void lit_indirect(const RayPacket *l, int count, const reals *at, ints mask, reals out[][3])
{
    for (int i = 0; i < count; i++)
        out[i][0] = out[i][1] = out[i][2] = reals_all(0);
    for (size_t n = vol_lit_direct_count(l->scene); n < l->scene->lit->grid_count; n++)
        for (int i = 0; i < count; i++) {
            reals more[3];
            lit_look_up(l, n, at[i], mask, more);
            for (int c = 0; c < 3; c++)
                out[i][c] += more[c];
        }
}

/* ---- Surfaces ---- */

/* Places on surfaces: `at` as grids know them, of the lanes of `mask`.  From those of `follow` the way to the light is
 * followed through surface cells (reach.h).  Of isosurfaces (`value` not NULL), one place on each ray, `below` says from
 * which side they are seen. */
typedef struct LitPlaces {
    const reals *at;
    ints mask, follow;
    const real *value;
    ints below;
} LitPlaces;

static inline VolVec3 lit_point(const RayPacket *l, unsigned i, real at)
{
    const VolRay *ray = &l->rays[i < l->count ? i : 0];
    return vol_along(ray->origin, l->lit->base[i] + (double)at, ray->direction);
}

/* Where rays next pass from one cell to another in any lattice of light, behind `at`. */
static inline reals lit_until(const RayPacket *l, reals at)
{
    const real beyond = (real)1e-5; /* in cells: so near a face it is behind */
    reals until = reals_all(INFINITY);
    for (size_t n = 0; n < l->scene->lit->grid_count; n++) {
        const LitGrid *grid = &l->lit->grids[n];
        for (int a = 0; a < 3 && l->scene->lit->lattice[n] == n; a++) {
            ints up = (ints)(grid->d[a] > 0), moves = (ints)(grid->d[a] != 0), cell;
            reals x = reals_fma(at, grid->d[a], grid->f[a]), f;
            x += reals_select(up, reals_all(beyond), reals_all(-beyond));
            gather_split(ints_all(0), x, &cell, &f);
            reals face = __builtin_convertvector(cell - up, reals);
            reals then = (face - grid->f[a]) / reals_select(moves, grid->d[a], reals_all(1));
            until = reals_select(moves, reals_min(until, then), until);
        }
    }
    return until;
}

/* The transmittance to light n at `count` places on surfaces. */
static inline void lit_direct(const RayPacket *l, size_t n, int count, const LitPlaces *places, reals out[][3])
{
    for (int i = 0; i < count; i++) {
        lit_look_up(l, n, places->at[i], places->mask, out[i]);
        FOR_LANES(lane, mask_bits(places->mask & places->follow)) {
            double T[3];
            double own = places->value ? (double)places->value[lane] : (double)NAN;
            if (vol_reach(l->scene, lit_point(l, lane, places->at[i][lane]), n, own, T))
                for (int c = 0; c < 3; c++)
                    out[i][c][lane] = (real)T[c];
        }
    }
}

/* Indirect light there, or the total. */
static inline void lit_around(const RayPacket *l, int count, const LitPlaces *places, reals out[][3])
{
    lit_indirect(l, count, places->at, places->mask, out);
    FOR_LANES(lane, places->value ? mask_bits(places->mask) : 0) {
        double rgb[3];
        vol_reach_around(l->scene, lit_point(l, lane, places->at[0][lane]), (double)places->value[lane],
                         places->below[lane] != 0, rgb);
        for (int c = 0; c < 3; c++)
            out[0][c][lane] = (real)rgb[c];
    }
}

/* ---- Particles ---- */

/* The phase function towards light n from a place `times`, and how much of the light's strength would arrive. */
ALWAYS_INLINE reals lit_phase(const RayPacket *l, size_t n, const Times *times, reals phase[3])
{
    const VolLight *light = &l->scene->lights[n];
    const LitLight *known = &l->lit->lights[n];
    if (!vol_light_stands(light)) {
        memcpy(phase, known->phase, sizeof known->phase);
        return reals_all(1);
    }
    reals to[3], scale = arriving_from(l, light, &known->path, times, to), cosine = -dot3(to, l->view);
    for (int i = 0; i < LANES; i++) {
        double rgb[3];
        vol_phase_at(&l->scene->lit->phase, (double)cosine[i], rgb);
        for (int c = 0; c < 3; c++)
            phase[c][i] = (real)rgb[c];
    }
    return scale;
}

/* What stands in place of 1 before the source of what scatters, at `count` places. */
static inline void lit_on_particles(const RayPacket *l, int count, const reals *at, ints mask, reals out[][3])
{
    const VolScene *scene = l->scene;
    const Times base = l->prepared->lit_from_places ? times_of(l->lit->base) : time_of(0);
    lit_indirect(l, count, at, mask, out);
    for (size_t n = 0; n < vol_lit_direct_count(scene); n++)
        for (int i = 0; i < count; i++) {
            Times times = {base.t, base.rest + at[i]};
            reals T[3], phase[3], scale = lit_phase(l, n, &times, phase);
            lit_look_up(l, n, at[i], mask, T);
            for (int c = 0; c < 3; c++)
                out[i][c] = reals_fma((real)scene->lights[n].rgb[c] * scale * phase[c], T[c], out[i][c]);
        }
}

/* The same on surfaces that are not shaded: phase functions are nothing to them. */
static inline void lit_evenly(const RayPacket *l, int count, const LitPlaces *places, reals out[][3])
{
    enum { MOST = 16 };
    const VolScene *scene = l->scene;
    const Times base = l->prepared->lit_from_places ? times_of(l->lit->base) : time_of(0);
    reals T[MOST][3];
    lit_around(l, count, places, out);
    for (size_t n = 0; n < vol_lit_direct_count(scene); n++) {
        lit_direct(l, n, count, places, T);
        for (int i = 0; i < count; i++) {
            const VolLight *light = &scene->lights[n];
            Times times = {base.t, base.rest + places->at[i]};
            reals to[3], scale = arriving_from(l, light, &l->lit->lights[n].path, &times, to);
            for (int c = 0; c < 3; c++)
                out[i][c] = reals_fma((real)light->rgb[c] * scale, T[i][c], out[i][c]);
        }
    }
}

#endif
