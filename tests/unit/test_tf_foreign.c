/* Other programs' transfer functions: what is read from each format, how colours and opacities between points compare with
 * the program's own, and what is said of damaged files.  The blended colours and bent opacities that are compared with are
 * those of VTK 9.1, in sRGB. */
#include "test.h"
#include "tf_help.h"

#include "tf/foreign.h"

#include <stdint.h>
#include <stdlib.h>

/* A copy of exactly the size, so that reading beyond it is noticed. */
static VolStatus read_bytes(const void *data, size_t size, const char *part, VolTf *tf, VolTfUnits *units, VolError *err)
{
    VolBytes bytes = {malloc(size ? size : 1), size};
    memcpy(bytes.data, data, size);
    tf_said[0] = 0;
    VolStatus status = vol_tf_read(&bytes, "x", part, tf, units, &tf_log, err);
    free(bytes.data);
    return status;
}

static VolTf good_part(int line, const char *text, const char *part, bool want_relative)
{
    VolTf tf = {0};
    VolError err = {{0}};
    VolTfUnits units = {0};
    if (read_bytes(text, strlen(text), part, &tf, &units, &err) != VOL_OK)
        test_fail(__FILE__, line, "%s", err.text);
    else if (units.relative != want_relative)
        test_fail(__FILE__, line, "relative is %d", units.relative);
    return tf;
}
#define RELATIVE(text) good_part(__LINE__, text, NULL, true)
#define ABSOLUTE(text) good_part(__LINE__, text, NULL, false)
#define PART(text, part) good_part(__LINE__, text, part, false)

static void check_fault(int line, const char *text, const char *part, const char *want)
{
    VolTf tf;
    VolError err = {{0}};
    VolTfUnits units;
    VolStatus status = read_bytes(text, strlen(text), part, &tf, &units, &err);
    char full[1200];
    snprintf(full, sizeof full, "bad transfer function 'x': %s", want);
    if (status != VOL_BAD_INPUT || strcmp(err.text, full) != 0)
        test_fail(__FILE__, line, "status %d, got '%s', want '%s'", (int)status, err.text, full);
    if (status == VOL_OK)
        vol_tf_free(&tf);
}
#define FAULT(text, want) check_fault(__LINE__, text, NULL, want)
#define FAULT_PART(text, part, want) check_fault(__LINE__, text, part, want)

static double decode(double e)
{
    return e <= 0.04045 ? e / 12.92 : pow((e + 0.055) / 1.055, 2.4);
}

/* Opacity (-1) or a colour at v, just above it where there are two. */
static double at(const VolTf *tf, double v, int channel)
{
    const VolTfNodes *s = &tf->scatter;
    size_t next = 0;
    if (!s->count)
        return NAN; /* reading failed */
    while (next < s->count && s->nodes[next].v <= v)
        next++;
    const VolTfNode *p = &s->nodes[next ? next - 1 : 0], *q = &s->nodes[next < s->count ? next : s->count - 1];
    double u = q->v > p->v ? (v - p->v) / (q->v - p->v) : 0;
    double y0 = channel < 0 ? p->amount : p->color[channel], y1 = channel < 0 ? q->amount : q->color[channel];
    return y0 + (y1 - y0) * u;
}

static void check_color(int line, const VolTf *tf, double v, double r, double g, double b)
{
    double want[3] = {r, g, b};
    for (int c = 0; c < 3; c++)
        if (!(fabs(at(tf, v, c) - decode(want[c])) < 1e-3))
            test_fail(__FILE__, line, "channel %d at %g: %g instead of %g", c, v, at(tf, v, c), decode(want[c]));
}
#define COLOR(tf, v, r, g, b) check_color(__LINE__, tf, v, r, g, b)

/* ---- Names and ranges ---- */

static void check_split(const char *name, bool exists, const char *want_file, const char *want_part)
{
    char *file;
    const char *part;
    VolError err;
    CHECK(vol_tf_split_name(name, exists, &file, &part, &err) == VOL_OK);
    CHECK_TEXT(file, want_file);
    CHECK_TEXT(part ? part : "(none)", want_part);
    free(file);
}

static void test_names(void)
{
    check_split("a.xml", false, "a.xml", "(none)");
    check_split("a.xml#CT-Bone", false, "a.xml", "CT-Bone");
    check_split("d#1/a.xml#Blue # Red", false, "d#1/a.xml", "Blue # Red");
    check_split("d#1/a.xml", false, "d#1/a.xml", "(none)");
    check_split("a.xml#b", true, "a.xml#b", "(none)");
    check_split("#a", false, "#a", "(none)");
    check_split("a.xml#", false, "a.xml", "");
    check_split("-", false, "-", "(none)");
}

