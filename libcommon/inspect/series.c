#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/refusals.h"
#include "inspect/inspect.h"

void vol_series_range(VolSeries *series, double value, uint64_t weight)
{
    if (isnan(value)) {
        series->nans += weight;
    } else if (isinf(value)) {
        series->infinities += weight;
    } else {
        series->min = series->finite == 0 || value < series->min ? value : series->min;
        series->max = series->finite == 0 || value > series->max ? value : series->max;
        series->finite += weight;
        series->sum += value * (double)weight;
    }
}

void vol_series_bin(VolSeries *series, double value, uint64_t weight)
{
    if (!isfinite(value))
        return;
    double range = series->max - series->min;
    double fraction = range > 0 && isfinite(range) ? (value - series->min) / range : 0;
    int bin = (int)(fraction * VOL_BINS);
    series->bins[bin < VOL_BINS ? bin : VOL_BINS - 1] += weight;
}

VolStatus vol_inspection_add_series(VolInspection *inspection, const char *name, VolSeries **out, VolError *err)
{
    VolSeries *list = vol_resize(inspection->series, inspection->series_count + 1, sizeof *list);
    if (!list)
        return vol_fail_memory(err, (inspection->series_count + 1) * sizeof *list);
    inspection->series = list;
    VolSeries *series = &list[inspection->series_count];
    *series = (VolSeries){.name = vol_copy_text(name)};
    if (!series->name)
        return vol_fail_memory(err, strlen(name) + 1);
    inspection->series_count++;
    *out = series;
    return VOL_OK;
}

void vol_inspection_free(VolInspection *inspection)
{
    for (size_t i = 0; i < inspection->series_count; i++)
        free(inspection->series[i].name);
    free(inspection->series);
    free(inspection->history);
    json_decref(inspection->description);
    *inspection = (VolInspection){0};
}

/* ---- JSON ---------------------------------------------------------------------------------------------------------- */

json_t *vol_json_real(double value)
{
    if (isnan(value))
        return json_string("nan");
    return isinf(value) ? json_string(value < 0 ? "-inf" : "inf") : json_real(value);
}

json_t *vol_json_text(const char *text)
{
    json_t *string = json_string(text);
    char *ascii = string ? NULL : vol_copy_text(text);
    if (!ascii)
        return string;
    for (char *c = ascii; *c; c++)
        if ((unsigned char)*c > 126)
            *c = '?';
    string = json_string(ascii);
    free(ascii);
    return string;
}

json_t *vol_json_reals(const double *values, size_t count)
{
    json_t *array = json_array();
    for (size_t i = 0; i < count; i++)
        json_array_append_new(array, vol_json_real(values[i]));
    return array;
}

json_t *vol_json_ints(const int32_t *values, size_t count)
{
    json_t *array = json_array();
    for (size_t i = 0; i < count; i++)
        json_array_append_new(array, json_integer(values[i]));
    return array;
}

json_t *vol_series_json(const VolSeries *series)
{
    json_t *object = json_object();
    json_object_set_new(object, "values", json_integer((json_int_t)(series->finite + series->nans + series->infinities)));
    json_object_set_new(object, "nan", json_integer((json_int_t)series->nans));
    json_object_set_new(object, "inf", json_integer((json_int_t)series->infinities));
    if (series->finite == 0)
        return object;
    json_object_set_new(object, "min", vol_json_real(series->min));
    json_object_set_new(object, "max", vol_json_real(series->max));
    json_object_set_new(object, "mean", vol_json_real(series->sum / (double)series->finite));
    json_t *counts = json_array(), *histogram = json_object();
    for (int i = 0; i < VOL_BINS; i++)
        json_array_append_new(counts, json_integer((json_int_t)series->bins[i]));
    json_object_set_new(histogram, "from", vol_json_real(series->min));
    json_object_set_new(histogram, "to", vol_json_real(series->max));
    json_object_set_new(histogram, "counts", counts);
    json_object_set_new(object, "histogram", histogram);
    return object;
}

VolStatus vol_inspection_json(const VolInspection *inspection, VolBytes *out, VolError *err)
{
    vol_watch_jansson();
    char *text = json_dumps(inspection->description, JSON_INDENT(2) | JSON_SORT_KEYS | JSON_REAL_PRECISION(17));
    size_t capacity = 0;
    *out = (VolBytes){0};
    if (!text)
        return vol_fail_memory(err, 0);
    VolStatus status = vol_bytes_append(out, &capacity, text, strlen(text), err);
    if (!status)
        status = vol_bytes_append(out, &capacity, "\n", 1, err);
    free(text);
    return status;
}
