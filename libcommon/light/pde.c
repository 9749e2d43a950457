#include "light/pde.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/fmath.h"
#include "base/mem.h"
#include "base/pool.h"
#include "light/depths.h"
#include "light/gauss_seidel.h"
#include "light/strength.h"
#include "light/upwind.h"

typedef struct Solver {
    const VolPde *of;
    size_t light;     /* as printed: at hand */
    float *row;       /* three channels of a row for every thread */
    VolDepths depths; /* as printed */
    float *extinction[3], *transmittance[3];
    double voxel; /* as printed: the shortest edge of the lattice */
} Solver;

static size_t row_of(const VolPde *p, size_t x, size_t y) { return (x * (size_t)p->n[1] + y) * (size_t)p->n[2]; }

static size_t voxels_of(const VolPde *p) { return (size_t)p->n[0] * (size_t)p->n[1] * (size_t)p->n[2]; }

static VolVec3 place_of(const VolPde *p, size_t x, size_t y, int32_t z)
{
    return vol_apply(&p->index_to_world, vol_vec3((double)x, (double)y, (double)z));
}

static VolVec3 axis_of(const VolPde *p, int a)
{
    const double *m = p->index_to_world.m[a];
    return vol_vec3(m[0], m[1], m[2]);
}

static VolStatus check_axes(const VolPde *p, VolError *err)
{
    for (int a = 0; a < 3; a++) {
        VolVec3 u = axis_of(p, a), v = axis_of(p, (a + 1) % 3);
        if (!(fabs(vol_dot(u, v)) <= 1e-6 * vol_length(u) * vol_length(v)))
            return vol_fail(err, VOL_USAGE, "--method pde: the volume's axes are not orthogonal");
    }
    return VOL_OK;
}

/* ---- Light before it spreads ---- */

static double absorbed(double t, double absorption)
{
    return absorption == 1 ? t : t > 0 ? vol_pow(t, absorption) : 0;
}

static bool is_occluder(const VolPde *p, size_t v) { return p->medium && p->medium[v] == VOL_MEDIUM_OCCLUDER; }

/* Adds one light to a row of what there is. */
static void add_light(const VolPde *p, size_t x, size_t y, const VolLight *light, double absorption, float *const t[3])
{
    size_t v = row_of(p, x, y);
    for (int32_t z = 0; z < p->n[2]; z++, v++) {
        double strength = is_occluder(p, v) ? 0 : vol_light_strength(light, place_of(p, x, y, z), p->nearest);
        for (int c = 0; c < 3; c++)
            p->total[c][v] += (float)(light->rgb[c] * strength * absorbed((double)t[c][z], absorption));
    }
}

static VolStatus light_row(void *user, size_t index, int thread, VolError *err)
{
    const Solver *s = user;
    const VolPde *p = s->of;
    size_t x = index / (size_t)p->n[1], y = index % (size_t)p->n[1], length = (size_t)p->n[2];
    float *row = s->row + 3 * length * (size_t)thread, *const t[3] = {row, row + length, row + 2 * length};
    for (size_t k = 0; k < p->light_count; k++) {
        VolStatus status = p->transmittance(p->user, k, (int32_t)x, (int32_t)y, thread, t, err);
        if (status != VOL_OK)
            return status;
        add_light(p, x, y, &p->lights[k], p->absorption, t);
    }
    return VOL_OK;
}

static VolStatus light_rows(Solver *s, VolError *err)
{
    const VolPde *p = s->of;
    size_t threads = p->threads < 1 ? 1 : (size_t)p->threads;
    if (!(s->row = vol_alloc(3 * threads, (size_t)p->n[2] * sizeof *s->row)))
        return vol_fail_memory(err, 3 * threads * (size_t)p->n[2] * sizeof *s->row);
    VolStatus status = vol_parallel(p->threads, (size_t)p->n[0] * (size_t)p->n[1], light_row, s, err);
    free(s->row);
    return status;
}

/* ---- As printed ---- */

/* Towards `light`, one voxel long, the voxel in its middle. */
static VolVec3 half_way(const Solver *s, const VolLight *light, VolVec3 place)
{
    VolVec3 way = vol_light_stands(light) ? vol_sub(place, light->position) : light->direction;
    double length = vol_length(way);
    return length > 0 ? vol_scale(way, 0.5 * s->voxel / length) : vol_vec3(0, 0, 0);
}

/* What attenuates the light around each voxel, all of it: a voxel's length of the light's way with it in the middle. */
static VolStatus extinction_row(void *user, size_t index, int thread, VolError *err)
{
    enum { SOME = 256 };
    const Solver *s = user;
    const VolPde *p = s->of;
    const VolLight *light = &p->lights[s->light];
    size_t x = index / (size_t)p->n[1], y = index % (size_t)p->n[1];
    VolVec3 from[SOME], to[SOME];
    double depth[SOME][3];
    for (int32_t first = 0; first < p->n[2]; first += SOME) {
        int32_t count = p->n[2] - first < SOME ? p->n[2] - first : SOME;
        for (int32_t i = 0; i < count; i++) {
            VolVec3 place = place_of(p, x, y, first + i), half = half_way(s, light, place);
            from[i] = vol_sub(place, half);
            to[i] = vol_add(place, half);
        }
        VolStatus status = vol_depths_between(&s->depths, thread, from, to, (size_t)count, depth, err);
        if (status != VOL_OK)
            return status;
        for (int32_t i = 0; i < count; i++) {
            size_t v = row_of(p, x, y) + (size_t)(first + i);
            bool blank = p->medium && p->medium[v] == VOL_MEDIUM_BLANK;
            for (int c = 0; c < 3 && s->extinction[c]; c++) {
                double extinction = fmin(depth[i][c] / s->voxel * p->absorption, 1e30);
                s->extinction[c][v] = is_occluder(p, v) ? 1e30f : blank ? 0 : (float)extinction;
            }
        }
    }
    return VOL_OK;
}