static void test_rescale(void)
{
    VolTf tf = PART(HEAD ", \"scatter\": [[0, 0], [0.25, 0.5], [1, 1]], \"surface\": [[0, 0], [1, 1]],"
                         "\"isosurfaces\": [{\"value\": 0.5, \"opacity\": 1}], \"absorb\": [[1, 1]]}", NULL);
    vol_tf_rescale(&tf, -1000, 3000);
    CHECK(tf.scatter.nodes[0].v == -1000 && tf.scatter.nodes[1].v == 0 && tf.scatter.nodes[2].v == 3000);
    CHECK(tf.isosurfaces[0].value == 1000 && tf.absorb.nodes[0].v == 3000);
    CHECK_NEAR(tf.scalar_step, 4000.0 / 256, 1e-15, 0);
    vol_tf_free(&tf);

    tf = PART(HEAD ", \"scatter\": [[0, 0], [1, 1]], \"scalar_step\": 3, \"surface\": [[0, 1]]}", NULL);
    vol_tf_rescale(&tf, 7, 7); /* one value: that of 0 */
    CHECK(tf.scatter.nodes[0].v == 7 && tf.scatter.nodes[1].v > 7 && tf.scalar_step == 3);
    tf.scatter.nodes[0].v = 0.5;
    tf.scatter.nodes[1].v = 1;
    vol_tf_rescale(&tf, -1e308, 1e308);
    CHECK(tf.scatter.nodes[0].v == 0 && tf.scatter.nodes[1].v == 1e308);
    vol_tf_free(&tf);
}

static void test_own(void)
{
    VolTf tf = PART("\xEF\xBB\xBF \n" HEAD ", \"scatter\": [[1, 0.5, [0.25, 1, 1]]]}", NULL);
    CHECK(tf.scatter.count == 1 && tf.scatter.nodes[0].color[0] == 0.25); /* linear: not decoded */
    vol_tf_free(&tf);
    FAULT_PART(HEAD "}", "a", "there is one transfer function in it, none named 'a'");
    FAULT("{}", "key 'pellucid' is missing, 'transfer-function/1' is expected there");
    FAULT(HEAD ",\n\"scater\": []}", "line 2: key 'scater': no such key");
    FAULT("", "the file is empty");
    FAULT("{\n\n\"a\": NaN}", "line 3: invalid token near 'NaN'");
}

/* ---- ParaView ---- */

#define BLACK_TO_WHITE "\"RGBPoints\": [0, 0, 0, 0, 1, 1, 1, 1]"

static void test_paraview_encoded(void)
{
    VolTf tf = RELATIVE("[{\"Name\": \"grey\", " BLACK_TO_WHITE "},]");
    for (int i = 0; i <= 1000; i++) {
        double v = i / 1000.0;
        COLOR(&tf, v, v, v, v);
        CHECK_NEAR(at(&tf, v, -1), v, 0, 1e-12);
    }
    CHECK(tf.scatter.count < 60);
    CHECK(tf.model == VOL_MODEL_HYBRID && tf.particle_step == 1 && tf.interpolate == VOL_INTERPOLATE_OPACITY);
    CHECK(strstr(tf_said, "note: transfer function 'x': colour map 'grey': it has no opacities; they run from 0") != NULL);
    CHECK(strstr(tf_said, "its points, from 0 to 1, are stretched to the data's range") != NULL);
    CHECK(!strstr(tf_said, "warning"));
    vol_tf_free(&tf);
}

static void test_paraview_ranges(void)
{
    VolTf tf = RELATIVE("{\"RGBPoints\": [-1, 0, 0, 0, -0.5, 1, 1, 1, 1, 1, 0, 0]}");
    CHECK(tf.scatter.nodes[0].v == 0 && tf.scatter.nodes[tf.scatter.count - 1].v == 1);
    COLOR(&tf, 0.25, 1, 1, 1);
    vol_tf_free(&tf);
    tf = ABSOLUTE("{\"RGBPoints\": [0, 0, 0, 0, 255, 1, 1, 1], \"Points\": [0, 0.5, 0.5, 0, 100, 1, 0.5, 0]}");
    CHECK(at(&tf, 0, -1) == 0.5 && at(&tf, 100, -1) == 1 && at(&tf, 300, -1) == 1);
    CHECK_NEAR(at(&tf, 50, -1), 0.75, 1e-12, 0);
    COLOR(&tf, 127.5, 0.5, 0.5, 0.5);
    CHECK_TEXT(tf_said, "");
    vol_tf_free(&tf);
    tf = RELATIVE("{\"RGBPoints\": [0, 1, 0, 0], \"Points\": [0, 0.5, 0.5, 0]}");
    CHECK(tf.scatter.count == 1 && tf.scatter.nodes[0].amount == 0.5 && tf.scatter.nodes[0].color[0] == 1);
    vol_tf_free(&tf);
}

#define COOL_TO_WARM "\"RGBPoints\": [0, 0.23137254902, 0.298039215686, 0.752941176471, " \
                     "1, 0.705882352941, 0.0156862745098, 0.149019607843]"

#define RED_TO_BLUE "\"RGBPoints\": [0, 1, 0.1, 0, 1, 0.3, 0.2, 1]"

static void test_paraview_spaces(void)
{
    VolTf tf = RELATIVE("{\"ColorSpace\": \"Diverging\", " COOL_TO_WARM "}");
    COLOR(&tf, 0, 0.231372549, 0.298039216, 0.752941176);
    COLOR(&tf, 0.25, 0.553317944, 0.688634605, 0.995187929);
    COLOR(&tf, 0.5, 0.865395197, 0.86541021, 0.865395561);
    COLOR(&tf, 0.75, 0.958417631, 0.603116403, 0.481685312);
    vol_tf_free(&tf);
    tf = RELATIVE("{\"ColorSpace\": \"Lab\", " COOL_TO_WARM "}");
    COLOR(&tf, 0.25, 0.466813402, 0.253075359, 0.595160126);
    COLOR(&tf, 0.75, 0.653883795, 0.138599242, 0.296019817);
    vol_tf_free(&tf);
    tf = RELATIVE("{\"ColorSpace\": \"HSV\", " RED_TO_BLUE "}");
    COLOR(&tf, 0.25, 0.8990625, 1, 0.05);
    COLOR(&tf, 0.75, 0.15, 0.8990625, 1);
    vol_tf_free(&tf);
    tf = RELATIVE("{\"ColorSpace\": \"HSV\", \"HSVWrap\": 1, " RED_TO_BLUE "}");
    COLOR(&tf, 0.25, 1, 0.05, 0.4240625);
    COLOR(&tf, 0.75, 0.6759375, 0.15, 1);
    vol_tf_free(&tf);
}

