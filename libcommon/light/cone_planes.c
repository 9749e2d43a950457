/* Where the planes of `cone` stand. */
#include <math.h>

#include "light/cone.h"

enum { MOST_ACROSS = 1 << 15, MOST_PLANES = 1 << 20 };

static VolVec3 corner_of(const VolConeDomain *d, int n)
{
    return vol_apply(&d->index_to_world, vol_vec3(n & 1 ? d->hi[0] : d->lo[0], n & 2 ? d->hi[1] : d->lo[1],
                                                  n & 4 ? d->hi[2] : d->lo[2]));
}

static VolVec3 middle_of(const VolConeDomain *d)
{
    return vol_apply(&d->index_to_world,
                     vol_vec3(0.5 * (d->lo[0] + d->hi[0]), 0.5 * (d->lo[1] + d->hi[1]), 0.5 * (d->lo[2] + d->hi[2])));
}

static VolVec3 unit(VolVec3 a) { return vol_scale(a, 1 / vol_length(a)); }

/* Of the coordinate axes the one most across it, made orthogonal. */
static void across_of(VolVec3 along, VolVec3 out[2])
{
    double x = fabs(along.x), y = fabs(along.y), z = fabs(along.z);
    VolVec3 axis = x <= y && x <= z ? vol_vec3(1, 0, 0) : y <= z ? vol_vec3(0, 1, 0) : vol_vec3(0, 0, 1);
    out[0] = unit(vol_along(axis, -vol_dot(axis, along), along));
    out[1] = vol_cross(along, out[0]);
}

/* The inverse of columns along, across[0], across[1]. */
static bool set_inverse(VolConePlanes *p)
{
    const VolVec3 *u = &p->across[0], *v = &p->across[1];
    VolVec3 rows[3] = {vol_cross(*u, *v), vol_cross(*v, p->along), vol_cross(p->along, *u)};
    double volume = vol_dot(rows[0], p->along);
    for (int r = 0; r < 3; r++) {
        rows[r] = vol_scale(rows[r], 1 / volume);
        p->to_plane[r][0] = rows[r].x;
        p->to_plane[r][1] = rows[r].y;
        p->to_plane[r][2] = rows[r].z;
    }
    return isfinite(1 / volume) && volume != 0;
}

/* Coordinates along the light, and on the lattice, of a place. */
static void on_planes(const VolConePlanes *p, VolVec3 place, double out[3])
{
    VolVec3 d = vol_sub(place, p->origin);
    for (int r = 0; r < 3; r++)
        out[r] = p->to_plane[r][0] * d.x + p->to_plane[r][1] * d.y + p->to_plane[r][2] * d.z;
    if (p->spreads)
        for (int r = 1; r < 3; r++)
            out[r] /= out[0];
}

VolVec3 vol_cone_place(const VolConePlanes *p, double k, double i, double j)
{
    VolVec3 across = vol_along(vol_scale(p->across[0], p->low[0] + i), p->low[1] + j, p->across[1]);
    double w = p->first + k * p->step;
    return p->spreads ? vol_along(p->origin, w, vol_add(p->along, across))
                      : vol_add(vol_along(p->origin, w, p->along), across);
}

/* ---- What the domain reaches over ---- */

typedef struct Extent {
    double lo[3], hi[3]; /* along the light, and on the lattice */
    double least_cosine; /* of the angle to the axis under which a corner is seen; a sun: 1 */
} Extent;

static Extent extent_of(const VolConePlanes *p, const VolConeDomain *domain)
{
    Extent e = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}, 1};
    for (int n = 0; n < 8; n++) {
        double at[3];
        VolVec3 corner = corner_of(domain, n), way = vol_sub(corner, p->origin);
        on_planes(p, corner, at);
        for (int a = 0; a < 3; a++) {
            e.lo[a] = fmin(e.lo[a], at[a]);
            e.hi[a] = fmax(e.hi[a], at[a]);
        }
        if (p->spreads)
            e.least_cosine = fmin(e.least_cosine, vol_dot(way, p->along) / vol_length(way) / vol_length(p->along));
    }
    return e;
}