static VolStatus sweep_channel(const Solver *s, int c, VolError *err)
{
    const VolPde *p = s->of;
    const VolLight *light = &p->lights[s->light];
    VolUpwind u = {.n = {p->n[0], p->n[1], p->n[2]}, .from_point = vol_light_stands(light), .extinction = s->extinction[c],
                   .transmittance = s->transmittance[c], .threads = p->threads, .cpu = p->cpu};
    VolAffine to_index;
    if (!vol_affine_invert(&p->index_to_world, &to_index))
        return vol_fail(err, VOL_BAD_INPUT, "the volume's transform cannot be inverted");
    VolVec3 at = vol_apply(&to_index, light->position);
    const double index[3] = {at.x, at.y, at.z};
    for (int a = 0; a < 3; a++) {
        VolVec3 axis = axis_of(p, a);
        u.edge[a] = vol_length(axis);
        u.light[a] = u.from_point ? index[a] : vol_dot(light->direction, axis) / u.edge[a];
    }
    return vol_upwind(&u, err);
}

static VolStatus add_swept_row(void *user, size_t index, int thread, VolError *err)
{
    (void)thread;
    (void)err;
    const Solver *s = user;
    const VolPde *p = s->of;
    size_t x = index / (size_t)p->n[1], y = index % (size_t)p->n[1];
    float *t[3];
    for (int c = 0; c < 3; c++)
        t[c] = s->transmittance[s->transmittance[c] ? c : 0] + row_of(p, x, y);
    add_light(p, x, y, &p->lights[s->light], 1, t); /* what attenuates was multiplied already */
    return VOL_OK;
}

static VolStatus convect_light(Solver *s, VolError *err)
{
    const VolPde *p = s->of;
    size_t rows = (size_t)p->n[0] * (size_t)p->n[1];
    VolStatus status = vol_parallel(p->threads, rows, extinction_row, s, err);
    for (int c = 0; status == VOL_OK && c < 3 && s->extinction[c]; c++)
        status = sweep_channel(s, c, err);
    return status == VOL_OK ? vol_parallel(p->threads, rows, add_swept_row, s, err) : status;
}

static VolStatus convect(Solver *s, VolError *err)
{
    const VolPde *p = s->of;
    const int channels = p->scene->tf->coloured ? 3 : 1;
    bool enough = true;
    s->voxel = vol_affine_voxel(&p->index_to_world);
    for (int c = 0; c < channels; c++) {
        s->extinction[c] = vol_alloc(voxels_of(p), sizeof(float));
        s->transmittance[c] = vol_alloc(voxels_of(p), sizeof(float));
        enough = enough && s->extinction[c] && s->transmittance[c];
    }
    VolStatus status = enough ? VOL_OK : vol_fail_memory(err, voxels_of(p) * sizeof(float));
    if (status == VOL_OK)
        status = vol_depths_new(p->scene, p->scene->tf, 2, p->threads, &s->depths, err);
    for (s->light = 0; status == VOL_OK && s->light < p->light_count; s->light++)
        status = convect_light(s, err);
    vol_depths_free(&s->depths);
    for (int c = 0; c < channels; c++) {
        free(s->extinction[c]);
        free(s->transmittance[c]);
    }
    return status;
}

/* ---- Both ---- */

/* Rounding is not to make light negative. */
static VolStatus keep_positive(void *user, size_t x, int thread, VolError *err)
{
    (void)thread;
    (void)err;
    const VolPde *p = user;
    for (int c = 0; c < 3; c++)
        for (size_t v = row_of(p, x, 0); v < row_of(p, x + 1, 0); v++)
            p->total[c][v] = p->total[c][v] > 0 ? p->total[c][v] : 0;
    return VOL_OK;
}

static VolStatus spread(const VolPde *p, double *residual, VolError *err)
{
    VolDiffusion d = {.channels = 3, .medium = p->medium, .threads = p->threads, .cpu = p->cpu};
    for (int c = 0; c < 3; c++) {
        d.n[c] = p->n[c];
        d.field[c] = p->total[c];
        for (int a = 0; a < 3; a++) {
            double edge = vol_length(axis_of(p, a));
            d.s[c][a] = p->spread[c] / (edge * edge);
        }
    }
    if (!p->transmittance)
        return vol_relax_as_printed(&d, p->sweeps, err);
    VolStatus status = p->preview ? vol_diffuse_preview(&d, err) : vol_diffuse(&d, residual, err);
    return status == VOL_OK ? vol_parallel(p->threads, (size_t)p->n[0], keep_positive, (void *)p, err) : status;
}

VolStatus vol_pde_solve(const VolPde *pde, double *residual, VolError *err)
{
    Solver s = {.of = pde};
    VolStatus status = check_axes(pde, err);
    if (residual)
        *residual = 0;
    if (status != VOL_OK)
        return status;
    for (int c = 0; c < 3; c++)
        memset(pde->total[c], 0, voxels_of(pde) * sizeof(float));
    status = pde->transmittance ? light_rows(&s, err) : convect(&s, err);
    return status == VOL_OK ? spread(pde, residual, err) : status;
}
