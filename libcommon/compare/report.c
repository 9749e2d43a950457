#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

#include "base/printable.h"
#include "compare/compare.h"

VolStatus vol_report(VolReport *report, VolError *err, const char *format, ...)
{
    char text[1024], line[1024];
    va_list args;
    va_start(args, format);
    vsnprintf(text, sizeof text, format, args);
    va_end(args);
    size_t length = vol_printable(line, sizeof line - 1, text);
    line[length++] = '\n';
    report->different = true;
    return vol_bytes_append(&report->text, &report->capacity, line, length, err);
}

void vol_report_free(VolReport *report)
{
    vol_bytes_free(&report->text);
    *report = (VolReport){0};
}

static bool same_value(const VolTolerance *t, double a, double b, double difference)
{
    if (!t->max_given && !t->rel_given)
        return t->rms_given || a == b;
    return (t->max_given && difference <= t->max) || (t->rel_given && difference <= t->rel * fmax(fabs(a), fabs(b)));
}

void vol_deviation_add(VolDeviation *d, const VolTolerance *tolerance, double a, double b, uint64_t weight,
                       const int64_t at[3])
{
    d->count += weight;
    if (!isfinite(a) || !isfinite(b)) {
        if (d->not_finite == 0)
            for (int i = 0; i < 3; i++)
                d->not_finite_at[i] = at[i];
        d->not_finite += weight;
        d->different += weight;
        d->failing += weight;
        return;
    }
    if (a == b)
        return;
    double difference = fabs(a - b);
    d->different += weight;
    d->squares += difference * difference * (double)weight;
    if (!same_value(tolerance, a, b, difference))
        d->failing += weight;
    if (difference > d->max) {
        d->max = difference;
        d->max_a = a;
        d->max_b = b;
        for (int i = 0; i < 3; i++)
            d->max_at[i] = at[i];
    }
}

double vol_deviation_rms(const VolDeviation *d)
{
    uint64_t finite = d->count - d->not_finite;
    return finite ? sqrt(d->squares / (double)finite) : 0;
}

bool vol_deviation_passes(const VolDeviation *d, const VolTolerance *tolerance)
{
    return d->failing == 0 && (!tolerance->rms_given || vol_deviation_rms(d) <= tolerance->rms);
}

static void place(const int64_t at[3], int axes, char *text, size_t size)
{
    if (axes == 2)
        snprintf(text, size, "%lld,%lld", (long long)at[0], (long long)at[1]);
    else
        snprintf(text, size, "%lld,%lld,%lld", (long long)at[0], (long long)at[1], (long long)at[2]);
}

VolStatus vol_deviation_report(const VolDeviation *d, const VolTolerance *tolerance, const char *what, int axes,
                               VolReport *report, VolError *err)
{
    if (vol_deviation_passes(d, tolerance))
        return VOL_OK;
    char finite[200] = "", infinite[160] = "", at[80];
    bool bounded = tolerance->max_given || tolerance->rel_given;
    if (d->max > 0) {
        place(d->max_at, axes, at, sizeof at);
        snprintf(finite, sizeof finite, "max %.9g at %s (%.9g and %.9g), rms %.9g, ", d->max, at, d->max_a, d->max_b,
                 vol_deviation_rms(d));
    }
    if (d->not_finite) {
        place(d->not_finite_at, axes, at, sizeof at);
        snprintf(infinite, sizeof infinite, ", %llu not finite, the first at %s", (unsigned long long)d->not_finite, at);
    }
    return vol_report(report, err, "%s: %s%llu of %llu values %s%s", what, finite,
                      (unsigned long long)(bounded ? d->failing : d->different), (unsigned long long)d->count,
                      bounded ? "beyond the bounds" : "differ", infinite);
}