static void test_paraview_steps(void)
{
    VolTf tf = RELATIVE("{\"ColorSpace\": \"Step\", \"RGBPoints\": [0, 1, 0, 0, 0.5, 0, 1, 0, 1, 0, 0, 1]}");
    COLOR(&tf, -1, 1, 0, 0);
    COLOR(&tf, 0.001, 0, 1, 0);
    COLOR(&tf, 0.499, 0, 1, 0);
    COLOR(&tf, 0.501, 0, 0, 1);
    COLOR(&tf, 2, 0, 0, 1);
    vol_tf_free(&tf);
    tf = ABSOLUTE("{\"RGBPoints\": [0, 1, 0, 0, 5, 0, 1, 0, 5, 1, 1, 0, 5, 0, 0, 1, 9, 0, 0, 1]}");
    size_t there = 0;
    for (size_t i = 0; i < tf.scatter.count; i++)
        there += tf.scatter.nodes[i].v == 5;
    CHECK(there == 2);
    COLOR(&tf, 4.9999, 0, 1, 0); /* three points at 5: the first and the last count */
    COLOR(&tf, 5, 0, 0, 1);
    vol_tf_free(&tf);
}

/* Midpoint 0.3 and sharpness 0.4; midpoint alone; a sharpness of 1 is a step at the midpoint. */
static void test_paraview_bent_opacity(void)
{
    VolTf tf = ABSOLUTE("{\"RGBPoints\": [0, 0, 0, 0, 100, 0, 0, 0], \"Points\": [0, 0, 0.3, 0.4, 100, 1, 0.5, 0]}");
    CHECK_NEAR(at(&tf, 25, -1), 0.162524399, 0, 1e-3);
    CHECK_NEAR(at(&tf, 50, -1), 0.934490992, 0, 1e-3);
    CHECK_NEAR(at(&tf, 75, -1), 0.998246756, 0, 1e-3);
    vol_tf_free(&tf);
    tf = ABSOLUTE("{\"RGBPoints\": [0, 0, 0, 0, 100, 0, 0, 0], \"Points\": [0, 0, 0.2, 0, 100, 1, 0.5, 0]}");
    CHECK_NEAR(at(&tf, 10, -1), 0.25, 1e-9, 0);
    CHECK_NEAR(at(&tf, 20, -1), 0.5, 1e-9, 0);
    CHECK_NEAR(at(&tf, 60, -1), 0.75, 1e-9, 0);
    vol_tf_free(&tf);
    tf = ABSOLUTE("{\"RGBPoints\": [0, 0, 0, 0, 100, 0, 0, 0], \"Points\": [0, 0.25, 0.2, 1, 100, 1, 0.5, 0]}");
    CHECK(at(&tf, 19.99, -1) == 0.25 && at(&tf, 20.01, -1) == 1);
    vol_tf_free(&tf);
}

static void test_paraview_choice(void)
{
    static const char two[] = "[{\"Name\": \"Warm\", \"RGBPoints\": [0, 1, 0, 0, 9, 1, 1, 0]},\n"
                              "{\"Name\": \"Set\", \"IndexedColors\": [1, 0, 0]},"
                              "{\"Name\": \"Cool\", \"RGBPoints\": [0, 0, 0, 1, 9, 0, 1, 1]}]";
    VolTf tf = PART(two, "Cool");
    COLOR(&tf, 0, 0, 0, 1);
    vol_tf_free(&tf);
    FAULT(two, "name one of its colour maps by FILE#NAME: 'Warm', 'Cool'");
    FAULT_PART(two, "zz", "no colour map is named 'zz'; there is 'Warm', 'Cool'");
    FAULT_PART(two, "cool", "no colour map is named 'cool'; there is 'Cool' and 1 more");
    FAULT_PART(two, "Set", "colour map 'Set' has colours for categories only (IndexedColors), no RGBPoints");
    FAULT("[]", "there is no colour map in it");
    FAULT("[3]", "element 1 of its list is no object, so no colour map");
    tf = PART("[{\"Name\": \"A\", \"RGBPoints\": [0, 1, 0, 0, 9, 1, 0, 0]}, {\"Name\": \"A\", \"RGBPoints\": [0, 0, 1, 0]}]",
              "A");
    COLOR(&tf, 0, 1, 0, 0);
    CHECK(strstr(tf_said, "warning: transfer function 'x': there are several colour maps named 'A'; the first is used"));
    vol_tf_free(&tf);
}

