/* Transfer functions as users write them: JSON, checked to the last number.
 *
 * The text is parsed by jansson; everything after that is ours: which keys there are, what they may hold, and
 * where in the file a fault lies.  A fault is reported by line, key and node; jansson keeps no positions of
 * values, so the line is found by a second walk over the text, which only a failing run pays for. */
#include "tf/tf.h"

#include "tf/json.h"
#include "tf/limits.h"
#include "tf/locate.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define FORMAT_NAME "transfer-function/1"

/* Differences of two such values stay finite. */
#define LARGEST_VALUE 1e300

typedef struct Parser {
    const char *text; /* without a byte order mark */
    size_t size;
    const char *name; /* of the file */
    VolError *err;
    const char *key; /* where we are: a key of the outermost object, NULL outside any */
    size_t node;     /* and the element of its list, from 1; 0 outside any */
    const char *item; /* what an element is called: "node", "isosurface" */
} Parser;

/* ---- Faults ---- */

/* "bad transfer function 'FILE': line 7: key 'scatter', node 3: WHY" */
__attribute__((format(printf, 2, 3))) static VolStatus fault(const Parser *p, const char *format, ...)
{
    char why[512], where[256] = "", line[40] = "";
    va_list args;
    va_start(args, format);
    vsnprintf(why, sizeof why, format, args);
    va_end(args);
    size_t number = p->key ? vol_json_line(p->text, p->size, p->key, p->node) : 0;
    if (number)
        snprintf(line, sizeof line, "line %zu: ", number);
    if (p->key && p->node)
        snprintf(where, sizeof where, "key '%.180s', %s %zu: ", p->key, p->item, p->node);
    else if (p->key)
        snprintf(where, sizeof where, "key '%.180s': ", p->key);
    return vol_fail(p->err, VOL_BAD_INPUT, "bad transfer function '%.200s': %s%s%s", p->name, line, where, why);
}

/* ---- Values ---- */

static const char *type_name(const json_t *value)
{
    switch (json_typeof(value)) {
    case JSON_OBJECT: return "an object";
    case JSON_ARRAY: return "a list";
    case JSON_STRING: return "a string";
    case JSON_INTEGER:
    case JSON_REAL: return "a number";
    case JSON_NULL: return "null";
    default: return "true or false";
    }
}

static VolStatus read_number(const Parser *p, const json_t *value, const char *what, double min, double max,
                             double *out)
{
    if (!json_is_number(value))
        return fault(p, "%s is %s, not a number", what, type_name(value));
    double x = json_number_value(value);
    if (!isfinite(x))
        return fault(p, "%s is not finite", what);
    if (x < min && max >= VOL_BRIGHTEST) /* no end that anybody meets */
        return fault(p, "%s %.9g is less than %g", what, x, min);
    if (!(x >= min && x <= max))
        return fault(p, "%s %.9g lies outside [%g, %g]", what, x, min, max);
    *out = x;
    return VOL_OK;
}

static VolStatus read_positive(const Parser *p, const json_t *value, double *out)
{
    double x = 0;
    VolStatus status = read_number(p, value, "value", -INFINITY, INFINITY, &x);
    if (status != VOL_OK)
        return status;
    if (!(x > 0))
        return fault(p, "%.9g is not greater than 0", x);
    *out = x;
    return VOL_OK;
}

static VolStatus read_color(const Parser *p, const json_t *value, double max, double out[3])
{
    if (!json_is_array(value) || json_array_size(value) != 3)
        return fault(p, "a colour is a list of three numbers, [r, g, b]");
    static const char *const names[3] = {"red", "green", "blue"};
    for (size_t c = 0; c < 3; c++) {
        VolStatus status = read_number(p, json_array_get(value, c), names[c], 0, max, &out[c]);
        if (status != VOL_OK)
            return status;
    }
    return VOL_OK;
}

static VolStatus read_choice(const Parser *p, const json_t *value, const char *const *choices, const char *listed,
                             int *out)
{
    if (!json_is_string(value))
        return fault(p, "%s where one of %s is expected", type_name(value), listed);
    for (int i = 0; choices[i]; i++)
        if (strcmp(json_string_value(value), choices[i]) == 0) {
            *out = i;
            return VOL_OK;
        }
    return fault(p, "'%.80s' is none of %s", json_string_value(value), listed);
}

/* ---- Lists of nodes ---- */

