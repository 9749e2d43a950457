/* Layers: what a picture can hold beside colour and alpha.  A new one is a row of the table in layers.c, and the place in
 * source_tmpl.h or accumulate_tmpl.h where its amounts arise; everything between - kernels' sums, pixels, channels of the
 * image, `--probe` - goes through the table. */
#ifndef VOL_TRACE_LAYERS_H
#define VOL_TRACE_LAYERS_H

#include <stdbool.h>

#include "base/status.h"

/* Sums over a ray, each of three numbers: every light as it comes through what is in front of it. */
typedef enum VolSum {
    VOL_SUM_NORMAL, /* of weight times unit normal turned to the viewer, over surfaces */
    VOL_SUM_SURFACE,
    VOL_SUM_SCATTER,
    VOL_SUM_EMIT,
    VOL_SUMS
} VolSum;

typedef enum VolLayer {
    VOL_LAYER_Z,
    VOL_LAYER_NORMAL,
    VOL_LAYER_SURFACE,
    VOL_LAYER_SCATTER,
    VOL_LAYER_EMIT,
    VOL_LAYER_STEPS,
    VOL_LAYER_DIRECT,
    VOL_LAYER_INDIRECT,
    VOL_LAYERS
} VolLayer;

typedef enum VolLayerKind {
    VOL_LAYER_OF_SUM,  /* `sum` says which */
    VOL_LAYER_OF_DEPTH,
    VOL_LAYER_OF_CELLS, /* how many were integrated */
    VOL_LAYER_OF_LIGHT  /* a picture of its own for each part of the light: render/light_layers.h */
} VolLayerKind;

typedef struct VolLayerInfo {
    const char *name; /* as in `--aov` */
    VolLayerKind kind;
    VolSum sum;
    int components;
    const char *channels[3];
} VolLayerInfo;

extern const VolLayerInfo vol_layers[VOL_LAYERS];

/* Sets of layers: a bit each. */
static inline bool vol_has_layer(unsigned layers, VolLayer layer) { return layers >> layer & 1; }

/* "Z,normal,surface,scatter,emit,steps,direct,indirect" -> a set; VOL_USAGE lists the names. */
VolStatus vol_layers_parse(const char *list, unsigned *layers, VolError *err);

#endif
