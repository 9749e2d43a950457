/* What a point of the volume sends towards the eye, whoever asks: the colours of what scatters, of surfaces and isosurfaces,
 * shaded; K's classic model.  Estimators bring the amounts, integrated in their own ways.
 *
 * Light that reaches the point, and the phase function, belong here: factors of `scatter` beside that of the classic model.
 *
 * PARAMETERS  VOL_DOUBLE
 * PROVIDES    Source, source_at(), classic_factors_at(), needs_gradient(), shaded_color(), isosurface_color() */
#ifndef VOL_TRACE_SOURCE_TMPL_H
#define VOL_TRACE_SOURCE_TMPL_H

#include "trace/properties_tmpl.h"
#include "trace/shading_tmpl.h"

/* Whether gradients are asked for in an interval: of surfaces, in the classic model (K 11) of what scatters. */
ALWAYS_INLINE ints needs_gradient(reals has_surface, const reals scatter[2], unsigned features)
{
    ints needed = (ints)(has_surface > 0);
    if (features & FEATURE_CLASSIC)
        needed |= (ints)(scatter[0] != 0) | (ints)(scatter[1] != 0);
    return needed;
}

/* A surface's colour, of that opacity: diffuse and ambient light times it, and the highlight. */
ALWAYS_INLINE reals shaded_color(const Shading *sh, int c, reals color, reals opacity)
{
    return reals_fma(sh->k[c], color, sh->b[c] * opacity);
}

static inline real isosurface_color(const Isosurface *isosurface, const Shading *sh, unsigned i, int c)
{
    return sh ? real_fma(sh->k[c][i], isosurface->color[c], sh->b[c][i]) : isosurface->color[c];
}

/* K 11: the factor of the scattering colour; `line` is the interval's surfaceness. */
ALWAYS_INLINE void classic_factors_at(const TfTables *tables, reals x, const reals line[2], const Shading *sh,
                                      const reals *lit, reals factor[3])
{
    classic_factors(surfaceness_of(tables, property_at(line, x), sh), sh, lit, factor);
}

/* Colours: radiance per unit of what scatters and of surfaces. */
typedef struct Source {
    reals scatter[3], surface[3];
} Source;

/* At v = ref + x; `sh` where something is shaded, or lit without being shaded; `lit`: the light on what scatters,
 * NULL: 1. */
ALWAYS_INLINE void source_at(const TfTables *tables, const Properties *in, reals x, const Shading *sh, const reals *lit,
                             unsigned features, Source *out)
{
    reals factor[3];
    if (features & FEATURE_CLASSIC)
        classic_factors_at(tables, x, in->surfaceness, sh, lit, factor);
    for (int c = 0; c < 3; c++) {
        reals color = property_at(in->scatter_color[c], x);
        if (features & FEATURE_CLASSIC)
            out->scatter[c] = color * factor[c];
        else
            out->scatter[c] = features & FEATURE_LIT && lit ? color * lit[c] : color;
    }
    for (int c = 0; c < 3 && features & FEATURE_SURFACE; c++) {
        reals color = property_at(in->surface_color[c], x);
        if (features & FEATURE_SHADED)
            out->surface[c] = shaded_color(sh, c, color, reals_all(1));
        else
            out->surface[c] = features & FEATURE_LIT && lit ? color * sh->k[c] : color;
    }
}

#endif
