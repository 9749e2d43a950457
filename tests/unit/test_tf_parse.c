/* Transfer functions as files: what is accepted, what the defaults are, and every kind of fault with its message. */
#include "test.h"
#include "tf_help.h"

#include <stdlib.h>

static void check_fault(int line, const char *text, const char *want)
{
    VolTf tf;
    VolError err = {{0}};
    VolStatus status = tf_parse(text, &tf, &err);
    char full[1200];
    snprintf(full, sizeof full, "bad transfer function 'look.json': %s", want);
    if (status != VOL_BAD_INPUT || strcmp(err.text, full) != 0)
        test_fail(__FILE__, line, "%s: status %d, got '%s', want '%s'", text, (int)status, err.text, full);
    if (status == VOL_OK)
        vol_tf_free(&tf);
}
#define FAULT(text, want) check_fault(__LINE__, text, want)

static VolTf parsed(const char *text)
{
    VolTf tf = {0};
    VolError err = {{0}};
    if (tf_parse(text, &tf, &err) != VOL_OK)
        FAIL("%s: %s", text, err.text);
    return tf;
}

static void test_defaults(void)
{
    VolTf tf = parsed(HEAD "}");
    CHECK(tf.interpolate == VOL_INTERPOLATE_OPACITY);
    CHECK(tf.model == VOL_MODEL_HYBRID);
    CHECK(tf.particle_step == 1 && tf.scalar_step == 1 && !tf.scalar_step_given);
    CHECK(tf.ambient == 0.1 && tf.diffuse == 0.7 && tf.specular == 0.2 && tf.shininess == 32);
    CHECK(!tf.surface.count && !tf.scatter.count && !tf.absorb.count && !tf.emit.count && !tf.transport.count);
    CHECK(!tf.isosurface_count && !tf.phase_given && !tf.surfaceness.count && !tf.surfaceness_by_gradient);
    vol_tf_free(&tf);
}

static void test_everything_given(void)
{
    VolTf tf = parsed("\xEF\xBB\xBF" HEAD ", \"interpolate\": \"extinction\", "
                                     "\"particle_step\": 0.25, \"scalar_step\": 8,"
                      "\"surface\": [[-5, 0.5, [0.1, 0.2, 0.3]], [7, 1]], \"scatter\": [[1e3, 0.125]],"
                      "\"absorb\": [[0, 0], [0, 1, [1, 0, 0.5]]], \"emit\": [[2, 30, [0, 4, 5]]],"
                      "\"isosurfaces\": [{\"value\": 3, \"opacity\": 1},"
                      "{\"color\": [3, 2, 1], \"opacity\": 0, \"value\": -2}],"
                      "\"transport\": [[1, [0, 0.5, 1]]],"
                      "\"surfaceness\": [[0, 0], [1, 1]], \"phase\": {\"hg\": -0.5},"
                      "\"shading\": {\"ambient\": 0, \"diffuse\": 1, \"specular\": 2, \"shininess\": 3},"
                      "\"model\": \"classic\"}");
    CHECK(tf.interpolate == VOL_INTERPOLATE_EXTINCTION && tf.model == VOL_MODEL_CLASSIC);
    CHECK(tf.particle_step == 0.25 && tf.scalar_step == 8 && tf.scalar_step_given);
    CHECK(tf.surface.count == 2 && tf.surface.nodes[0].v == -5 && tf.surface.nodes[0].amount == 0.5);
    CHECK(tf.surface.nodes[0].color[1] == 0.2 && tf.surface.nodes[1].color[2] == 1);
    CHECK(tf.scatter.count == 1 && tf.scatter.nodes[0].v == 1000 && tf.scatter.nodes[0].color[0] == 1);
    CHECK(tf.absorb.count == 2 && tf.absorb.nodes[1].color[2] == 0.5);
    CHECK(tf.emit.count == 1 && tf.emit.nodes[0].amount == 30 && tf.emit.nodes[0].color[2] == 5);
    CHECK(tf.isosurface_count == 2 && !tf.isosurfaces[0].color_given && tf.isosurfaces[1].color_given);
    CHECK(tf.isosurfaces[1].value == -2 && tf.isosurfaces[1].color[0] == 3 && tf.isosurfaces[0].opacity == 1);
    CHECK(tf.transport.count == 1 && tf.transport.nodes[0].color[1] == 0.5);
    CHECK(tf.surfaceness.count == 2 && tf.surfaceness.nodes[1].amount == 1);
    CHECK(tf.phase_given && tf.phase_hg == -0.5 && !tf.phase_table.count);
    CHECK(tf.ambient == 0 && tf.diffuse == 1 && tf.specular == 2 && tf.shininess == 3);
    CHECK_TEXT(tf_said, "");
    vol_tf_free(&tf);
}

