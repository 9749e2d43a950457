#include "tf/write.h"

#include <jansson.h>
#include <stdlib.h>

#include "base/refusals.h"

/* jansson takes NULL for a new value and says so: one check at the end, of `failed`, stands for all. */
typedef struct Writer {
    json_t *root;
    int failed;
} Writer;

static void put(Writer *w, json_t *object, const char *key, json_t *value)
{
    w->failed |= json_object_set_new(object, key, value) != 0;
}

static void append(Writer *w, json_t *array, json_t *value) { w->failed |= json_array_append_new(array, value) != 0; }

static json_t *color(Writer *w, const double rgb[3])
{
    json_t *list = json_array();
    for (int c = 0; c < 3; c++)
        append(w, list, json_real(rgb[c]));
    return list;
}

static void put_nodes(Writer *w, json_t *object, const char *key, const VolTfNodes *nodes, bool amount, bool colored)
{
    if (!nodes->count)
        return;
    json_t *list = json_array();
    for (size_t i = 0; i < nodes->count; i++) {
        json_t *node = json_array();
        append(w, node, json_real(nodes->nodes[i].v));
        if (amount)
            append(w, node, json_real(nodes->nodes[i].amount));
        if (colored)
            append(w, node, color(w, nodes->nodes[i].color));
        append(w, list, node);
    }
    put(w, object, key, list);
}

static void put_isosurfaces(Writer *w, const VolTf *tf)
{
    if (!tf->isosurface_count)
        return;
    json_t *list = json_array();
    for (size_t i = 0; i < tf->isosurface_count; i++) {
        const VolTfIsosurface *surface = &tf->isosurfaces[i];
        json_t *item = json_object();
        put(w, item, "value", json_real(surface->value));
        put(w, item, "opacity", json_real(surface->opacity));
        if (surface->color_given)
            put(w, item, "color", color(w, surface->color));
        append(w, list, item);
    }
    put(w, w->root, "isosurfaces", list);
}

static void put_surfaceness(Writer *w, const VolTf *tf)
{
    put_nodes(w, w->root, "surfaceness", &tf->surfaceness, true, false);
    if (!tf->surfaceness_by_gradient)
        return;
    json_t *object = json_object(), *ends = json_array();
    append(w, ends, json_real(tf->surfaceness_gradient[0]));
    append(w, ends, json_real(tf->surfaceness_gradient[1]));
    put(w, object, "gradient", ends);
    put(w, w->root, "surfaceness", object);
}

static void put_phase(Writer *w, const VolTf *tf)
{
    if (!tf->phase_given)
        return;
    json_t *object = json_object();
    if (tf->phase_table.count)
        put_nodes(w, object, "table", &tf->phase_table, false, true);
    else
        put(w, object, "hg", json_real(tf->phase_hg));
    put(w, w->root, "phase", object);
}

static void put_shading(Writer *w, const VolTf *tf)
{
    json_t *object = json_object();
    put(w, object, "ambient", json_real(tf->ambient));
    put(w, object, "diffuse", json_real(tf->diffuse));
    put(w, object, "specular", json_real(tf->specular));
    put(w, object, "shininess", json_real(tf->shininess));
    put(w, w->root, "shading", object);
}

VolStatus vol_tf_write(const VolTf *tf, char **text, VolError *err)
{
    static const char *const models[] = {[VOL_MODEL_HYBRID] = "hybrid", [VOL_MODEL_CLASSIC] = "classic",
                                         [VOL_MODEL_UNSHADED] = "unshaded"};
    vol_watch_jansson();
    Writer w = {.root = json_object()};
    put(&w, w.root, "pellucid", json_string("transfer-function/1"));
    put(&w, w.root, "interpolate", json_string(tf->interpolate == VOL_INTERPOLATE_OPACITY ? "opacity" : "extinction"));
    put(&w, w.root, "particle_step", json_real(tf->particle_step));
    if (tf->scalar_step_given)
        put(&w, w.root, "scalar_step", json_real(tf->scalar_step));
    put_nodes(&w, w.root, "surface", &tf->surface, true, true);
    put_nodes(&w, w.root, "scatter", &tf->scatter, true, true);
    put_nodes(&w, w.root, "absorb", &tf->absorb, true, true);
    put_nodes(&w, w.root, "emit", &tf->emit, true, true);
    put_isosurfaces(&w, tf);
    put_nodes(&w, w.root, "transport", &tf->transport, false, true);
    put_surfaceness(&w, tf);
    put_phase(&w, tf);
    put_shading(&w, tf);
    put(&w, w.root, "model", json_string(models[tf->model]));
    *text = w.failed ? NULL : json_dumps(w.root, JSON_COMPACT | JSON_REAL_PRECISION(17));
    json_decref(w.root);
    return *text ? VOL_OK : vol_fail_memory(err, 0);
}
