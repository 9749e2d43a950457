/* Are two images or two sets of grids the same, where not, and by how much?
 *
 * A pair of values is the same when both are finite and
 *   - no bound is given: they are equal (0 and -0 are);
 *   - --max and/or --rel is given: |a - b| <= max, or |a - b| <= rel * max(|a|, |b|): one of the two is enough, as max takes
 *     over where the values are near 0;
 *   - only --rms is given: always.
 * A channel or grid is the same when all its values are, and its root mean square difference is at most rms (if given).
 * NaN and infinities are never the same as anything, not even as themselves: an image of NaN fails against itself. */
#ifndef VOL_COMPARE_COMPARE_H
#define VOL_COMPARE_COMPARE_H

#include <stdbool.h>
#include <stdint.h>

#include "base/mem.h"
#include "base/status.h"
#include "io/exr.h"
#include "io/vdb.h"

typedef struct VolTolerance {
    bool max_given, rms_given, rel_given;
    double max, rms, rel;
} VolTolerance;

/* What was found: a line for everything that differs. */
typedef struct VolReport {
    VolBytes text;
    size_t capacity;
    bool different;
} VolReport;

/* Adds a line (the newline is added) and marks the report as `different`. */
VolStatus vol_report(VolReport *report, VolError *err, const char *format, ...) __attribute__((format(printf, 3, 4)));
void vol_report_free(VolReport *report);

/* How far two lists of values are apart; gathered value by value. */
typedef struct VolDeviation {
    double max;             /* largest |a - b| of finite pairs */
    int64_t max_at[3];      /* where */
    double max_a, max_b;    /* of what */
    double squares;         /* sum of (a - b)^2 of finite pairs */
    uint64_t count;         /* values seen */
    uint64_t different;     /* a != b or not finite */
    uint64_t failing;       /* outside the bounds, or not finite */
    uint64_t not_finite;
    int64_t not_finite_at[3]; /* the first */
} VolDeviation;

/* `weight` pairs of these values, the first at `at`. */
void vol_deviation_add(VolDeviation *d, const VolTolerance *tolerance, double a, double b, uint64_t weight,
                       const int64_t at[3]);
double vol_deviation_rms(const VolDeviation *d);
bool vol_deviation_passes(const VolDeviation *d, const VolTolerance *tolerance);
/* One line: "`what`: max 0.25 at 3,7 (0.5 and 0.25), rms 0.01, 12 of 4096 values differ".  `axes`: 2 or 3. */
VolStatus vol_deviation_report(const VolDeviation *d, const VolTolerance *tolerance, const char *what, int axes,
                               VolReport *report, VolError *err);

/* Parts are matched by name, or the only one with the only one; windows, channels and pixels are compared, attributes and
 * the channels' storage are not.  `difference` (may be NULL): |a - b| of the channels that could be compared, NaN where a
 * value is not finite; no parts if there were none. */
VolStatus vol_compare_images(const VolImage *a, const VolImage *b, const VolTolerance *tolerance, VolReport *report,
                             VolImage *difference, VolError *err);

/* An open file and the bytes that it owns. */
typedef struct VolVdbSide {
    const VolVdb *vdb;
    const unsigned char *bytes;
} VolVdbSide;

/* Grids are matched by name (the second of a name with the second of it); type, transform, background, active box, active
 * voxels and every voxel's value and state are compared, metadata and storage as half are not.  Grids that cannot be
 * decoded are the same if their bytes are. */
VolStatus vol_compare_grids(VolVdbSide a, VolVdbSide b, const VolTolerance *tolerance, VolReport *report, VolError *err);

#endif
