/* What the estimators that march have in common: samples of the field on the ray, shading there, isosurfaces.
 * Include real.h and optics_tmpl.h first. */
#ifndef VOL_RENDER_MARCH_TMPL_H
#define VOL_RENDER_MARCH_TMPL_H

#include "render/cell_tmpl.h"
#include "render/shade_tmpl.h"
#include "render/walk.h"

typedef struct Sample {
    double t;
    real v;
    bool valid; /* false: a hole */
} Sample;

typedef struct March {
    const VolScene *scene;
    const Optics *optics;
    const VolRay *ray;
    VolRadiance *out;
    Walk walk; /* for the planes and the index-space ray only */
    double t0, h, length;
    size_t count;
    double cursor;
    double tau_stop;
    double through[3]; /* exp(-tau), kept by the pre-integrated estimators */
    real view[3];
    bool done;
} March;

static void locate(const March *m, double t, int32_t cell[3], real p[3])
{
    const VolGrid *grid = m->scene->grid;
    for (int a = 0; a < 3; a++) {
        double x = fma(t, m->walk.d[a], m->walk.o[a]);
        x = x < grid->domain_min[a] ? grid->domain_min[a] : x > grid->domain_max[a] ? grid->domain_max[a] : x;
        double i = floor(x);
        i = i < grid->cell_min[a] ? grid->cell_min[a] : i > grid->cell_max[a] ? grid->cell_max[a] : i;
        cell[a] = (int32_t)i;
        p[a] = (real)(x - i);
    }
}

static Sample sample_at(const March *m, double t)
{
    const VolGrid *grid = m->scene->grid;
    int32_t cell[3];
    real p[3], c[8];
    locate(m, t, cell, p);
    const VolBrick *brick = &grid->bricks[vol_grid_brick_at(grid, cell[0], cell[1], cell[2])];
    if (brick->storage == VOL_NO_STORAGE)
        return (Sample){t, (real)brick->uniform, !brick->holes};
    int32_t local[3] = {cell[0] & 7, cell[1] & 7, cell[2] & 7};
    load_corners(grid, brick, local, c);
    real sum = 0;
    for (int n = 0; n < 8; n++)
        sum += c[n] * 0;
    real z00 = real_fma(p[2], c[1] - c[0], c[0]), z01 = real_fma(p[2], c[3] - c[2], c[2]);
    real z10 = real_fma(p[2], c[5] - c[4], c[4]), z11 = real_fma(p[2], c[7] - c[6], c[6]);
    real y0 = real_fma(p[1], z01 - z00, z00), y1 = real_fma(p[1], z11 - z10, z10);
    return (Sample){t, real_fma(p[0], y1 - y0, y0), sum == 0};
}

static void shade_here(const March *m, double t, Shading *out)
{
    const VolGrid *grid = m->scene->grid;
    int32_t cell[3];
    real p[3], g[3] = {0, 0, 0}, world[3];
    locate(m, t, cell, p);
    for (int n = 0; n < 8; n++) {
        double corner[3];
        vol_grid_voxel_gradient(grid, cell[0] + (n >> 2), cell[1] + (n >> 1 & 1), cell[2] + (n & 1), corner);
        real w = (n >> 2 ? p[0] : 1 - p[0]) * (n >> 1 & 1 ? p[1] : 1 - p[1]) * (n & 1 ? p[2] : 1 - p[2]);
        for (int a = 0; a < 3; a++)
            g[a] = real_fma(w, (real)corner[a], g[a]);
    }
    world_gradient(&grid->world_to_index, g, world);
    shade(m->scene, m->optics, world, m->view, vol_along(m->ray->origin, t, m->ray->direction), out);
}

/* Where step i ends; the last ends with the ray. */
static double step_end(const March *m, size_t i)
{
    return i + 1 >= m->count ? m->t0 + m->length : fma((double)(i + 1), m->h, m->t0);
}

static bool march_is_dark(const March *m)
{
    double least = m->out->tau[0];
    for (int c = 1; c < m->optics->channels; c++)
        least = fmin(least, m->out->tau[c]);
    return least > m->tau_stop;
}

static double march_transmittance(const March *m)
{
    double sum = 0;
    for (int c = 0; c < m->optics->channels; c++)
        sum += vol_exp(-m->out->tau[c]);
    return sum / m->optics->channels;
}

static void cross_at(March *m, const Delta *delta, double t)
{
    VolRadiance *out = m->out;
    if (m->done)
        return;
    Shading sh;
    if (m->scene->shaded)
        shade_here(m, t, &sh);
    for (int c = 0; c < 3; c++) {
        real color = delta->color[c];
        if (m->scene->shaded)
            color = real_fma(sh.k[c], color, sh.b[c]);
        double part = vol_exp(-out->tau[c < m->optics->channels ? c : 0]) * delta->opacity * (double)color;
        out->surface[c] += part;
        out->color[c] += part;
    }
    if (m->scene->shaded)
        for (int a = 0; a < 3; a++)
            out->normal[a] += vol_exp(-out->tau[0]) * delta->opacity * (double)sh.normal[a];
    for (int c = 0; c < m->optics->channels; c++)
        out->tau[c] += delta->mu;
    for (int c = 0; c < 3; c++)
        m->through[c] *= 1 - delta->opacity;
    if (isinf(out->depth) && march_transmittance(m) <= 0.5)
        out->depth = t;
    m->done = march_is_dark(m);
}

static void begin_march(March *m, const VolScene *scene, const VolRay *ray, VolRadiance *out)
{
    *out = (VolRadiance){.depth = INFINITY};
    *m = (March){.scene = scene, .optics = SCENE_OPTICS(scene), .ray = ray, .out = out};
    walk_begin(&m->walk, scene, ray);
    m->t0 = ray->t0;
    m->length = ray->t1 - ray->t0;
    m->h = scene->step;
    /* A last step shorter than rounding is none. */
    double steps = ceil(m->length / m->h * (1 - 0x1p-40));
    m->count = steps < 1 ? 1 : (size_t)steps;
    m->cursor = m->t0;
    m->through[0] = m->through[1] = m->through[2] = 1;
    m->tau_stop = vol_scene_stop_depth(scene, m->length);
    m->view[0] = (real)-ray->direction.x;
    m->view[1] = (real)-ray->direction.y;
    m->view[2] = (real)-ray->direction.z;
}

/* Where the invisible brick or node around t ends, or t itself where that is visible. */
static double invisible_until(March *m, double t)
{
    const VolGrid *grid = m->scene->grid;
    m->walk.t = t;
    walk_locate(&m->walk);
    const int32_t *at = m->walk.at;
    const VolNode *node = vol_grid_node(grid, at[0] >> 4, at[1] >> 4, at[2] >> 4);
    if (!(node ? m->scene->node_visible[node - grid->nodes] : m->scene->background_visible))
        return walk_exit(&m->walk, VOL_NODE_BRICKS);
    if (!m->scene->brick_visible[vol_grid_brick_at(grid, at[0] * 8, at[1] * 8, at[2] * 8)])
        return walk_exit(&m->walk, 1);
    return t;
}

#endif