static void test_paraview_faults(void)
{
    FAULT("{\"Name\": \"A\", \"RGBPoints\": [0, 0, 0]}",
          "colour map 'A': 'RGBPoints' has 3 numbers, which are not groups of 4");
    FAULT("{\"Name\": \"A\", \"RGBPoints\": []}", "colour map 'A': 'RGBPoints' has 0 numbers, which are not groups of 4");
    FAULT("{\"Name\": \"A\", \"RGBPoints\": 3}", "colour map 'A': 'RGBPoints' is not a list of numbers");
    FAULT("{\"Name\": \"A\", \"RGBPoints\": [0, 0, \"nan\", 0]}", "colour map 'A': number 3 of 'RGBPoints' is not a number");
    FAULT("{\"Name\": \"A\", \"RGBPoints\": [0, 0, 1.5, 0]}", "colour map 'A': point 1: green 1.5 lies outside [0, 1]");
    FAULT("{\"Name\": \"A\", \"RGBPoints\": [1e301, 0, 0, 0]}",
          "colour map 'A': point 1: value 1e+301 is not within 1e300 of 0");
    FAULT("{\"Name\": \"A\", " BLACK_TO_WHITE ", \"Points\": [0, -0.1, 0.5, 0]}",
          "colour map 'A': point 1: opacity -0.1 lies outside [0, 1]");
    FAULT("{\"Name\": \"A\", " BLACK_TO_WHITE ", \"Points\": [0, 1, 0.5, 2]}",
          "colour map 'A': point 1: sharpness 2 lies outside [0, 1]");
    FAULT("{\"Name\": \"A\", \"ColorSpace\": \"XYZ\", " BLACK_TO_WHITE "}",
          "colour map 'A': ColorSpace 'XYZ' is none of RGB, HSV, Lab, CIELAB, Diverging, Step");
    FAULT("{\"Name\": \"A\", \"ScalarOpacityUnitDistance\": 0, " BLACK_TO_WHITE "}",
          "colour map 'A': ScalarOpacityUnitDistance is not a number greater than 0");
    FAULT("[\n{\"RGBPoints\": [0, 0, 0, 0,\n", "line 3: ']' expected near end of file");
    VolTf tf = ABSOLUTE("{\"UseLogScale\": 1, \"ScalarOpacityUnitDistance\": 0.25, "
                        "\"RGBPoints\": [9, 1, 1, 1, 0, 0, 0, 0]}");
    CHECK(tf.particle_step == 0.25 && tf.scatter.nodes[0].v == 0 && tf.scatter.nodes[0].amount == 0);
    CHECK(strstr(tf_said, "UseLogScale is ignored") && strstr(tf_said, "the points of the colours are not in order"));
    vol_tf_free(&tf);
}

static void test_thousands_of_points(void)
{
    enum { N = 20000 };
    char *text = malloc(N * 64 + 100), *end = text + sprintf(text, "{\"RGBPoints\": [");
    for (int i = 0; i < N; i++)
        end += sprintf(end, "%s%d, %g, 0.5, %g", i ? ", " : "", i, i % 2 ? 1.0 : 0.0, (double)i / N);
    strcpy(end, "]}");
    VolTf tf = ABSOLUTE(text);
    CHECK(tf.scatter.count > N);
    for (size_t i = 1; i < tf.scatter.count; i++)
        CHECK(tf.scatter.nodes[i - 1].v < tf.scatter.nodes[i].v);
    COLOR(&tf, 10000.25, 0.25, 0.5, 0.5);
    vol_tf_free(&tf);
    free(text);
}

/* ---- 3D Slicer ---- */

#define PRESET(name, rest) "<VolumeProperty name=\"" name "\" " rest "/>\n"
#define OPACITY " scalarOpacity=\"6 -1000 0 0 0.5 1000 1\""
#define COLORS " colorTransfer=\"8 -1000 0 0 0 1000 1 0.5 0\""

static void test_slicer(void)
{
    static const char text[] = "<?xml version=\"1.0\"?>\n<MRML>" PRESET(
        "A", OPACITY COLORS " gradientOpacity=\"4 0 1 255 1\" shade=\"1\" ambient=\"0.3\" diffuse=\"0.6\" specular=\"0.5\" "
                            "specularPower=\"40\" interpolation=\"1\"") PRESET("B", OPACITY COLORS) "</MRML>";
    VolTf tf = PART(text, "A");
    CHECK_NEAR(at(&tf, -500, -1), 0.25, 1e-12, 0);
    CHECK(at(&tf, 0, -1) == 0.5 && at(&tf, 5000, -1) == 1);
    COLOR(&tf, 0, 0.5, 0.25, 0);
    COLOR(&tf, 500, 0.75, 0.375, 0);
    CHECK(tf.model == VOL_MODEL_CLASSIC && tf.particle_step == 1);
    CHECK(tf.ambient == 0.3 && tf.diffuse == 0.6 && tf.specular == 0.5 && tf.shininess == 40);
    CHECK_TEXT(tf_said, "");
    vol_tf_free(&tf);
    tf = PART(text, "B");
    CHECK(tf.model == VOL_MODEL_UNSHADED && tf.ambient == 0.1 && tf.shininess == 10);
    vol_tf_free(&tf);
    FAULT_PART(text, "C", "no preset is named 'C'; there is 'A', 'B'");
    FAULT(text, "name one of its presets by FILE#NAME: 'A', 'B'");
}