/* What the elements of a list look like: [v, amount, [r, g, b]?], [v, amount] or [v, [r, g, b]]. */
typedef struct NodeForm {
    const char *v_name, *amount_name; /* amount_name NULL: no amount, the colour is required */
    double v_min, v_max, amount_max, color_max;
    bool color; /* may (without amount: must) have one */
    const char *shape;
} NodeForm;

#define SHAPE(amount) "a node is [value, " amount "] or [value, " amount ", [r, g, b]]"
#define ANY_VALUE "value", .v_min = -LARGEST_VALUE, .v_max = LARGEST_VALUE

static const NodeForm opacity_form = {ANY_VALUE, .amount_name = "opacity", .amount_max = 1, .color_max = VOL_BRIGHTEST,
                                      .color = true, .shape = SHAPE("opacity")};
static const NodeForm absorb_form = {ANY_VALUE, .amount_name = "density", .amount_max = 1, .color_max = 1,
                                     .color = true, .shape = SHAPE("density")};
static const NodeForm emit_form = {ANY_VALUE, .amount_name = "strength", .amount_max = VOL_BRIGHTEST,
                                   .color_max = VOL_BRIGHTEST, .color = true, .shape = SHAPE("strength")};
static const NodeForm transport_form = {ANY_VALUE, .color_max = 1, .color = true,
                                        .shape = "a node is [value, [r, g, b]]"};
static const NodeForm surfaceness_form = {ANY_VALUE, .amount_name = "surfaceness", .amount_max = 1,
                                          .shape = "a node is [value, surfaceness]"};
static const NodeForm phase_form = {.v_name = "cosine", .v_min = -1, .v_max = 1, .color_max = VOL_BRIGHTEST,
                                    .color = true, .shape = "a node is [cosine, [r, g, b]]"};

static VolStatus read_node(const Parser *p, const json_t *value, const NodeForm *form, VolTfNode *out)
{
    size_t size = json_is_array(value) ? json_array_size(value) : 0;
    if (size < 2 || size > (form->amount_name && form->color ? 3 : 2))
        return fault(p, "%s", form->shape);
    *out = (VolTfNode){.color = {1, 1, 1}};
    VolStatus status = read_number(p, json_array_get(value, 0), form->v_name, form->v_min, form->v_max, &out->v);
    if (status == VOL_OK && form->amount_name)
        status = read_number(p, json_array_get(value, 1), form->amount_name, 0, form->amount_max, &out->amount);
    if (status == VOL_OK && !form->amount_name)
        status = read_color(p, json_array_get(value, 1), form->color_max, out->color);
    else if (status == VOL_OK && size == 3)
        status = read_color(p, json_array_get(value, 2), form->color_max, out->color);
    return status;
}

static VolStatus check_order(const Parser *p, const NodeForm *form, const VolTfNode *nodes, size_t i)
{
    if (i >= 1 && nodes[i].v < nodes[i - 1].v)
        return fault(p, "%s %.9g comes after %.9g, nodes must ascend", form->v_name, nodes[i].v, nodes[i - 1].v);
    if (i >= 2 && nodes[i].v == nodes[i - 2].v)
        return fault(p, "a third node at %s %.9g, two make a jump", form->v_name, nodes[i].v);
    return VOL_OK;
}

static VolStatus read_nodes(Parser *p, const json_t *value, const NodeForm *form, VolTfNodes *out)
{
    if (!json_is_array(value))
        return fault(p, "%s where a list of nodes is expected", type_name(value));
    size_t count = json_array_size(value);
    if (!count)
        return VOL_OK;
    out->nodes = vol_alloc(count, sizeof *out->nodes);
    if (!out->nodes)
        return vol_fail_memory(p->err, count * sizeof *out->nodes);
    out->count = count;
    VolStatus status = VOL_OK;
    p->item = "node";
    for (size_t i = 0; i < count && status == VOL_OK; i++) {
        p->node = i + 1;
        status = read_node(p, json_array_get(value, i), form, &out->nodes[i]);
        if (status == VOL_OK)
            status = check_order(p, form, out->nodes, i);
    }
    p->node = 0;
    return status;
}

/* ---- Keys ---- */

typedef VolStatus ReadKey(Parser *p, const json_t *value, VolTf *tf);

typedef struct KeyRow {
    const char *name;
    ReadKey *read;
} KeyRow;

