#include "base/vec.h"

static VolVec3 row(const VolAffine *a, int i) { return vol_vec3(a->m[i][0], a->m[i][1], a->m[i][2]); }

double vol_affine_determinant(const VolAffine *a) { return vol_dot(row(a, 0), vol_cross(row(a, 1), row(a, 2))); }

bool vol_affine_invert(const VolAffine *a, VolAffine *inverse)
{
    VolVec3 r0 = row(a, 0), r1 = row(a, 1), r2 = row(a, 2);
    VolVec3 c0 = vol_cross(r1, r2), c1 = vol_cross(r2, r0), c2 = vol_cross(r0, r1);
    double det = vol_dot(r0, c0);
    double bound = vol_length(r0) * vol_length(r1) * vol_length(r2);
    if (!isfinite(det) || !(fabs(det) > 1e-14 * bound))
        return false;
    VolVec3 columns[3] = {c0, c1, c2};
    for (int j = 0; j < 3; j++) {
        inverse->m[0][j] = columns[j].x / det;
        inverse->m[1][j] = columns[j].y / det;
        inverse->m[2][j] = columns[j].z / det;
    }
    for (int j = 0; j < 3; j++)
        inverse->m[3][j] = 0;
    VolVec3 back = vol_apply_linear(inverse, row(a, 3));
    inverse->m[3][0] = -back.x;
    inverse->m[3][1] = -back.y;
    inverse->m[3][2] = -back.z;
    return isfinite(back.x) && isfinite(back.y) && isfinite(back.z);
}

double vol_affine_voxel(const VolAffine *a)
{
    return fmin(vol_length(row(a, 0)), fmin(vol_length(row(a, 1)), vol_length(row(a, 2))));
}
