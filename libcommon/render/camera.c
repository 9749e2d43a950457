#include "render/camera.h"

#include <math.h>
#include <string.h>

#include "base/fmath.h"

static const double PI = 3.14159265358979323846;

static VolVec3 domain_center(const VolVolume *volume)
{
    VolVec3 sum = {0, 0, 0};
    for (int n = 0; n < 8; n++)
        sum = vol_add(sum, vol_volume_corner(volume, n));
    return vol_scale(sum, 0.125);
}

static double domain_radius(const VolVolume *volume, VolVec3 center)
{
    double radius = 0;
    for (int n = 0; n < 8; n++)
        radius = fmax(radius, vol_length(vol_sub(vol_volume_corner(volume, n), center)));
    return radius;
}

static bool unit(VolVec3 v, VolVec3 *out)
{
    double length = vol_length(v);
    if (!(length > 0) || !isfinite(length))
        return false;
    *out = vol_scale(v, 1 / length);
    return true;
}

static VolStatus set_axes(const VolCameraSettings *settings, VolVec3 look_at, VolCamera *camera, VolError *err)
{
    VolVec3 up = settings->has_up ? settings->up : vol_vec3(0, 1, 0);
    if (!unit(vol_sub(look_at, camera->eye), &camera->forward))
        return vol_fail(err, VOL_USAGE, "the eye lies at the point it looks at");
    if (!unit(up, &up))
        return vol_fail(err, VOL_USAGE, "--up has no length");
    VolVec3 across = vol_cross(camera->forward, up);
    if (vol_length(across) < 1e-9) {
        if (settings->has_up)
            return vol_fail(err, VOL_USAGE, "--up lies along the view");
        across = vol_cross(camera->forward, vol_vec3(0, 0, camera->forward.y > 0 ? 1 : -1));
    }
    unit(across, &camera->right);
    camera->up = vol_cross(camera->right, camera->forward);
    return VOL_OK;
}

VolStatus vol_camera_set(const VolCameraSettings *settings, const VolVolume *volume, VolCamera *out, VolError *err)
{
    VolCamera *camera = out;
    *camera = (VolCamera){.width = settings->width, .height = settings->height, .orthographic = settings->orthographic};
    double aspect = (double)settings->width / (double)settings->height;
    VolVec3 center = domain_center(volume);
    double radius = fmax(domain_radius(volume, center), 1e-300), distance;
    if (settings->orthographic) {
        if (!(settings->ortho_height > 0))
            return vol_fail(err, VOL_USAGE, "--ortho wants a height above 0");
        camera->half_height = 0.5 * settings->ortho_height;
        distance = 2 * radius;
    } else {
        if (!(settings->fov_degrees > 0 && settings->fov_degrees < 180))
            return vol_fail(err, VOL_USAGE, "--fov wants an angle between 0 and 180 degrees");
        camera->half_height = vol_tan(settings->fov_degrees * (PI / 360));
        double smaller = camera->half_height * fmin(1, aspect);
        distance = radius * sqrt(1 + smaller * smaller) / smaller; /* radius / sin(half the smaller angle) */
    }
    VolVec3 look_at = settings->has_look_at ? settings->look_at : center;
    camera->eye = settings->has_eye ? settings->eye : vol_add(look_at, vol_vec3(0, 0, distance));
    return set_axes(settings, look_at, camera, err);
}

void vol_camera_ray(const VolCamera *camera, double x, double y, VolRay *out)
{
    double w = (double)camera->width, h = (double)camera->height;
    double across = (2 * x / w - 1) * camera->half_height * (w / h), upward = (1 - 2 * y / h) * camera->half_height;
    VolVec3 offset = vol_along(vol_scale(camera->right, across), upward, camera->up);
    *out = (VolRay){.origin = camera->eye, .direction = camera->forward, .t0 = 0, .t1 = INFINITY};
    if (camera->orthographic) {
        out->origin = vol_add(camera->eye, offset);
    } else {
        VolVec3 d = vol_add(camera->forward, offset);
        out->direction = vol_scale(d, 1 / vol_length(d));
    }
}