static void test_other_forms(void)
{
    VolTf tf = parsed(HEAD ", \"surface\": [], \"isosurfaces\": [], "
                      "\"phase\": {\"table\": [[-1, [0, 0, 0]], [1, [1, 2, 3]]]},"
                           "\"surfaceness\": {\"gradient\": [0.5, 2]}, \"model\": \"unshaded\"}");
    CHECK(!tf.surface.count && !tf.isosurface_count);
    CHECK(tf.phase_given && tf.phase_table.count == 2 && tf.phase_table.nodes[1].color[2] == 3);
    CHECK(tf.surfaceness_by_gradient && tf.surfaceness_gradient[1] == 2);
    CHECK(tf.model == VOL_MODEL_UNSHADED);
    CHECK_TEXT(tf_said, "warning: transfer function 'look.json': "
                        "key 'surfaceness' has no effect, the model is not classic\n");
    vol_tf_free(&tf);
}

static void test_scalar_step_default(void)
{
    VolTf tf = parsed(HEAD ", \"surface\": [[0, 0.1], [1, 0.1], [2, 0.1]], \"scatter\": [[-6, 0], [10, 0]]}");
    CHECK(tf.scalar_step == 2.0 / 256 && !tf.scalar_step_given);
    vol_tf_free(&tf);
    tf = parsed(HEAD ", \"surface\": [[3, 0.1], [3, 0.2]]}");
    CHECK(tf.scalar_step == 0);
    vol_tf_settle_step(&tf, -4, 12);
    CHECK(tf.scalar_step == 1.0 / 16);
    vol_tf_free(&tf);
    tf = parsed(HEAD ", \"surface\": [[3, 0.1]]}");
    vol_tf_settle_step(&tf, 7, 7);
    CHECK(tf.scalar_step == 1);
    vol_tf_free(&tf);
    tf = parsed(HEAD ", \"surface\": [[3, 0.1]], \"emit\": [[5, 1]], \"isosurfaces\": [{\"value\": 9, \"opacity\": 1}]}");
    CHECK(tf.scalar_step == 2.0 / 256);
    vol_tf_free(&tf);
    tf = parsed(HEAD ", \"surface\": [[3, 0.1]], \"isosurfaces\": [{\"value\": -1, \"opacity\": 1}]}");
    CHECK(tf.scalar_step == 4.0 / 256);
    vol_tf_free(&tf);
    tf = parsed(HEAD "}");
    CHECK(tf.scalar_step == 1);
    vol_tf_free(&tf);
    tf = parsed(HEAD ", \"surface\": [[0, 0.1], [1e-320, 0.2]]}");
    CHECK(tf.scalar_step > 0);
    vol_tf_free(&tf);
}

static void test_faults_of_the_file(void)
{
    FAULT("", "the file is empty");
    FAULT(" \n\t", "the file is empty");
    FAULT("[1]", "a list where an object is expected");
    FAULT("7", "a number where an object is expected");
    FAULT("{}", "key 'pellucid' is missing, 'transfer-function/1' is expected there");
    FAULT("{\"scatter\": []}", "key 'pellucid' is missing, 'transfer-function/1' is expected there");
    FAULT("{\n\"pellucid\": \"transfer-function/2\"}",
          "line 2: key 'pellucid': transfer-function/2 where 'transfer-function/1' is expected");
    FAULT("{\"pellucid\": 1}", "line 1: key 'pellucid': a number where 'transfer-function/1' is expected");
    FAULT("{\"pellucid\": null}", "line 1: key 'pellucid': null where 'transfer-function/1' is expected");
    FAULT(HEAD ",\n\n\"scater\": []}", "line 3: key 'scater': no such key");
    FAULT(HEAD ", \"a\\u0062c\": []}", "key 'abc': no such key");
    FAULT(HEAD ", \"isosurfaces\": [{\"value\": 1, \"opacity\": 1}],\n\"value\": 1}", "line 2: key 'value': no such key");
    FAULT(HEAD ",\n\"colour\": true}", "line 2: key 'colour': no such key");
}