static void test_slicer_lost(void)
{
    VolTf tf = ABSOLUTE(PRESET("A", "scalarOpacity=\"4 9 1 0 0\"" COLORS " gradientOpacity=\"4 0 0 255 1\" "
                                    "interpolation=\"0\" scalarOpacityUnitDistance=\"0.5\""));
    CHECK(tf.particle_step == 0.5 && at(&tf, 0, -1) == 0 && at(&tf, 9, -1) == 1);
    CHECK(strstr(tf_said, "warning: transfer function 'x': preset 'A': gradientOpacity is ignored"));
    CHECK(strstr(tf_said, "warning: transfer function 'x': preset 'A': the points of the opacity are not in order"));
    CHECK(strstr(tf_said, "note: transfer function 'x': preset 'A': values are interpolated between voxels"));
    vol_tf_free(&tf);
}

static void test_slicer_faults(void)
{
    FAULT("<MRML/>", "there is no preset in it");
    FAULT("<MRML>\n" PRESET("A", COLORS) "</MRML>", "line 2: preset 'A': 'scalarOpacity' is missing");
    FAULT("<MRML>\n" PRESET("A", OPACITY) "</MRML>", "line 2: preset 'A': 'colorTransfer' is missing");
    FAULT(PRESET("A", COLORS " scalarOpacity=\"\""),
          "line 1: preset 'A': 'scalarOpacity' does not begin with the count of its numbers");
    FAULT(PRESET("A", COLORS " scalarOpacity=\"3 0 0 1\""),
          "line 1: preset 'A': 'scalarOpacity' has 3 numbers, which are not groups of 2");
    FAULT(PRESET("A", COLORS " scalarOpacity=\"1e18 0 0 1\""),
          "line 1: preset 'A': 'scalarOpacity' has fewer than the 1000000000000000000 numbers it promises");
    FAULT(PRESET("A", COLORS " scalarOpacity=\"4 0.5 0.5 0.5\""),
          "line 1: preset 'A': number 4 of 'scalarOpacity' is missing or not a finite number");
    FAULT(PRESET("A", COLORS " scalarOpacity=\"4 0 0 nan 1\""),
          "line 1: preset 'A': number 3 of 'scalarOpacity' is missing or not a finite number");
    FAULT(PRESET("A", COLORS " scalarOpacity=\"2 0 0 1 1\""),
          "line 1: preset 'A': 'scalarOpacity' has more than the 2 numbers it promises");
    FAULT(PRESET("A", COLORS " scalarOpacity=\"2 0 2\""), "line 1: preset 'A': point 1: opacity 2 lies outside [0, 1]");
    FAULT(PRESET("A", OPACITY COLORS " ambient=\"x\""),
          "line 1: preset 'A': ambient 'x' of <VolumeProperty> is not a finite number");
    FAULT(PRESET("A", OPACITY COLORS " diffuse=\"-1\""), "line 1: preset 'A': 'diffuse' -1 is less than 0");
}

static void test_damaged_xml(void)
{
    FAULT("<MRML>\n<a>\n</b></MRML>", "line 3: mismatched tag");
    FAULT("<MRML>\n", "line 2: no element found");
    FAULT("<!DOCTYPE a [<!ENTITY b \"c\">]><MRML/>", "line 1: document type declarations are not supported");
    FAULT("<svg/>", "line 1: its root <svg> is none of <MRML> (3D Slicer), <InviwoTreeData>, <VoreenData>");
    char deep[4000] = "";
    for (int i = 0; i < 1000; i++)
        strcat(deep, "<a>");
    FAULT(deep, "line 1: elements are nested too deeply");
}

/* ---- Inviwo ---- */

#define INVIWO(rest) "<InviwoTreeData version=\"1.0\">\n" rest "</InviwoTreeData>"
#define RGBA(x, y, z, w) "<rgba x=\"" #x "\" y=\"" #y "\" z=\"" #z "\" w=\"" #w "\"/>"
#define OLD_POINT(v, color) "<point><pos x=\"" #v "\" y=\"0\"/>" color "</point>\n"
#define NEW_POINT(tag, v, color) "<" tag "><pos content=\"" #v "\"/>" color "</" tag ">\n"

static void test_inviwo(void)
{
    VolTf tf = RELATIVE(INVIWO("<maskMin content=\"0\"/><maskMax content=\"1\"/><dataPoints>" OLD_POINT(
        0, RGBA(0, 0, 0, 0)) OLD_POINT(1, RGBA(1, 0.5, 0, 0.5)) "</dataPoints><interpolationType_ content=\"0\"/>"));
    COLOR(&tf, 0.3, 0.3, 0.15, 0);
    CHECK_NEAR(at(&tf, 0.3, -1), 0.15, 1e-12, 0);
    CHECK_TEXT(tf_said, "");
    vol_tf_free(&tf);

    tf = RELATIVE(INVIWO("<maskMin content=\"0.25\"/><maskMax content=\"0.5\"/><Points>" NEW_POINT(
        "Point", 0, RGBA(1, 1, 1, 0)) NEW_POINT("Point", 1, RGBA(1, 1, 1, 1)) "</Points>"));
    CHECK(at(&tf, 0.2499, -1) == 0 && at(&tf, 0.25, -1) == 0.25 && at(&tf, 0.5, -1) == 0 && at(&tf, 2, -1) == 0);
    CHECK_NEAR(at(&tf, 0.4999, -1), 0.4999, 1e-9, 0);
    vol_tf_free(&tf);

    tf = ABSOLUTE(INVIWO("<maskMin content=\"-1.79769313486232e+308\"/><maskMax content=\"1.79769313486232e+308\"/>"
                         "<type content=\"1\"/><TFPrimitives>" NEW_POINT("TFPrimitive", 700, RGBA(1, 1, 1, 1))
                             NEW_POINT("TFPrimitive", -300, RGBA(1, 1, 1, 0)) "</TFPrimitives>"));
    CHECK_NEAR(at(&tf, 200, -1), 0.5, 1e-12, 0);
    CHECK_TEXT(tf_said, "warning: transfer function 'x': its points are not in order; they are sorted by value\n");
    vol_tf_free(&tf);
}

