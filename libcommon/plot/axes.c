#include <math.h>
#include <stdio.h>

#include "base/fmath.h"
#include "plot/raster.h"

enum { INK = 0x202020, PALE = 0xdddddd };

static int at(double fraction, int size) { return (int)nearbyint(fraction * (size - 1)); }

int vol_axes_x(const VolAxes *axes, double x)
{
    return axes->left + at((x - axes->x0) / (axes->x1 - axes->x0), axes->width);
}

int vol_axes_y(const VolAxes *axes, double y)
{
    double fraction = axes->log_y ? vol_log(y / axes->y0) / vol_log(axes->y1 / axes->y0)
                                  : (y - axes->y0) / (axes->y1 - axes->y0);
    return axes->top + axes->height - 1 - at(fraction, axes->height);
}

/* The step of 1, 2 or 5 times a power of ten that gives at most `most` steps over the range. */
static double round_step(double range, int most)
{
    double step = 1;
    while (step > range / most)
        step /= 10;
    while (step * 10 <= range / most)
        step *= 10;
    static const double factors[] = {1, 2, 5, 10};
    for (int i = 0; i < 4; i++)
        if (range / (step * factors[i]) <= most)
            return step * factors[i];
    return step * 10;
}

static void tick_x(VolRaster *raster, const VolAxes *axes, double value)
{
    char text[40];
    int x = vol_axes_x(axes, value), bottom = axes->top + axes->height;
    snprintf(text, sizeof text, "%.6g", value);
    vol_raster_line(raster, x, axes->top, x, bottom - 1, PALE);
    vol_raster_line(raster, x, bottom, x, bottom + 4, INK);
    vol_raster_text(raster, x - vol_raster_text_width(1, text) / 2, bottom + 8, 1, INK, text);
}

static void tick_y(VolRaster *raster, const VolAxes *axes, double value)
{
    char text[40];
    int y = vol_axes_y(axes, value);
    snprintf(text, sizeof text, value >= 1e5 ? "%.0e" : "%.6g", value);
    vol_raster_line(raster, axes->left, y, axes->left + axes->width - 1, y, PALE);
    vol_raster_line(raster, axes->left - 5, y, axes->left - 1, y, INK);
    vol_raster_text(raster, axes->left - 8 - vol_raster_text_width(1, text), y - 3, 1, INK, text);
}

static void linear_ticks(VolRaster *raster, const VolAxes *axes, double lo, double hi,
                         void (*tick)(VolRaster *, const VolAxes *, double))
{
    if (!(hi - lo > 0 && hi - lo < 1e300))
        return;
    double step = round_step(hi - lo, 8), first = ceil(lo / step);
    for (int i = 0; i < 20 && first + i <= floor(hi / step); i++)
        tick(raster, axes, (first + i) * step + 0.0); /* + 0: no "-0" */
}

void vol_axes_draw(VolRaster *raster, const VolAxes *axes, const char *title, const char *x_label, const char *y_label)
{
    linear_ticks(raster, axes, axes->x0, axes->x1, tick_x);
    if (axes->log_y) {
        double decade = 1;
        while (decade < axes->y0 && decade < 1e300)
            decade *= 10;
        for (; decade <= axes->y1; decade *= 10)
            tick_y(raster, axes, decade);
    } else {
        linear_ticks(raster, axes, axes->y0, axes->y1, tick_y);
    }
    int right = axes->left + axes->width, bottom = axes->top + axes->height;
    vol_raster_line(raster, axes->left - 1, axes->top, axes->left - 1, bottom, INK);
    vol_raster_line(raster, axes->left - 1, bottom, right, bottom, INK);
    vol_raster_text(raster, axes->left, axes->top - 24, 2, INK, title);
    vol_raster_text(raster, right - vol_raster_text_width(1, x_label), bottom + 20, 1, INK, x_label);
    vol_raster_text(raster, axes->left - 8 - vol_raster_text_width(1, y_label), axes->top - 12, 1, INK, y_label);
}