void vol_camera_matrices(const VolCamera *camera, double world_to_camera[16], double world_to_ndc[16])
{
    const VolVec3 axes[3] = {camera->right, camera->up, camera->forward};
    double *m = world_to_camera;
    memset(m, 0, 16 * sizeof *m);
    for (int j = 0; j < 3; j++) {
        m[j] = axes[j].x;
        m[4 + j] = axes[j].y;
        m[8 + j] = axes[j].z;
        m[12 + j] = -vol_dot(axes[j], camera->eye);
    }
    m[15] = 1;
    /* Camera space to NDC: x/(2 half_width) + 1/2, 1/2 - y/(2 half_height), over w = z (perspective) or 1. */
    double half_width = camera->half_height * (double)camera->width / (double)camera->height;
    double sx = 0.5 / half_width, sy = -0.5 / camera->half_height;
    for (int i = 0; i < 4; i++) {
        double x = m[4 * i], y = m[4 * i + 1], z = m[4 * i + 2], one = m[4 * i + 3];
        double w = camera->orthographic ? one : z;
        world_to_ndc[4 * i] = x * sx + 0.5 * w;
        world_to_ndc[4 * i + 1] = y * sy + 0.5 * w;
        world_to_ndc[4 * i + 2] = z;
        world_to_ndc[4 * i + 3] = w;
    }
}

VolStatus vol_camera_from_matrices(const double world_to_camera[16], const double world_to_ndc[16], int64_t width,
                                   int64_t height, VolCamera *out, VolError *err)
{
    const double *m = world_to_camera, *n = world_to_ndc;
    VolVec3 axis[3];
    for (int j = 0; j < 3; j++)
        axis[j] = vol_vec3(m[j], m[4 + j], m[8 + j]);
    VolVec3 right = axis[0], up = axis[1], forward = axis[2];
    bool rigid = fabs(vol_dot(right, up)) < 1e-4 && fabs(vol_dot(up, forward)) < 1e-4;
    rigid = rigid && fabs(vol_dot(forward, right)) < 1e-4;
    for (int j = 0; j < 3; j++)
        rigid = rigid && fabs(vol_length(axis[j]) - 1) < 1e-4 && unit(axis[j], &axis[j]);
    if (!rigid)
        return vol_fail(err, VOL_BAD_INPUT, "worldToCamera is not a rotation and a shift");
    VolVec3 eye = {0, 0, 0};
    for (int j = 0; j < 3; j++)
        eye = vol_along(eye, -m[12 + j], axis[j]);
    *out = (VolCamera){.width = width, .height = height, .eye = eye, .right = axis[0], .up = axis[1], .forward = axis[2]};
    /* w is 1 everywhere (orthographic) or the distance along the view. */
    double w_slope = sqrt(n[3] * n[3] + n[7] * n[7] + n[11] * n[11]);
    out->orthographic = w_slope < 1e-9 * fabs(n[15]);
    double w_scale = out->orthographic ? n[15] : w_slope;
    double sx = (n[0] * right.x + n[4] * right.y + n[8] * right.z) / w_scale;
    double sy = (n[1] * up.x + n[5] * up.y + n[9] * up.z) / w_scale;
    double along_x = 0.5, along_y = 0.5;
    if (!out->orthographic) {
        along_x = (n[0] * forward.x + n[4] * forward.y + n[8] * forward.z) / w_scale;
        along_y = (n[1] * forward.x + n[5] * forward.y + n[9] * forward.z) / w_scale;
    }
    if (!(sx > 0) || !(sy < 0) || fabs(along_x - 0.5) > 1e-4 || fabs(along_y - 0.5) > 1e-4)
        return vol_fail(err, VOL_BAD_INPUT, "worldToNDC is not a centred view along the camera's axis");
    out->half_height = -0.5 / sy;
    double aspect = 0.5 / sx / out->half_height;
    if (fabs(aspect * (double)height / (double)width - 1) > 1e-3)
        return vol_fail(err, VOL_BAD_INPUT, "the camera's picture is %.4g times as wide as high, --size %.4g times", aspect,
                        (double)width / (double)height);
    return VOL_OK;
}

bool vol_camera_behind(const VolCamera *camera, const VolVolume *volume)
{
    for (int n = 0; n < 8; n++)
        if (vol_dot(vol_sub(vol_volume_corner(volume, n), camera->eye), camera->forward) > 0)
            return false;
    return true;
}
