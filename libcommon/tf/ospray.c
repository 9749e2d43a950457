/* The binary .tfn files of OSPRay's transfer function module, little-endian without padding:
 *
 *     4 bytes "FTSO" | u64 version = 1 | u64 n, name[n] | u64 colours | u64 opacities | f64 min | f64 max
 *     | f32 opacity scaling | colours x (f32 r, g, b) | opacities x (f32 position, opacity)
 *
 * Colours lie evenly from 0 to 1, positions are from 0 to 1, all of them fractions of min to max; where that is 0 to 1,
 * or empty, of the data's range.  Its editor lets points hang below 0: those are 0. */
#include "tf/foreign_private.h"

#include <math.h>
#include <string.h>

typedef struct Cursor {
    const VolForeign *f;
    const VolBytes *bytes;
    size_t at;
} Cursor;

/* `size` bytes as a little-endian number. */
static VolStatus take(Cursor *c, size_t size, uint64_t *out)
{
    if (c->bytes->size - c->at < size)
        return vol_foreign_fault(c->f, 0, "it ends at byte %zu, in the middle", c->bytes->size);
    *out = 0;
    for (size_t i = size; i-- > 0;)
        *out = *out << 8 | c->bytes->data[c->at + i];
    c->at += size;
    return VOL_OK;
}

static VolStatus take_real(Cursor *c, size_t size, double *out)
{
    uint64_t bits = 0;
    VolStatus status = take(c, size, &bits);
    if (status != VOL_OK)
        return status;
    if (size == 4) {
        uint32_t low = (uint32_t)bits;
        float value;
        memcpy(&value, &low, sizeof value);
        *out = (double)value;
    } else {
        memcpy(out, &bits, sizeof *out);
    }
    if (!isfinite(*out))
        return vol_foreign_fault(c->f, 0, "the number at byte %zu is not finite", c->at - size);
    return VOL_OK;
}

typedef struct Header {
    uint64_t version, name, colors, opacities;
    double min, max, scaling;
} Header;

static VolStatus read_header(Cursor *c, Header *h)
{
    VolStatus status = take(c, 8, &h->version);
    if (status == VOL_OK && h->version != 1)
        return vol_foreign_fault(c->f, 0, "version %llu of .tfn is not known", (unsigned long long)h->version);
    if (status == VOL_OK)
        status = take(c, 8, &h->name);
    if (status == VOL_OK && h->name > c->bytes->size - c->at)
        return vol_foreign_fault(c->f, 0, "its name is longer than the file");
    if (status != VOL_OK)
        return status;
    c->at += (size_t)h->name;
    status = take(c, 8, &h->colors);
    if (status == VOL_OK)
        status = take(c, 8, &h->opacities);
    if (status == VOL_OK)
        status = take_real(c, 8, &h->min);
    if (status == VOL_OK)
        status = take_real(c, 8, &h->max);
    if (status == VOL_OK)
        status = take_real(c, 4, &h->scaling);
    if (status != VOL_OK)
        return status;
    size_t rest = c->bytes->size - c->at;
    if (h->colors > rest / 12 || h->opacities > (rest - (size_t)h->colors * 12) / 8)
        return vol_foreign_fault(c->f, 0, "it ends at byte %zu, before the last of %llu colours and %llu opacities",
                                 c->bytes->size, (unsigned long long)h->colors, (unsigned long long)h->opacities);
    if (!h->colors || !h->opacities)
        return vol_foreign_fault(c->f, 0, "it has no %s", h->colors ? "opacities" : "colours");
    return VOL_OK;
}

static VolStatus read_colors(Cursor *c, const Header *h, VolForeignPoints *out)
{
    VolStatus status = VOL_OK;
    for (uint64_t i = 0; i < h->colors && status == VOL_OK; i++) {
        double rgb[3] = {0}, v = h->colors > 1 ? (double)i / (double)(h->colors - 1) : 0;
        for (int k = 0; k < 3 && status == VOL_OK; k++)
            status = take_real(c, 4, &rgb[k]);
        if (status == VOL_OK)
            status = vol_foreign_add_color(c->f, out, 0, v, rgb[0], rgb[1], rgb[2]);
    }
    return status;
}

static VolStatus read_opacities(Cursor *c, const Header *h, VolForeignPoints *out)
{
    VolStatus status = VOL_OK;
    for (uint64_t i = 0; i < h->opacities && status == VOL_OK; i++) {
        double v = 0, opacity = 0;
        status = take_real(c, 4, &v);
        if (status == VOL_OK)
            status = take_real(c, 4, &opacity);
        if (status == VOL_OK)
            status = vol_foreign_add_opacity(c->f, out, 0, v, fmax(opacity, 0) * h->scaling, 0.5, 0);
    }
    return status;
}

static void place(const Header *h, VolForeignPoints *points)
{
    for (size_t i = 0; i < points->count; i++)
        points->items[i].v = h->min * (1 - points->items[i].v) + h->max * points->items[i].v;
}

VolStatus vol_foreign_ospray(VolForeign *f, const VolBytes *bytes, VolTf *out, VolTfUnits *units)
{
    Cursor c = {f, bytes, 4};
    Header h = {0};
    VolForeignPoints colors = {0}, opacity = {0};
    VolStatus status = vol_foreign_no_parts(f);
    if (status == VOL_OK)
        status = read_header(&c, &h);
    if (status == VOL_OK)
        status = read_colors(&c, &h, &colors);
    if (status == VOL_OK)
        status = read_opacities(&c, &h, &opacity);
    units->relative = !(h.max > h.min) || (h.min == 0 && h.max == 1);
    if (status == VOL_OK && !units->relative) {
        place(&h, &colors);
        place(&h, &opacity);
    }
    if (status == VOL_OK)
        status = vol_foreign_finish(f, &colors, VOL_COLOR_RGB, &opacity, out);
    vol_foreign_points_free(&colors);
    vol_foreign_points_free(&opacity);
    return status;
}