/* The keys of one object: the file itself or, inside a key, one of its parts. */
static VolStatus read_keys(Parser *p, const json_t *object, const KeyRow *rows, const char *expected, VolTf *tf)
{
    bool outermost = !p->key;
    if (!json_is_object(object))
        return fault(p, "%s where %s is expected", type_name(object), expected);
    const char *key;
    json_t *value;
    json_object_foreach((json_t *)object, key, value) {
        const KeyRow *row = rows;
        while (row->name && strcmp(row->name, key) != 0)
            row++;
        if (outermost)
            p->key = key;
        if (!row->name)
            return outermost ? fault(p, "no such key") : fault(p, "no such key '%.80s' in it", key);
        VolStatus status = row->read(p, value, tf);
        if (status != VOL_OK)
            return status;
        if (outermost)
            p->key = NULL;
    }
    return VOL_OK;
}

static VolStatus read_pellucid(Parser *p, const json_t *value, VolTf *tf)
{
    (void)tf;
    if (!json_is_string(value) || strcmp(json_string_value(value), FORMAT_NAME) != 0)
        return fault(p, "%s%.80s where '" FORMAT_NAME "' is expected",
                     json_is_string(value) ? "" : type_name(value),
                     json_is_string(value) ? json_string_value(value) : "");
    return VOL_OK;
}

static VolStatus read_interpolate(Parser *p, const json_t *value, VolTf *tf)
{
    static const char *const choices[] = {"opacity", "extinction", NULL};
    int choice = 0;
    VolStatus status = read_choice(p, value, choices, "opacity, extinction", &choice);
    tf->interpolate = (VolInterpolate)choice;
    return status;
}

static VolStatus read_model(Parser *p, const json_t *value, VolTf *tf)
{
    static const char *const choices[] = {"hybrid", "classic", "unshaded", NULL};
    int choice = 0;
    VolStatus status = read_choice(p, value, choices, "hybrid, classic, unshaded", &choice);
    tf->model = (VolModel)choice;
    return status;
}

static VolStatus read_particle_step(Parser *p, const json_t *value, VolTf *tf)
{
    return read_positive(p, value, &tf->particle_step);
}

static VolStatus read_scalar_step(Parser *p, const json_t *value, VolTf *tf)
{
    tf->scalar_step_given = true;
    return read_positive(p, value, &tf->scalar_step);
}

static VolStatus read_surface(Parser *p, const json_t *value, VolTf *tf)
{
    return read_nodes(p, value, &opacity_form, &tf->surface);
}

static VolStatus read_scatter(Parser *p, const json_t *value, VolTf *tf)
{
    return read_nodes(p, value, &opacity_form, &tf->scatter);
}

static VolStatus read_absorb(Parser *p, const json_t *value, VolTf *tf)
{
    return read_nodes(p, value, &absorb_form, &tf->absorb);
}

static VolStatus read_emit(Parser *p, const json_t *value, VolTf *tf)
{
    return read_nodes(p, value, &emit_form, &tf->emit);
}

static VolStatus read_transport(Parser *p, const json_t *value, VolTf *tf)
{
    return read_nodes(p, value, &transport_form, &tf->transport);
}

static VolStatus read_gradient(Parser *p, const json_t *value, VolTf *tf)
{
    double *g = tf->surfaceness_gradient;
    if (!json_is_array(value) || json_array_size(value) != 2)
        return fault(p, "'gradient' is a list of two numbers, [g0, g1]");
    for (size_t i = 0; i < 2; i++) {
        VolStatus status = read_number(p, json_array_get(value, i), "gradient", 0, INFINITY, &g[i]);
        if (status != VOL_OK)
            return status;
    }
    if (!(g[0] < g[1]))
        return fault(p, "gradient %.9g is not less than %.9g", g[0], g[1]);
    tf->surfaceness_by_gradient = true;
    return VOL_OK;
}

static VolStatus read_surfaceness(Parser *p, const json_t *value, VolTf *tf)
{
    static const KeyRow rows[] = {{"gradient", read_gradient}, {0}};
    if (json_is_array(value))
        return read_nodes(p, value, &surfaceness_form, &tf->surfaceness);
    VolStatus status = read_keys(p, value, rows, "a list of nodes or an object", tf);
    if (status == VOL_OK && !tf->surfaceness_by_gradient)
        return fault(p, "'gradient' is missing in it");
    return status;
}

static VolStatus read_hg(Parser *p, const json_t *value, VolTf *tf)
{
    VolStatus status = read_number(p, value, "hg", -1, 1, &tf->phase_hg);
    if (status == VOL_OK && fabs(tf->phase_hg) == 1)
        return fault(p, "hg %g sends all light one way, it must lie between -1 and 1", tf->phase_hg);
    tf->phase_given = true;
    return status;
}