static void test_inviwo_faults(void)
{
    FAULT(INVIWO(""), "it has no list of points: <dataPoints>, <Points> or <TFPrimitives>");
    FAULT(INVIWO("<Points/>"), "line 2: its list of points is empty");
    FAULT(INVIWO("<Points>\n<Point><pos content=\"0\"/></Point></Points>"), "line 3: point 1 has no <rgba>");
    FAULT(INVIWO("<Points>\n<Point>" RGBA(1, 1, 1, 1) "</Point></Points>"), "line 3: point 1 has no <pos>");
    FAULT(INVIWO("<Points>" NEW_POINT("Point", inf, RGBA(1, 1, 1, 1)) "</Points>"),
          "line 2: content 'inf' of <pos> is not a finite number");
    FAULT(INVIWO("<Points>" NEW_POINT("Point", 0, RGBA(1, 1, 1, 3)) "</Points>"),
          "line 2: point 1: opacity 3 lies outside [0, 1]");
    FAULT(INVIWO("<type content=\"7\"/><Points>" NEW_POINT("Point", 0, RGBA(1, 1, 1, 1)) "</Points>"),
          "line 2: the type of its positions is neither 0 (relative) nor 1 (absolute)");
    FAULT(INVIWO("<maskMin content=\"1\"/><maskMax content=\"0\"/><Points>"
                 NEW_POINT("Point", 0, RGBA(1, 1, 1, 1)) "</Points>"),
          "maskMin 1 is greater than maskMax 0");
    FAULT_PART(INVIWO(""), "a", "there is one transfer function in it, none named 'a'");
}

/* ---- Voreen ---- */

#define VOREEN(rest) "<VoreenData version=\"1\"><TransFuncIntensity>\n" rest "</TransFuncIntensity></VoreenData>"
#define SIDE(side, r, g, b, a) "<color" side " r=\"" #r "\" g=\"" #g "\" b=\"" #b "\" a=\"" #a "\"/>"
#define KEY(v, split, sides) "<key><intensity value=\"" #v "\"/><split value=\"" #split "\"/>" sides "</key>\n"
#define TWO_KEYS "<Keys>" KEY(0, false, SIDE("L", 255, 0, 0, 0)) KEY(1, false, SIDE("L", 255, 0, 51, 102)) "</Keys>"

static void test_voreen(void)
{
    VolTf tf = RELATIVE(VOREEN(TWO_KEYS "<lower value=\"0\"/><upper value=\"1\"/>"));
    CHECK(tf.scatter.nodes[0].v == 0 && tf.scatter.nodes[tf.scatter.count - 1].v == 1);
    CHECK_NEAR(at(&tf, 0.5, -1), 0.2, 1e-12, 0);
    COLOR(&tf, 1, 1, 0, 0.2);
    vol_tf_free(&tf);

    tf = ABSOLUTE(VOREEN("<domain x=\"-100\" y=\"300\"/><threshold x=\"0.25\" y=\"0.75\"/>" TWO_KEYS));
    CHECK(at(&tf, -1, -1) == 0 && at(&tf, 201, -1) == 0);
    CHECK_NEAR(at(&tf, 0, -1), 0.1, 1e-12, 0);
    CHECK_NEAR(at(&tf, 199, -1), 0.4 * 299 / 400, 1e-12, 0);
    vol_tf_free(&tf);

    tf = RELATIVE(VOREEN("<Keys>" KEY(0.5, true, SIDE("L", 255, 0, 0, 51) SIDE("R", 0, 0, 255, 204)) "</Keys>"));
    CHECK(at(&tf, 0.4, -1) == 0.2 && at(&tf, 0.5, -1) == 0.8 && tf.scatter.count == 2);
    COLOR(&tf, 0.4, 1, 0, 0);
    COLOR(&tf, 0.5, 0, 0, 1);
    vol_tf_free(&tf);
}

static void test_voreen_alpha(void)
{
    VolTf tf = RELATIVE(VOREEN("<alphaMode value=\"2\"/><Keys>" KEY(0, false, SIDE("L", 0, 0, 0, 9)) KEY(
        0.25, false, SIDE("L", 0, 0, 0, 0)) KEY(0.5, false, SIDE("L", 0, 0, 0, 0))
                                KEY(1, false, SIDE("L", 0, 0, 0, 1)) "</Keys>"));
    CHECK(at(&tf, 0, -1) == 1 && at(&tf, 0.24, -1) == 1 && at(&tf, 0.26, -1) == 0);
    CHECK(at(&tf, 0.49, -1) == 0 && at(&tf, 0.51, -1) == 1 && at(&tf, 1, -1) == 1);
    vol_tf_free(&tf);
    tf = RELATIVE(VOREEN("<alphaMode value=\"0\"/><gammaValue value=\"2\"/>" TWO_KEYS));
    CHECK(at(&tf, 0.5, -1) == 0);
    CHECK(strstr(tf_said, "everything is transparent") && strstr(tf_said, "gammaValue of 2 is ignored"));
    vol_tf_free(&tf);
    tf = RELATIVE(VOREEN("<ignoreAlpha value=\"true\"/>" TWO_KEYS));
    CHECK(at(&tf, 0.01, -1) == 1);
    vol_tf_free(&tf);
}