/* How near the domain comes to a place; 0: it lies in it.  In skewed voxels no nearer than that. */
static double distance_to(const VolConeDomain *domain, VolVec3 place)
{
    VolAffine to_index;
    if (!vol_affine_invert(&domain->index_to_world, &to_index))
        return 0;
    VolVec3 at = vol_apply(&to_index, place);
    const double *lo = domain->lo, *hi = domain->hi;
    VolVec3 nearest = vol_vec3(fmin(fmax(at.x, lo[0]), hi[0]), fmin(fmax(at.y, lo[1]), hi[1]),
                               fmin(fmax(at.z, lo[2]), hi[2]));
    return vol_length(vol_sub(vol_apply(&domain->index_to_world, nearest), place));
}

static double tangent_of(double cosine) { return sqrt(fmax(1 - cosine * cosine, 1e-12)) / cosine; }

static VolStatus set_view(const VolLight *light, const VolConeDomain *domain, VolConePlanes *p, Extent *e, VolError *err)
{
    const double half_of_90 = 0.70710678118654752440 * (1 - 1e-12);
    double distance = distance_to(domain, light->position);
    if (distance == 0)
        return vol_fail(err, VOL_USAGE, "a light of --method cone lies outside the domain");
    double cosine = e->least_cosine;
    if (light->kind == VOL_LIGHT_SPOT) {
        double along = vol_length(p->along), edge = tangent_of(light->cos_edge) * along / vol_length(p->across[0]);
        bool straddles = e->lo[0] <= 0;
        for (int a = 1; a < 3 && light->cos_edge > 0; a++) {
            e->lo[a] = straddles ? -edge : fmax(e->lo[a], -edge);
            e->hi[a] = straddles ? edge : fmin(e->hi[a], edge);
        }
        e->lo[0] = fmax(e->lo[0], distance / along * fmax(light->cos_edge, 0.5));
        cosine = fmax(cosine, light->cos_edge);
    }
    if (!(cosine >= half_of_90) || !(e->lo[0] > 0))
        return vol_fail(err, VOL_USAGE, "--method cone: a light sees the domain under at most 90 degrees");
    e->hi[0] = fmax(e->hi[0], e->lo[0]);
    return VOL_OK;
}

/* Lattice points from lo to hi and `margin` beyond, at least two each way, no more than twice as many again. */
static VolStatus set_lattice(VolConePlanes *p, const Extent *e, double margin, VolError *err)
{
    for (int a = 0; a < 2; a++) {
        double x = e->lo[1 + a], y = e->hi[1 + a], lo = floor(fmin(x, y)), hi = ceil(fmax(x, y)), wide = ceil(margin);
        wide = fmin(wide, fmax(16, hi - lo));
        if (!(hi - lo + 2 * wide + 2 < MOST_ACROSS))
            return vol_fail(err, VOL_BAD_INPUT, "the domain is %g lattice points wide across the light", hi - lo);
        p->low[a] = (int32_t)(lo - wide);
        p->size[a] = (int32_t)(hi - lo + 2 * wide) + 2;
    }
    return VOL_OK;
}

static VolStatus set_planes(VolConePlanes *p, const Extent *e, double distance, VolError *err)
{
    double planes = fmax(ceil((e->hi[0] - e->lo[0]) / distance - 1e-6), 1);
    if (!(planes < MOST_PLANES))
        return vol_fail(err, VOL_BAD_INPUT, "the domain is %g voxels long along the light", planes);
    p->count = (int32_t)planes;
    p->first = e->lo[0];
    p->step = (e->hi[0] - e->lo[0]) / planes;
    return VOL_OK;
}

