/* A picture of bytes with boxes, lines and small capitals, and axes to plot in: enough for a histogram that can be read. */
#ifndef VOL_PLOT_RASTER_H
#define VOL_PLOT_RASTER_H

#include <stdbool.h>
#include <stdint.h>

#include "base/status.h"

typedef struct VolRaster {
    int width, height;
    unsigned char *rgb; /* row 0 on top */
} VolRaster;

/* Colours are 0xRRGGBB.  What lies outside the picture is not drawn. */
VolStatus vol_raster_new(int width, int height, uint32_t color, VolRaster *out, VolError *err);
void vol_raster_free(VolRaster *raster);
void vol_raster_box(VolRaster *raster, int x, int y, int width, int height, uint32_t color); /* filled */
void vol_raster_line(VolRaster *raster, int x0, int y0, int x1, int y1, uint32_t color);     /* one pixel wide */

/* Letters of 5 x 7 cells in a pitch of 6, times `scale`; (x, y) is the top left.  Small letters are drawn as capitals,
 * what the font lacks as an empty box. */
void vol_raster_text(VolRaster *raster, int x, int y, int scale, uint32_t color, const char *text);
int vol_raster_text_width(int scale, const char *text);

/* Seven rows of five bits, the leftmost the highest. */
const unsigned char *vol_raster_glyph(char letter);

/* A rectangle of the picture where x runs from x0 to x1 and y from y0 (bottom) to y1; y logarithmic on demand (y0 > 0). */
typedef struct VolAxes {
    int left, top, width, height;
    double x0, x1, y0, y1;
    bool log_y;
} VolAxes;

int vol_axes_x(const VolAxes *axes, double x);
int vol_axes_y(const VolAxes *axes, double y);

/* Frame, ticks at round numbers (decades where logarithmic) with their numbers, grid lines, what the axes are (x at the
 * right, below the numbers; y on top of its axis), and the title above. */
void vol_axes_draw(VolRaster *raster, const VolAxes *axes, const char *title, const char *x_label, const char *y_label);

#endif