static void test_voreen_faults(void)
{
    FAULT("<VoreenData/>", "it has no <TransFuncIntensity>");
    FAULT(VOREEN(""), "line 1: it has no <Keys>");
    FAULT(VOREEN("<Keys/>"), "line 2: its <Keys> are empty");
    FAULT(VOREEN("<Keys>\n<key/></Keys>"), "line 3: key 1 has no <intensity>");
    FAULT(VOREEN("<Keys>" KEY(0, false, "") "</Keys>"), "line 2: key 1 has no <colorL>");
    FAULT(VOREEN("<Keys>" KEY(0, true, SIDE("L", 0, 0, 0, 0)) "</Keys>"), "line 2: key 1 has no <colorR>");
    FAULT(VOREEN("<Keys>" KEY(0, maybe, SIDE("L", 0, 0, 0, 0)) "</Keys>"), "line 2: <split> is neither true nor false");
    FAULT(VOREEN("<Keys>" KEY(0, false, SIDE("L", 0, 999, 0, 0)) "</Keys>"),
          "line 2: point 1: green 3.91764706 lies outside [0, 1]");
    FAULT(VOREEN("<Keys>" KEY(0, false, "<colorL r=\"1\" g=\"1\" b=\"1\"/>") "</Keys>"), "line 2: <colorL> has no 'a'");
    FAULT(VOREEN("<domain x=\"5\" y=\"5\"/>" TWO_KEYS), "its domain, 5 to 5, is empty");
    FAULT(VOREEN("<lower value=\"1\"/><upper value=\"0\"/>" TWO_KEYS),
          "its lower threshold 1 is greater than the upper one, 0");
    FAULT(VOREEN("<alphaMode value=\"5\"/>" TWO_KEYS), "alphaMode 5 is none of 0, 1, 2");
}

/* ---- OSPRay ---- */

typedef struct Tfn {
    unsigned char bytes[200];
    size_t size;
} Tfn;

static void put(Tfn *t, uint64_t number, size_t size)
{
    for (size_t i = 0; i < size; i++)
        t->bytes[t->size++] = (unsigned char)(number >> 8 * i);
}

static void put_float(Tfn *t, float value)
{
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    put(t, bits, 4);
}

static Tfn tfn(uint64_t version, double max)
{
    Tfn t = {"FTSO", 4};
    uint64_t bits;
    memcpy(&bits, &max, sizeof bits);
    put(&t, version, 8);
    put(&t, 3, 8);
    put(&t, 'a' | 'b' << 8 | 'c' << 16, 3);
    put(&t, 2, 8);
    put(&t, 3, 8);
    put(&t, 0, 8);
    put(&t, bits, 8);
    put_float(&t, 0.5f);
    static const float rest[] = {1, 0, 0, 0, 0, 1, 0, -0.25f, 0.5f, 0.5f, 1, 1};
    for (size_t i = 0; i < sizeof rest / sizeof *rest; i++)
        put_float(&t, rest[i]);
    return t;
}

static void test_ospray(void)
{
    VolTf tf;
    VolError err = {{0}};
    VolTfUnits units;
    Tfn t = tfn(1, 1);
    CHECK(read_bytes(t.bytes, t.size, NULL, &tf, &units, &err) == VOL_OK && units.relative);
    COLOR(&tf, 0.25, 0.75, 0, 0.25);
    CHECK(at(&tf, 0, -1) == 0 && at(&tf, 0.5, -1) == 0.25 && at(&tf, 1, -1) == 0.5);
    vol_tf_free(&tf);
    t = tfn(1, 40);
    CHECK(read_bytes(t.bytes, t.size, NULL, &tf, &units, &err) == VOL_OK && !units.relative);
    CHECK(at(&tf, 20, -1) == 0.25);
    vol_tf_free(&tf);
    for (size_t size = 4; size < t.size; size++)
        CHECK(read_bytes(t.bytes, size, NULL, &tf, &units, &err) == VOL_BAD_INPUT && strstr(err.text, "'x': it"));
    t = tfn(2, 1);
    CHECK(read_bytes(t.bytes, t.size, NULL, &tf, &units, &err) == VOL_BAD_INPUT);
    CHECK_TEXT(err.text, "bad transfer function 'x': version 2 of .tfn is not known");
    t = tfn(1, NAN);
    CHECK(read_bytes(t.bytes, t.size, NULL, &tf, &units, &err) == VOL_BAD_INPUT);
    CHECK_TEXT(err.text, "bad transfer function 'x': the number at byte 47 is not finite");
    t = tfn(1, 1);
    memset(t.bytes + 23, 0xff, 16); /* counts */
    CHECK(read_bytes(t.bytes, t.size, NULL, &tf, &units, &err) == VOL_BAD_INPUT);
}