VolStatus vol_cone_planes(const VolLight *light, const VolConeDomain *domain, double voxel, double rate, VolConePlanes *out,
                          VolError *err)
{
    VolVec3 middle = middle_of(domain), way = vol_sub(middle, light->position);
    *out = (VolConePlanes){.spreads = vol_light_stands(light)};
    out->origin = out->spreads ? light->position : middle;
    if (light->kind == VOL_LIGHT_POINT && !(vol_length(way) > 0))
        return vol_fail(err, VOL_USAGE, "a light of --method cone lies outside the domain");
    out->along = light->kind == VOL_LIGHT_POINT ? unit(way) : light->direction;
    across_of(out->along, out->across);
    double spacing = voxel;
    if (out->spreads)
        spacing = voxel / fmax(vol_dot(way, out->along), voxel);
    if (light->kind == VOL_LIGHT_SPOT && light->cos_edge > 0) /* its profile, too, is to be seen */
        spacing = fmin(spacing, tangent_of(light->cos_edge) / 8);
    for (int a = 0; a < 2; a++)
        out->across[a] = vol_scale(out->across[a], spacing);
    if (!set_inverse(out))
        return vol_fail(err, VOL_BAD_INPUT, "the domain's voxels are too small or too large for the light's planes");
    Extent e = extent_of(out, domain);
    VolStatus status = out->spreads ? set_view(light, domain, out, &e, err) : VOL_OK;
    /* Of a light that spreads: of tangents, the integral of rate dw / w^2. */
    double variance = out->spreads ? rate * (1 / e.lo[0] - 1 / e.hi[0]) : rate * (e.hi[0] - e.lo[0]);
    if (status == VOL_OK)
        status = set_lattice(out, &e, 2 + 4 * sqrt(variance) / spacing, err);
    return status == VOL_OK ? set_planes(out, &e, voxel, err) : status;
}

VolStatus vol_cone_slices(const VolLight *light, const VolConeDomain *domain, VolConePlanes *out, VolError *err)
{
    VolAffine to_index;
    if (!vol_affine_invert(&domain->index_to_world, &to_index))
        return vol_fail(err, VOL_BAD_INPUT, "the domain's transform cannot be inverted");
    VolVec3 middle = middle_of(domain);
    *out = (VolConePlanes){.spreads = vol_light_stands(light)};
    out->origin = out->spreads ? light->position : middle;
    VolVec3 way = light->kind == VOL_LIGHT_POINT ? vol_sub(middle, light->position) : light->direction;
    VolVec3 index = vol_apply_linear(&to_index, way);
    const double x[3] = {index.x, index.y, index.z};
    int most = 0;
    for (int a = 1; a < 3; a++)
        most = fabs(x[a]) > fabs(x[most]) ? a : most;
    if (x[most] == 0)
        return vol_fail(err, VOL_USAGE, "a light of --method cone lies outside the domain");
    /* One slice further, for lights that spread at the distance of one slice. */
    out->along = vol_scale(way, 1 / fabs(x[most]));
    VolVec3 edge[3] = {vol_vec3(1, 0, 0), vol_vec3(0, 1, 0), vol_vec3(0, 0, 1)};
    double slices = fabs(x[most]);
    for (int a = 0; a < 2; a++)
        out->across[a] = vol_scale(vol_apply_linear(&domain->index_to_world, edge[(most + 1 + a) % 3]),
                                   out->spreads ? 1 / fmax(slices, 1) : 1);
    if (light->kind == VOL_LIGHT_SPOT) { /* `slices` says nothing of its distance */
        VolVec3 far = vol_apply_linear(&to_index, vol_sub(middle, light->position));
        const double f[3] = {far.x, far.y, far.z};
        for (int a = 0; a < 2; a++)
            out->across[a] = vol_scale(out->across[a], fmax(slices, 1) / fmax(fabs(f[most]), 1));
    }
    if (!set_inverse(out))
        return vol_fail(err, VOL_BAD_INPUT, "the domain's voxels are too small or too large for the light's planes");
    Extent e = extent_of(out, domain);
    VolStatus status = out->spreads ? set_view(light, domain, out, &e, err) : VOL_OK;
    if (status == VOL_OK)
        status = set_lattice(out, &e, 8, err);
    return status == VOL_OK ? set_planes(out, &e, 1, err) : status;
}