static VolStatus read_phase_table(Parser *p, const json_t *value, VolTf *tf)
{
    VolStatus status = read_nodes(p, value, &phase_form, &tf->phase_table);
    tf->phase_given |= tf->phase_table.count > 0;
    return status;
}

static VolStatus read_phase(Parser *p, const json_t *value, VolTf *tf)
{
    static const KeyRow rows[] = {{"hg", read_hg}, {"table", read_phase_table}, {0}};
    VolStatus status = read_keys(p, value, rows, "an object", tf);
    if (status == VOL_OK && json_object_size(value) != 1)
        return fault(p, "either 'hg' or 'table' is expected in it");
    return status;
}

static VolStatus read_ambient(Parser *p, const json_t *value, VolTf *tf)
{
    return read_number(p, value, "ambient", 0, VOL_BRIGHTEST, &tf->ambient);
}

static VolStatus read_diffuse(Parser *p, const json_t *value, VolTf *tf)
{
    return read_number(p, value, "diffuse", 0, VOL_BRIGHTEST, &tf->diffuse);
}

static VolStatus read_specular(Parser *p, const json_t *value, VolTf *tf)
{
    return read_number(p, value, "specular", 0, VOL_BRIGHTEST, &tf->specular);
}

static VolStatus read_shininess(Parser *p, const json_t *value, VolTf *tf)
{
    return read_number(p, value, "shininess", 0, INFINITY, &tf->shininess);
}

static VolStatus read_shading(Parser *p, const json_t *value, VolTf *tf)
{
    static const KeyRow rows[] = {{"ambient", read_ambient},
                                  {"diffuse", read_diffuse},
                                  {"specular", read_specular},
                                  {"shininess", read_shininess},
                                  {0}};
    return read_keys(p, value, rows, "an object", tf);
}

/* Keys of one isosurface; the object being filled is the last of the list. */
static VolTfIsosurface *current_isosurface(VolTf *tf)
{
    return &tf->isosurfaces[tf->isosurface_count - 1];
}

static VolStatus read_isosurface_value(Parser *p, const json_t *value, VolTf *tf)
{
    return read_number(p, value, "value", -LARGEST_VALUE, LARGEST_VALUE, &current_isosurface(tf)->value);
}

static VolStatus read_isosurface_opacity(Parser *p, const json_t *value, VolTf *tf)
{
    return read_number(p, value, "opacity", 0, 1, &current_isosurface(tf)->opacity);
}

static VolStatus read_isosurface_color(Parser *p, const json_t *value, VolTf *tf)
{
    current_isosurface(tf)->color_given = true;
    return read_color(p, value, VOL_BRIGHTEST, current_isosurface(tf)->color);
}

static VolStatus read_isosurface(Parser *p, const json_t *value, VolTf *tf)
{
    static const KeyRow rows[] = {{"value", read_isosurface_value},
                                  {"opacity", read_isosurface_opacity},
                                  {"color", read_isosurface_color},
                                  {0}};
    VolStatus status = read_keys(p, value, rows, "an object", tf);
    if (status == VOL_OK && !json_object_get(value, "value"))
        return fault(p, "'value' is missing in it");
    if (status == VOL_OK && !json_object_get(value, "opacity"))
        return fault(p, "'opacity' is missing in it");
    return status;
}

static VolStatus read_isosurfaces(Parser *p, const json_t *value, VolTf *tf)
{
    if (!json_is_array(value))
        return fault(p, "%s where a list of isosurfaces is expected", type_name(value));
    size_t count = json_array_size(value);
    tf->isosurfaces = vol_alloc(count, sizeof *tf->isosurfaces);
    if (!tf->isosurfaces)
        return vol_fail_memory(p->err, count * sizeof *tf->isosurfaces);
    VolStatus status = VOL_OK;
    p->item = "isosurface";
    for (size_t i = 0; i < count && status == VOL_OK; i++) {
        p->node = i + 1;
        tf->isosurfaces[tf->isosurface_count++] = (VolTfIsosurface){.color = {1, 1, 1}};
        status = read_isosurface(p, json_array_get(value, i), tf);
    }
    p->node = 0;
    return status;
}

