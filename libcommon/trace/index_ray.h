/* A ray in index space, where bricks are. */
#ifndef VOL_TRACE_INDEX_RAY_H
#define VOL_TRACE_INDEX_RAY_H

#include <math.h>

#include "trace/empty_space.h"
#include "trace/ray.h"

typedef struct IndexRay {
    double o[3], d[3], inv[3]; /* per world unit of t; inv: 1 / d, or 0 */
    double near[3];            /* places this close to each other rounding may have set apart: see coordinate_blur */
} IndexRay;

/* Where the ray runs along a plane of voxels and lies in it but for rounding, it lies in it: else what is said of the plane
 * alone, a plateau at an isosurface's value, would be lost to the voxels beside it. */
static inline IndexRay index_ray(const VolAffine *world_to_index, const VolRay *ray)
{
    const double(*m)[3] = world_to_index->m;
    VolVec3 o = vol_apply(world_to_index, ray->origin);
    VolVec3 d = vol_apply_linear(world_to_index, ray->direction);
    IndexRay out = {.o = {o.x, o.y, o.z}, .d = {d.x, d.y, d.z}};
    for (int a = 0; a < 3; a++) {
        double turn = fabs(ray->direction.x * m[0][a]) + fabs(ray->direction.y * m[1][a]) + fabs(ray->direction.z * m[2][a]);
        double terms = fabs(ray->origin.x * m[0][a]) + fabs(ray->origin.y * m[1][a]) + fabs(ray->origin.z * m[2][a]);
        double plane = floor(out.o[a] + 0.5);
        out.near[a] = 0x1p-47 * (terms + fabs(m[3][a]));
        if (fabs(out.d[a]) <= 0x1p-50 * turn)
            out.d[a] = 0;
        if (out.d[a] == 0 && fabs(out.o[a] - plane) <= out.near[a])
            out.o[a] = plane;
        out.inv[a] = out.d[a] == 0 ? 0 : 1 / out.d[a];
    }
    return out;
}

/* Whether the ray lies in a plane of voxels across axis a. */
static inline bool lies_in_plane(const IndexRay *ray, int a) { return ray->d[a] == 0 && ray->o[a] == floor(ray->o[a]); }

/* How far rounding may have taken the ray's coordinate x, or one near it. */
static inline double coordinate_blur(const IndexRay *ray, int a, double x) { return ray->near[a] + 0x1p-50 * fabs(x); }

/* Where the ray meets a plane across axis a: the one formula that all times of planes come from. */
static inline double plane_time(const IndexRay *ray, int a, double plane) { return (plane - ray->o[a]) * ray->inv[a]; }

/* Cuts [*t, *end] to the box around the visible bricks, outside which none are ever looked at. */
static inline void cut_to_visible(const IndexRay *ray, const VolEmptySpace *space, double *t, double *end)
{
    for (int a = 0; a < 3; a++) {
        double low = (double)space->visible_min[a] * VOL_BRICK_CELLS;
        double high = ((double)space->visible_max[a] + 1) * VOL_BRICK_CELLS;
        if (ray->d[a] != 0) {
            double entry = plane_time(ray, a, ray->d[a] > 0 ? low : high);
            double exit = plane_time(ray, a, ray->d[a] > 0 ? high : low);
            *t = entry > *t ? entry : *t;
            *end = exit < *end ? exit : *end;
        } else if (ray->o[a] < low || ray->o[a] > high) {
            *end = -INFINITY;
        }
    }
}

/* Where the ray leaves the domain across axis a, if through a face of cells (not in the middle of the only voxel along that
 * axis); else NAN. */
static inline double last_face_time(const VolGrid *grid, const IndexRay *ray, int a)
{
    double face = ray->d[a] > 0 ? grid->domain_max[a] : grid->domain_min[a];
    bool is_face = ray->d[a] != 0 && grid->domain_min[a] + 1 <= grid->domain_max[a] && face == floor(face);
    return is_face ? plane_time(ray, a, face) : NAN;
}

/* Along axis a, the brick from lo to hi that holds the ray from t on: the last whose entry plane is not behind t. */
static inline int32_t brick_at_time(const IndexRay *ray, int a, double t, int32_t lo, int32_t hi)
{
    double d = ray->d[a], x = d == 0 ? ray->o[a] : ray->o[a] + t * d, b = floor(x * (1.0 / VOL_BRICK_CELLS));
    int32_t at = (int32_t)(b < lo ? lo : b > hi ? hi : b);
    if (d > 0) {
        while (at < hi && plane_time(ray, a, ((double)at + 1) * VOL_BRICK_CELLS) <= t)
            at++;
        while (at > lo && plane_time(ray, a, (double)at * VOL_BRICK_CELLS) > t)
            at--;
    } else if (d < 0) {
        while (at > lo && plane_time(ray, a, (double)at * VOL_BRICK_CELLS) <= t)
            at--;
        while (at < hi && plane_time(ray, a, ((double)at + 1) * VOL_BRICK_CELLS) > t)
            at++;
    }
    return at;
}

#endif
