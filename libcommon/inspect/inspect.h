/* What is in a stream: a description in JSON (from which the text is made too), and the statistics of its values. */
#ifndef VOL_INSPECT_INSPECT_H
#define VOL_INSPECT_INSPECT_H

#include <jansson.h>
#include <stdbool.h>
#include <stdint.h>

#include "base/mem.h"
#include "base/status.h"
#include "io/exr.h"
#include "io/vdb.h"

enum { VOL_BINS = 64 };

/* One grid's, grid component's or channel's values.  The histogram has VOL_BINS equal bins from min to max; it is drawn with
 * the logarithm of the counts, since empty space outweighs everything else. */
typedef struct VolSeries {
    char *name; /* "density", "velocity.x", "part: R" */
    uint64_t finite, nans, infinities;
    double min, max, sum; /* of the finite ones */
    uint64_t bins[VOL_BINS];
} VolSeries;

/* First all values into the range, then all of them again into the bins. */
void vol_series_range(VolSeries *series, double value, uint64_t weight);
void vol_series_bin(VolSeries *series, double value, uint64_t weight);

typedef struct VolInspection {
    json_t *description;
    VolSeries *series;
    size_t series_count;
    char *history; /* vol:history, or NULL */
} VolInspection;

/* `headers_only`: no voxel or pixel is decoded.  `size`: bytes of the file.  Grids that cannot be decoded are described by
 * what the container tells. */
VolStatus vol_inspect_vdb(const VolVdb *vdb, size_t size, bool headers_only, VolInspection *out, VolError *err);
VolStatus vol_inspect_exr(const VolImage *image, size_t size, bool headers_only, VolInspection *out, VolError *err);
void vol_inspection_free(VolInspection *inspection);

/* Sorted keys, numbers that read back to the same bits. */
VolStatus vol_inspection_json(const VolInspection *inspection, VolBytes *out, VolError *err);
/* For people.  Control characters of the input become '?'. */
VolStatus vol_inspection_text(const VolInspection *inspection, VolBytes *out, VolError *err);
/* The histograms (the first 16), one above the other, as a PNG.  VOL_BAD_INPUT where there is none. */
VolStatus vol_inspection_plot(const VolInspection *inspection, VolBytes *png, VolError *err);

/* ---- For the folder: building descriptions.  A want of memory shows in json_object_set_new's result. ---- */

/* A new series at the end of the list; *out dies with the next call. */
VolStatus vol_inspection_add_series(VolInspection *inspection, const char *name, VolSeries **out, VolError *err);
/* {"min", "max", "mean", "values", "nan", "inf", "histogram": {"from", "to", "counts"}} */
json_t *vol_series_json(const VolSeries *series);
json_t *vol_json_real(double value); /* "nan", "inf", "-inf" as text: JSON has no numbers for them */
json_t *vol_json_text(const char *text); /* bytes that are not UTF-8 become '?' */
json_t *vol_json_reals(const double *values, size_t count);
json_t *vol_json_ints(const int32_t *values, size_t count);

#endif
