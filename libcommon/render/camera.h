/* Pinhole and orthographic cameras.  Pixel (i, j) looks through (i + 0.5, j + 0.5); row 0 is on top, pixels are square. */
#ifndef VOL_RENDER_CAMERA_H
#define VOL_RENDER_CAMERA_H

#include <stdbool.h>
#include <stdint.h>

#include "base/status.h"
#include "base/vec.h"
#include "trace/scene.h"

typedef struct VolCamera {
    int64_t width, height;
    VolVec3 eye, right, up, forward; /* unit, right-handed: right x up = -forward */
    bool orthographic;
    double half_height;              /* of the picture: world units, or the tangent of half the vertical angle */
} VolCamera;

typedef struct VolCameraSettings {
    int64_t width, height;
    bool has_eye, has_look_at, has_up;
    VolVec3 eye, look_at, up;
    bool orthographic;
    double fov_degrees, ortho_height;
} VolCameraSettings;

/* What is not given: the view from +z on the mean of the domain's corners, with the sphere through the farthest corner
 * just inside the smaller field of view.  VOL_USAGE: eye at the point looked at, up along the view, angle outside
 * (0, 180). */
VolStatus vol_camera_set(const VolCameraSettings *settings, const VolVolume *volume, VolCamera *out, VolError *err);

/* The ray through picture position (x, y) in pixels from the top left corner; t from 0 (the eye, or its plane). */
void vol_camera_ray(const VolCamera *camera, double x, double y, VolRay *out);

/* Row-vector matrices as OpenEXR's standard attributes have them: camera space is left-handed with +z forward; NDC runs
 * from (0, 0) at the top left to (1, 1) at the bottom right of the display window. */
void vol_camera_matrices(const VolCamera *camera, double world_to_camera[16], double world_to_ndc[16]);

/* The camera that such matrices describe.  VOL_BAD_INPUT: not rigid, not centred, or pixels not square for this size. */
VolStatus vol_camera_from_matrices(const double world_to_camera[16], const double world_to_ndc[16], int64_t width,
                                   int64_t height, VolCamera *out, VolError *err);

/* All corners of the domain lie behind the eye's plane. */
bool vol_camera_behind(const VolCamera *camera, const VolVolume *volume);

#endif
