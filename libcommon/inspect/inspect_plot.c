/* One panel per series: bars of the histogram, counts on a logarithmic axis. */
#include <stdio.h>

#include "inspect/inspect.h"
#include "io/pixels.h"
#include "plot/raster.h"

enum { WIDTH = 720, PANEL = 260, LEFT = 70, TOP = 44, BOTTOM = 36, RIGHT = 20, MOST = 16, BAR = 0x3b6ea5, PAPER = 0xffffff };

static void title_of(const VolSeries *series, char *title, size_t size)
{
    unsigned long long bad = series->nans + series->infinities;
    int n = snprintf(title, size, "%.40s: %llu values", series->name, (unsigned long long)series->finite);
    if (bad && n > 0 && (size_t)n < size)
        snprintf(title + n, size - (size_t)n, ", %llu not finite", bad);
}

static void draw_panel(VolRaster *raster, const VolSeries *series, int top)
{
    double most = 1, lo = series->min, hi = series->max;
    for (int i = 0; i < VOL_BINS; i++)
        most = (double)series->bins[i] > most ? (double)series->bins[i] : most;
    if (!(hi > lo)) { /* one value, or none: give the axis some width */
        double half = lo == 0 ? 0.5 : (lo < 0 ? -lo : lo) / 2;
        lo -= half;
        hi += half;
    }
    VolAxes axes = {.left = LEFT, .top = top + TOP, .width = WIDTH - LEFT - RIGHT, .height = PANEL - TOP - BOTTOM,
                    .x0 = lo, .x1 = hi, .y0 = 0.5, .y1 = most * 1.5, .log_y = true};
    char title[128];
    title_of(series, title, sizeof title);
    vol_axes_draw(raster, &axes, title, "value", "count");
    int bottom = axes.top + axes.height;
    bool spread = series->max > series->min;
    for (int i = 0; i < VOL_BINS; i++) {
        if (series->bins[i] == 0)
            continue;
        int x = spread ? axes.left + axes.width * i / VOL_BINS : axes.left + axes.width / 2 - 4;
        int next = spread ? axes.left + axes.width * (i + 1) / VOL_BINS : x + 9;
        int y = vol_axes_y(&axes, (double)series->bins[i]);
        vol_raster_box(raster, x, y, next - x - 1, bottom - y, BAR);
    }
}

VolStatus vol_inspection_plot(const VolInspection *inspection, VolBytes *png, VolError *err)
{
    int panels = inspection->series_count < MOST ? (int)inspection->series_count : MOST;
    *png = (VolBytes){0};
    if (panels == 0)
        return vol_fail(err, VOL_BAD_INPUT, "nothing to plot: no grid or channel could be decoded");
    VolRaster raster;
    VolStatus status = vol_raster_new(WIDTH, PANEL * panels, PAPER, &raster, err);
    if (status)
        return status;
    for (int i = 0; i < panels; i++)
        draw_panel(&raster, &inspection->series[i], PANEL * i);
    status = vol_png_encode(raster.rgb, raster.width, raster.height, png, err);
    vol_raster_free(&raster);
    return status;
}
