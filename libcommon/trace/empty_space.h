/* Empty-space skipping: which bricks a ray need not enter, found once from the ranges of their values. */
#ifndef VOL_TRACE_EMPTY_SPACE_H
#define VOL_TRACE_EMPTY_SPACE_H

#include <stdbool.h>
#include <stdint.h>

#include "base/status.h"
#include "volume/grid.h"

struct VolRay;
struct VolScene;

/* In `brick_visible`.  ENTERED: invisible, but entered all the same, for a test or because values may jump across its
 * invalid voxels. */
enum { VOL_BRICK_LEFT_OUT, VOL_BRICK_ENTERED, VOL_BRICK_SEEN };

/* In `levels`: a block of 2^level bricks a side, aligned, is invisible; or the brick is to be entered. */
enum { VOL_NODE_LEVEL = 4, VOL_WIDE = 254, VOL_VISIBLE = 255 };

typedef struct VolEmptySpace {
    uint8_t *brick_visible; /* one per brick of the grid: VOL_BRICK_... */
    uint8_t *levels;        /* 16^3 per node with bricks of its own: VOL_VISIBLE, or the invisible block around each */
    bool background_visible;
    int32_t visible_min[3], visible_max[3]; /* bricks: the box around the visible ones */
    int margin; /* a block of one value is crossed in one go but for so many bricks at its faces */
    uint64_t bricks_visible, bricks_skipped;
} VolEmptySpace;

/* By the scene's field, transfer function, estimator and step; `margin` is the caller's.  Without scene->skip all bricks
 * that hold any value are entered. */
VolStatus vol_empty_space_find(const struct VolScene *scene, VolEmptySpace *out, VolError *err);

/* Whether a clipped ray meets the box around the visible bricks. */
bool vol_empty_space_is_left(const struct VolScene *scene, const VolEmptySpace *space, const struct VolRay *ray);

void vol_empty_space_free(VolEmptySpace *space);

#endif