/* ---- Damage ---- */

/* Bytes changed, left out and doubled at random: an error or a transfer function in order, never anything else. */
static void damage(const void *data, size_t size, uint64_t seed)
{
    unsigned char copy[4096];
    uint64_t state = seed;
    for (int round = 0; round < 3000; round++) {
        memcpy(copy, data, size);
        for (int k = 0; k < 3; k++) {
            state = state * 6364136223846793005u + 1442695040888963407u;
            static const char likely[] = "0129.-e\"<>/[]{},: nX\0\xff";
            size_t i = (size_t)(state >> 33) % size;
            copy[i] = (unsigned char)likely[(state >> 20) % (sizeof likely - 1)];
        }
        size_t kept = round % 3 ? size : (size_t)(state >> 40) % (size + 1);
        VolTf tf;
        VolError err = {{0}};
        VolTfUnits units;
        VolStatus status = read_bytes(copy, kept, NULL, &tf, &units, &err);
        CHECK(status == VOL_OK || (status == VOL_BAD_INPUT && err.text[0]));
        if (status != VOL_OK)
            continue;
        for (size_t i = 0; i < tf.scatter.count; i++) {
            const VolTfNode *n = &tf.scatter.nodes[i];
            CHECK(fabs(n->v) <= 1e300 && n->amount >= 0 && n->amount <= 1);
            CHECK((i < 1 || n[-1].v <= n->v) && (i < 2 || n[-2].v < n->v));
            CHECK(n->color[0] >= 0 && n->color[1] >= 0 && n->color[2] >= 0);
            CHECK(n->color[0] <= 1 && n->color[1] <= 1 && n->color[2] <= 1);
        }
        vol_tf_free(&tf);
    }
}

static void test_damage(void)
{
    static const char *const samples[] = {
        "[{\"Name\": \"A\", \"ColorSpace\": \"Lab\", \"RGBPoints\": [0, 0.2, 0.1, 0.9, 5, 1, 0.5, 0, 9, 1, 1, 1], "
        "\"Points\": [0, 0, 0.3, 0.4, 9, 1, 0.5, 0]}]",
        "{\"ColorSpace\": \"Diverging\", " COOL_TO_WARM "}",
        "<MRML>" PRESET("A", OPACITY COLORS " shade=\"1\"") "</MRML>",
        INVIWO("<maskMin content=\"0.2\"/><dataPoints>" OLD_POINT(0, RGBA(0, 0, 0, 0)) OLD_POINT(1, RGBA(1, 0.5, 0, 0.5))
               "</dataPoints>"),
        VOREEN("<alphaMode value=\"2\"/><domain x=\"0\" y=\"255\"/><threshold x=\"0.1\" y=\"0.9\"/>" TWO_KEYS)};
    for (size_t i = 0; i < sizeof samples / sizeof *samples; i++)
        damage(samples[i], strlen(samples[i]), i + 1);
    Tfn t = tfn(1, 1);
    damage(t.bytes, t.size, 99);
}

/* What the opacities of each program hold for; a file that says so itself is believed. */
static void test_lengths(void)
{
    static const struct {
        const char *text;
        VolStepUnit unit;
        double step;
    } rows[] = {
        {"{\"pellucid\": \"transfer-function/1\", \"particle_step\": 3}", VOL_STEP_WORLD, 3},
        {"{\"RGBPoints\": [0, 0, 0, 0, 9, 1, 1, 1]}", VOL_STEP_CELL, 1},
        {"{\"ScalarOpacityUnitDistance\": 0.25, \"RGBPoints\": [0, 0, 0, 0, 9, 1, 1, 1]}", VOL_STEP_WORLD, 0.25},
        {PRESET("A", OPACITY COLORS), VOL_STEP_VOXEL, 1},
        {PRESET("A", OPACITY COLORS " scalarOpacityUnitDistance=\"0.5\""), VOL_STEP_WORLD, 0.5},
        {INVIWO("<Points>" OLD_POINT(0.5, RGBA(1, 1, 1, 1)) "</Points>"), VOL_STEP_BOX, 1.0 / 150},
        {VOREEN(TWO_KEYS), VOL_STEP_BOX, 1.0 / 200},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        VolTf tf;
        VolError err;
        VolTfUnits units;
        CHECK(read_bytes(rows[i].text, strlen(rows[i].text), NULL, &tf, &units, &err) == VOL_OK);
        CHECK(units.step == rows[i].unit && tf.particle_step == rows[i].step);
        vol_tf_free(&tf);
    }
}

int main(void)
{
    RUN(test_names);
    RUN(test_rescale);
    RUN(test_own);
    RUN(test_paraview_encoded);
    RUN(test_paraview_ranges);
    RUN(test_paraview_spaces);
    RUN(test_paraview_steps);
    RUN(test_paraview_bent_opacity);
    RUN(test_paraview_choice);
    RUN(test_paraview_faults);
    RUN(test_thousands_of_points);
    RUN(test_slicer);
    RUN(test_slicer_lost);
    RUN(test_slicer_faults);
    RUN(test_damaged_xml);
    RUN(test_inviwo);
    RUN(test_inviwo_faults);
    RUN(test_voreen);
    RUN(test_voreen_alpha);
    RUN(test_voreen_faults);
    RUN(test_ospray);
    RUN(test_lengths);
    RUN(test_damage);
    return test_end();
}
