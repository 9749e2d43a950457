#include "plot/raster.h"

#include <stdlib.h>
#include <string.h>

#include "base/mem.h"

VolStatus vol_raster_new(int width, int height, uint32_t color, VolRaster *out, VolError *err)
{
    *out = (VolRaster){.width = width, .height = height};
    out->rgb = vol_alloc((size_t)width * (size_t)height, 3);
    if (!out->rgb)
        return vol_fail_memory(err, (size_t)width * (size_t)height * 3);
    vol_raster_box(out, 0, 0, width, height, color);
    return VOL_OK;
}

void vol_raster_free(VolRaster *raster)
{
    free(raster->rgb);
    *raster = (VolRaster){0};
}

static void dot(VolRaster *raster, int x, int y, uint32_t color)
{
    if (x < 0 || y < 0 || x >= raster->width || y >= raster->height)
        return;
    unsigned char *pixel = raster->rgb + 3 * ((size_t)y * (size_t)raster->width + (size_t)x);
    pixel[0] = (unsigned char)(color >> 16);
    pixel[1] = (unsigned char)(color >> 8 & 255);
    pixel[2] = (unsigned char)(color & 255);
}

void vol_raster_box(VolRaster *raster, int x, int y, int width, int height, uint32_t color)
{
    for (int j = y; j < y + height; j++)
        for (int i = x; i < x + width; i++)
            dot(raster, i, j, color);
}

/* Bresenham's. */
void vol_raster_line(VolRaster *raster, int x0, int y0, int x1, int y1, uint32_t color)
{
    int dx = abs(x1 - x0), dy = -abs(y1 - y0), step_x = x0 < x1 ? 1 : -1, step_y = y0 < y1 ? 1 : -1, off = dx + dy;
    for (;;) {
        dot(raster, x0, y0, color);
        if (x0 == x1 && y0 == y1)
            return;
        int twice = 2 * off;
        if (twice >= dy) {
            off += dy;
            x0 += step_x;
        }
        if (twice <= dx) {
            off += dx;
            y0 += step_y;
        }
    }
}

void vol_raster_text(VolRaster *raster, int x, int y, int scale, uint32_t color, const char *text)
{
    for (; *text; text++, x += 6 * scale) {
        const unsigned char *rows = vol_raster_glyph(*text);
        for (int row = 0; row < 7; row++)
            for (int column = 0; column < 5; column++)
                if (rows[row] >> (4 - column) & 1)
                    vol_raster_box(raster, x + column * scale, y + row * scale, scale, scale, color);
    }
}

int vol_raster_text_width(int scale, const char *text) { return text[0] ? ((int)strlen(text) * 6 - 1) * scale : 0; }