static const KeyRow file_keys[] = {{"pellucid", read_pellucid},
                                   {"interpolate", read_interpolate},
                                   {"particle_step", read_particle_step},
                                   {"scalar_step", read_scalar_step},
                                   {"surface", read_surface},
                                   {"scatter", read_scatter},
                                   {"absorb", read_absorb},
                                   {"emit", read_emit},
                                   {"isosurfaces", read_isosurfaces},
                                   {"transport", read_transport},
                                   {"surfaceness", read_surfaceness},
                                   {"phase", read_phase},
                                   {"shading", read_shading},
                                   {"model", read_model},
                                   {0}};

/* ---- The file ---- */

static VolStatus read_file(Parser *p, VolTf *tf)
{
    if (vol_json_skip_space(p->text, p->size, 0) == p->size)
        return fault(p, "the file is empty");
    json_t *root;
    size_t flags = JSON_REJECT_DUPLICATES | JSON_DECODE_INT_AS_REAL | JSON_DECODE_ANY;
    VolStatus status = vol_json_load(p->text, p->size, flags, p->name, &root, p->err);
    if (status != VOL_OK)
        return status;
    status = json_is_object(root) && !json_object_get(root, "pellucid")
                 ? fault(p, "key 'pellucid' is missing, '" FORMAT_NAME "' is expected there")
                 : read_keys(p, root, file_keys, "an object", tf);
    json_decref(root);
    return status;
}

enum { DEFAULT_STEPS = 256 }; /* in a range of values */

static void widen(double v, double *lo, double *hi)
{
    *lo = fmin(*lo, v);
    *hi = fmax(*hi, v);
}

/* Of the surface nodes' range; where they span none, of all that the file names values for; 0 where it names one at most:
 * what is said without any measure of the field's unit must not depend on it. */
static double default_scalar_step(const VolTf *tf)
{
    const VolTfNodes *const lists[] = {&tf->surface, &tf->scatter, &tf->absorb, &tf->emit, &tf->transport, &tf->surfaceness};
    double lo = INFINITY, hi = -INFINITY;
    if (!tf->surface.count)
        return 1;
    for (size_t k = 0; k < sizeof lists / sizeof *lists; k++) {
        for (size_t i = 0; i < lists[k]->count; i++)
            widen(lists[k]->nodes[i].v, &lo, &hi);
        if (k == 0 && (hi - lo) / DEFAULT_STEPS > 0)
            break;
    }
    for (size_t i = 0; i < tf->isosurface_count && !((hi - lo) / DEFAULT_STEPS > 0); i++)
        widen(tf->isosurfaces[i].value, &lo, &hi);
    return (hi - lo) / DEFAULT_STEPS;
}

void vol_tf_settle_step(VolTf *tf, double lo, double hi)
{
    double step = (hi - lo) / DEFAULT_STEPS;
    if (!(tf->scalar_step > 0))
        tf->scalar_step = step > 0 && isfinite(step) ? step : 1;
}

VolTf vol_tf_defaults(void)
{
    return (VolTf){.interpolate = VOL_INTERPOLATE_OPACITY, .particle_step = 1, .scalar_step = 1,
                   .model = VOL_MODEL_HYBRID, .ambient = 0.1, .diffuse = 0.7, .specular = 0.2, .shininess = 32};
}

VolStatus vol_tf_parse(const VolBytes *bytes, const char *name, VolTf *out, const VolLog *log, VolError *err)
{
    Parser p = {.text = (const char *)bytes->data, .size = bytes->size, .name = name, .err = err, .item = "node"};
    if (p.size >= 3 && memcmp(p.text, "\xEF\xBB\xBF", 3) == 0) {
        p.text += 3;
        p.size -= 3;
    }
    VolTf tf = vol_tf_defaults();
    VolStatus status = read_file(&p, &tf);
    if (status != VOL_OK) {
        vol_tf_free(&tf);
        *out = (VolTf){0};
        return status;
    }
    if (!tf.scalar_step_given)
        tf.scalar_step = default_scalar_step(&tf);
    if (tf.model != VOL_MODEL_CLASSIC && (tf.surfaceness.count || tf.surfaceness_by_gradient))
        vol_warn(log, "transfer function '%.200s': key 'surfaceness' has no effect, the model is not classic",
                 name);
    *out = tf;
    return VOL_OK;
}

void vol_tf_free(VolTf *tf)
{
    VolTfNodes *lists[] = {&tf->surface,   &tf->scatter,     &tf->absorb,     &tf->emit,
                           &tf->transport, &tf->surfaceness, &tf->phase_table};
    for (size_t i = 0; i < sizeof lists / sizeof *lists; i++)
        free(lists[i]->nodes);
    free(tf->isosurfaces);
    *tf = (VolTf){0};
}
