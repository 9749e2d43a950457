#include "trace/layers.h"

#include <stdio.h>
#include <string.h>

const VolLayerInfo vol_layers[VOL_LAYERS] = {
    [VOL_LAYER_Z] = {"Z", VOL_LAYER_OF_DEPTH, 0, 1, {"Z"}},
    [VOL_LAYER_NORMAL] = {"normal", VOL_LAYER_OF_SUM, VOL_SUM_NORMAL, 3, {"normal.X", "normal.Y", "normal.Z"}},
    [VOL_LAYER_SURFACE] = {"surface", VOL_LAYER_OF_SUM, VOL_SUM_SURFACE, 3, {"surface.R", "surface.G", "surface.B"}},
    [VOL_LAYER_SCATTER] = {"scatter", VOL_LAYER_OF_SUM, VOL_SUM_SCATTER, 3, {"scatter.R", "scatter.G", "scatter.B"}},
    [VOL_LAYER_EMIT] = {"emit", VOL_LAYER_OF_SUM, VOL_SUM_EMIT, 3, {"emit.R", "emit.G", "emit.B"}},
    [VOL_LAYER_STEPS] = {"steps", VOL_LAYER_OF_CELLS, 0, 1, {"steps"}},
    [VOL_LAYER_DIRECT] = {"direct", VOL_LAYER_OF_LIGHT, 0, 0, {0}},
    [VOL_LAYER_INDIRECT] = {"indirect", VOL_LAYER_OF_LIGHT, 0, 0, {0}},
};

static VolStatus fail_unknown(const char *name, int length, VolError *err)
{
    char names[256] = "";
    size_t used = 0;
    for (int i = 0; i < VOL_LAYERS && used < sizeof names; i++) {
        int n = snprintf(names + used, sizeof names - used, "%s%s", i ? ", " : "", vol_layers[i].name);
        used += n > 0 ? (size_t)n : 0;
    }
    return vol_fail(err, VOL_USAGE, "--aov: no layer '%.*s' (%s)", length, name, names);
}

VolStatus vol_layers_parse(const char *list, unsigned *layers, VolError *err)
{
    *layers = 0;
    for (const char *at = list; *at;) {
        size_t length = strcspn(at, ",");
        int i = 0;
        while (i < VOL_LAYERS && !(strlen(vol_layers[i].name) == length && memcmp(vol_layers[i].name, at, length) == 0))
            i++;
        if (i == VOL_LAYERS)
            return fail_unknown(at, (int)length, err);
        *layers |= 1u << i;
        at += length;
        if (*at == ',' && !*++at)
            return vol_fail(err, VOL_USAGE, "--aov: '%s' ends with a comma", list);
    }
    return VOL_OK;
}