static void check_syntax(int line, const char *text, size_t size, const char *beginning)
{
    VolTf tf;
    VolError err = {{0}};
    VolStatus status = tf_parse_bytes(text, size, &tf, &err);
    char full[200];
    snprintf(full, sizeof full, "bad transfer function 'look.json': %s", beginning);
    if (status != VOL_BAD_INPUT || strncmp(err.text, full, strlen(full)) != 0)
        test_fail(__FILE__, line, "status %d, got '%s', want '%s...'", (int)status, err.text, full);
}
#define SYNTAX(text, beginning) check_syntax(__LINE__, text, sizeof text - 1, beginning)

/* The words after the line number are jansson's. */
static void test_faults_of_syntax(void)
{
    SYNTAX(HEAD, "line 1: ");
    SYNTAX(HEAD ",\n\n}", "line 3: ");
    SYNTAX(HEAD ",\n\"scatter\": [[0, 0.5]\n\"emit\": []}", "line 3: ");
    SYNTAX(HEAD ",\n\"scatter\": [[0, NaN]]}", "line 2: ");
    SYNTAX(HEAD ",\n\"scatter\": [[0, 1e999]]}", "line 2: real number overflow");
    SYNTAX(HEAD ",\n\"scatter\": [[-1e999, 1]]}", "line 2: real number overflow");
    SYNTAX(HEAD ",\n\"emit\": [],\n\"emit\": []}", "line 3: duplicate object key");
    SYNTAX(HEAD "}\n}", "line 2: ");
    SYNTAX(HEAD ", \"\xff\": 1}", "line 1: ");
    SYNTAX("\0\0\0\0", "line 1: ");
    SYNTAX(HEAD "\0}", "line 1: ");
}

static void test_faults_of_settings(void)
{
    FAULT(HEAD ", \"interpolate\": \"linear\"}",
          "line 1: key 'interpolate': 'linear' is none of opacity, extinction");
    FAULT(HEAD ", \"model\": \"hybird\"}", "line 1: key 'model': 'hybird' is none of hybrid, classic, unshaded");
    FAULT(HEAD ", \"model\": 3}", "line 1: key 'model': a number where one of hybrid, classic, unshaded is expected");
    FAULT(HEAD ", \"particle_step\": 0}", "line 1: key 'particle_step': 0 is not greater than 0");
    FAULT(HEAD ", \"particle_step\": \"1\"}", "line 1: key 'particle_step': value is a string, not a number");
    FAULT(HEAD ", \"scalar_step\": -2}", "line 1: key 'scalar_step': -2 is not greater than 0");
    FAULT(HEAD ", \"shading\": [1]}", "line 1: key 'shading': a list where an object is expected");
    FAULT(HEAD ", \"shading\": {\"ambiance\": 1}}", "line 1: key 'shading': no such key 'ambiance' in it");
    FAULT(HEAD ", \"shading\": {\"specular\": -0.5}}", "line 1: key 'shading': specular -0.5 is less than 0");
    FAULT(HEAD ", \"shading\": {\"diffuse\": null}}", "line 1: key 'shading': diffuse is null, not a number");
    FAULT(HEAD ", \"phase\": {}}", "line 1: key 'phase': either 'hg' or 'table' is expected in it");
    FAULT(HEAD ", \"phase\": {\"hg\": 0, \"table\": []}}",
          "line 1: key 'phase': either 'hg' or 'table' is expected in it");
    FAULT(HEAD ", \"phase\": {\"hg\": 1}}",
          "line 1: key 'phase': hg 1 sends all light one way, it must lie between -1 and 1");
    FAULT(HEAD ", \"phase\": {\"hg\": 1.5}}", "line 1: key 'phase': hg 1.5 lies outside [-1, 1]");
    FAULT(HEAD ", \"phase\": {\"g\": 0}}", "line 1: key 'phase': no such key 'g' in it");
    FAULT(HEAD ", \"phase\": {\"table\": [\n[-1, [1, 1, 1]],\n[2, [1, 1, 1]]]}}",
          "line 3: key 'phase', node 2: cosine 2 lies outside [-1, 1]");
    FAULT(HEAD ", \"surfaceness\": 1}",
          "line 1: key 'surfaceness': a number where a list of nodes or an object is expected");
    FAULT(HEAD ", \"surfaceness\": {}}", "line 1: key 'surfaceness': 'gradient' is missing in it");
    FAULT(HEAD ", \"surfaceness\": {\"gradient\": [1]}}",
          "line 1: key 'surfaceness': 'gradient' is a list of two numbers, [g0, g1]");
    FAULT(HEAD ", \"surfaceness\": {\"gradient\": [2, 1]}}",
          "line 1: key 'surfaceness': gradient 2 is not less than 1");
    FAULT(HEAD ", \"surfaceness\": {\"gradient\": [-1, 1]}}",
          "line 1: key 'surfaceness': gradient -1 is less than 0");
    FAULT(HEAD ", \"surfaceness\": [[0, 2]]}",
          "line 1: key 'surfaceness', node 1: surfaceness 2 lies outside [0, 1]");
}

