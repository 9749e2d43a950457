/* Vectors and affine maps in double.  Rows: (x, y, z, 1) M, as OpenVDB and Imath have it. */
#ifndef VOL_BASE_VEC_H
#define VOL_BASE_VEC_H

#include <math.h>
#include <stdbool.h>

typedef struct VolVec3 {
    double x, y, z;
} VolVec3;

/* world = index * m[0..2] + m[3]; the last column of a 4x4 is always 0 0 0 1 and is not stored. */
typedef struct VolAffine {
    double m[4][3];
} VolAffine;

static inline VolVec3 vol_vec3(double x, double y, double z) { return (VolVec3){x, y, z}; }
static inline VolVec3 vol_add(VolVec3 a, VolVec3 b) { return vol_vec3(a.x + b.x, a.y + b.y, a.z + b.z); }
static inline VolVec3 vol_sub(VolVec3 a, VolVec3 b) { return vol_vec3(a.x - b.x, a.y - b.y, a.z - b.z); }
static inline VolVec3 vol_scale(VolVec3 a, double s) { return vol_vec3(a.x * s, a.y * s, a.z * s); }
static inline double vol_dot(VolVec3 a, VolVec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
static inline VolVec3 vol_cross(VolVec3 a, VolVec3 b)
{
    return vol_vec3(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
}
static inline double vol_length(VolVec3 a) { return sqrt(vol_dot(a, a)); }

/* a + s b */
static inline VolVec3 vol_along(VolVec3 a, double s, VolVec3 b)
{
    return vol_vec3(a.x + s * b.x, a.y + s * b.y, a.z + s * b.z);
}

static inline VolVec3 vol_apply_linear(const VolAffine *a, VolVec3 v)
{
    const double(*m)[3] = a->m;
    return vol_vec3(v.x * m[0][0] + v.y * m[1][0] + v.z * m[2][0], v.x * m[0][1] + v.y * m[1][1] + v.z * m[2][1],
                    v.x * m[0][2] + v.y * m[1][2] + v.z * m[2][2]);
}

static inline VolVec3 vol_apply(const VolAffine *a, VolVec3 p)
{
    return vol_add(vol_apply_linear(a, p), vol_vec3(a->m[3][0], a->m[3][1], a->m[3][2]));
}

/* False where the map is singular or not finite. */
bool vol_affine_invert(const VolAffine *a, VolAffine *inverse);

/* Determinant of the linear part: the signed volume of a voxel. */
double vol_affine_determinant(const VolAffine *a);

/* Length of the shortest basis vector: the `v` of lengths like 0.5v. */
double vol_affine_voxel(const VolAffine *a);

#endif