static void test_faults_of_nodes(void)
{
    FAULT(HEAD ", \"scatter\": {}}", "line 1: key 'scatter': an object where a list of nodes is expected");
    FAULT(HEAD ",\n\"scatter\": [\n  [0, 0],\n  [1, [\n1, 1, 1], [2,\n3]],\n  [3, 1.2]]}",
          "line 4: key 'scatter', node 2: opacity is a list, not a number");
    FAULT(HEAD ",\n\"scatter\": [\n  [0, 0, [\n1, 1, 1]],\n\n  [3, 1.2]]}",
          "line 6: key 'scatter', node 2: opacity 1.2 lies outside [0, 1]");
    FAULT(HEAD ", \"model\": \"scatter\",\n \"scatter\": [[0, -0.1]]}", "line 1: key 'model': "
          "'scatter' is none of hybrid, classic, unshaded");
    FAULT(HEAD ", \"surface\": [[0, -0.1]]}", "line 1: key 'surface', node 1: opacity -0.1 lies outside [0, 1]");
    FAULT(HEAD ", \"absorb\": [[0, 1.5]]}", "line 1: key 'absorb', node 1: density 1.5 lies outside [0, 1]");
    FAULT(HEAD ", \"absorb\": [[0, 1, [0, 1.5, 0]]]}",
          "line 1: key 'absorb', node 1: green 1.5 lies outside [0, 1]");
    FAULT(HEAD ", \"emit\": [[0, -1]]}", "line 1: key 'emit', node 1: strength -1 is less than 0");
    FAULT(HEAD ", \"emit\": [[0, 1, [0, 0, -1]]]}", "line 1: key 'emit', node 1: blue -1 is less than 0");
    FAULT(HEAD ", \"transport\": [[0, [2, 0, 0]]]}", "line 1: key 'transport', node 1: red 2 lies outside [0, 1]");
    FAULT(HEAD ", \"transport\": [[0, 1]]}",
          "line 1: key 'transport', node 1: a colour is a list of three numbers, [r, g, b]");
    FAULT(HEAD ", \"transport\": [[0]]}", "line 1: key 'transport', node 1: a node is [value, [r, g, b]]");
    FAULT(HEAD ", \"scatter\": [[0, 1, [1, 1]]]}",
          "line 1: key 'scatter', node 1: a colour is a list of three numbers, [r, g, b]");
    FAULT(HEAD ", \"scatter\": [[0, 1, \"red\"]]}",
          "line 1: key 'scatter', node 1: a colour is a list of three numbers, [r, g, b]");
    FAULT(HEAD ", \"scatter\": [[0, 1, [1, true, 1]]]}",
          "line 1: key 'scatter', node 1: green is true or false, not a number");
    FAULT(HEAD ", \"scatter\": [[0, 1, [1, 1, 1], 4]]}",
          "line 1: key 'scatter', node 1: a node is [value, opacity] or [value, opacity, [r, g, b]]");
    FAULT(HEAD ", \"scatter\": [[0]]}",
          "line 1: key 'scatter', node 1: a node is [value, opacity] or [value, opacity, [r, g, b]]");
    FAULT(HEAD ", \"scatter\": [0, 1]}",
          "line 1: key 'scatter', node 1: a node is [value, opacity] or [value, opacity, [r, g, b]]");
    FAULT(HEAD ", \"scatter\": [[\"0\", 1]]}", "line 1: key 'scatter', node 1: value is a string, not a number");
    FAULT(HEAD ", \"scatter\": [[1e301, 1]]}",
          "line 1: key 'scatter', node 1: value 1e+301 lies outside [-1e+300, 1e+300]");
    FAULT(HEAD ", \"scatter\": [[0, 1], [2, 1], [1, 1]]}",
          "line 1: key 'scatter', node 3: value 1 comes after 2, nodes must ascend");
    FAULT(HEAD ", \"scatter\": [[0, 1], [2, 1], [2, 1], [2, 0]]}",
          "line 1: key 'scatter', node 4: a third node at value 2, two make a jump");
}

static void test_faults_of_isosurfaces(void)
{
    FAULT(HEAD ", \"isosurfaces\": {}}",
          "line 1: key 'isosurfaces': an object where a list of isosurfaces is expected");
    FAULT(HEAD ", \"isosurfaces\": [1]}",
          "line 1: key 'isosurfaces', isosurface 1: a number where an object is expected");
    FAULT(HEAD ", \"isosurfaces\": [{\"value\": 1}]}",
          "line 1: key 'isosurfaces', isosurface 1: 'opacity' is missing in it");
    FAULT(HEAD ", \"isosurfaces\": [{\"opacity\": 1}]}",
          "line 1: key 'isosurfaces', isosurface 1: 'value' is missing in it");
    FAULT(HEAD ", \"isosurfaces\": [{\"value\": 1, \"opacity\": 1},\n{\"value\": 1, \"opacity\": 2}]}",
          "line 2: key 'isosurfaces', isosurface 2: opacity 2 lies outside [0, 1]");
    FAULT(HEAD ", \"isosurfaces\": [{\"value\": 1, \"opacity\": 1, \"colour\": [1, 1, 1]}]}",
          "line 1: key 'isosurfaces', isosurface 1: no such key 'colour' in it");
    FAULT(HEAD ", \"isosurfaces\": [{\"value\": 1, \"opacity\": 1, \"color\": [1, 1, -1]}]}",
          "line 1: key 'isosurfaces', isosurface 1: blue -1 is less than 0");
}

/* Cut at every byte and with every byte changed: an answer, never a crash. */
static void test_damage(void)
{
    static const char text[] = HEAD ", \"scatter\": [[0, 0], [1, 0.5, [1, 0.5, 0]], [1, 0.25]], "
                               "\"phase\": {\"hg\": 0.5},"
                                    "\"isosurfaces\": [{\"value\": 1, \"opacity\": 0.5}], \"model\": \"classic\"}";
    VolTf tf;
    VolError err;
    CHECK(tf_parse(text, &tf, &err) == VOL_OK);
    vol_tf_free(&tf);
    for (size_t size = 0; size < sizeof text - 1; size++)
        CHECK(tf_parse_bytes(text, size, &tf, &err) == VOL_BAD_INPUT);
    static const char strange[] = "\"[]{}:,\\\0-19e.x\xff\n";
    for (size_t i = 0; i < sizeof text - 1; i++)
        for (size_t k = 0; k < sizeof strange - 1; k++) {
            char damaged[sizeof text];
            memcpy(damaged, text, sizeof text);
            damaged[i] = strange[k];
            VolStatus status = tf_parse_bytes(damaged, sizeof text - 1, &tf, &err);
            CHECK(status == VOL_OK || status == VOL_BAD_INPUT);
            if (status == VOL_OK)
                vol_tf_free(&tf);
        }
}

int main(void)
{
    RUN(test_defaults);
    RUN(test_everything_given);
    RUN(test_other_forms);
    RUN(test_scalar_step_default);
    RUN(test_faults_of_the_file);
    RUN(test_faults_of_syntax);
    RUN(test_faults_of_settings);
    RUN(test_faults_of_nodes);
    RUN(test_faults_of_isosurfaces);
    RUN(test_damage);
    return test_end();
}
