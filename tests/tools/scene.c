/* Renders tiny scenes and compares every channel of the pixels they name with what they expect.
 *
 *     scene SCENE.json...
 *
 * A scene holds a transfer function, a command and the pixels that follow (tests/micro/README.md says more); the volume
 * stands beside it as SCENE.vdb.  Runs in the current folder, with the programs found through PATH.  Four lines of TAP
 * per scene: in float, with --precise, with --precise --probe (double, no image), and the same bytes at every cpu level
 * and number of threads. */
#include "tool.h"

typedef struct Scene {
    const char *name; /* "01a-homogeneous" */
    const char *vdb;
    const char *command;
    json_t *pixels;
    double abs, rel, precise_rel;
} Scene;

/* The command with $TF, $VDB and $EXR filled in and `extra` options put after the program's name; with `exr` NULL
 * -o $EXR is left out. */
static void fill_command(const Scene *scene, const char *extra, const char *exr, Text *out)
{
    static const char program[] = "vol-render ";
    if (strncmp(scene->command, program, strlen(program)) != 0)
        die("%s: the command does not begin with %s", scene->name, program);
    text_add(out, "%s%s ", program, extra);
    for (const char *c = scene->command + strlen(program); *c;) {
        if (strncmp(c, "$TF", 3) == 0) {
            text_add(out, "tf.json");
            c += 3;
        } else if (strncmp(c, "$VDB", 4) == 0) {
            text_add(out, "'%s'", scene->vdb);
            c += 4;
        } else if (!exr && strncmp(c, "-o $EXR", 7) == 0) {
            c += 7;
        } else if (strncmp(c, "$EXR", 4) == 0) {
            text_add(out, "%s", exr);
            c += 4;
        } else {
            text_add(out, "%c", *c++);
        }
    }
}

/* The channels present must be those expected and no others. */
static bool same_channels(const VolPart *part, json_t *want, char *why, size_t why_size)
{
    const char *name;
    json_t *value;
    json_object_foreach (want, name, value)
        if (!vol_part_channel(part, name)) {
            snprintf(why, why_size, "channel %s is missing", name);
            return false;
        }
    for (size_t i = 0; i < part->channel_count; i++)
        if (!json_object_get(want, part->channels[i].name)) {
            snprintf(why, why_size, "channel %s is not expected", part->channels[i].name);
            return false;
        }
    return true;
}

static bool image_agrees(const Scene *scene, const VolImage *image, double rel, double floor_, char *why, size_t why_size)
{
    if (image->part_count != 1) {
        snprintf(why, why_size, "%zu parts, expected 1", image->part_count);
        return false;
    }
    const VolPart *part = &image->parts[0];
    size_t i;
    json_t *entry;
    json_array_foreach (scene->pixels, i, entry) {
        int x = (int)json_integer_value(json_array_get(entry, 0)), y = (int)json_integer_value(json_array_get(entry, 1));
        json_t *want = json_array_get(entry, 2), *value;
        if (!same_channels(part, want, why, why_size))
            return false;
        const char *name;
        json_object_foreach (want, name, value) {
            char what[64];
            snprintf(what, sizeof what, "pixel %d,%d %s", x, y, name);
            if (!near(pixel(part, name, x, y), json_number_value(value), rel, floor_, what, why, why_size))
                return false;
        }
    }
    return true;
}

static void test_image(const Scene *scene, const char *mode, double rel, double floor_)
{
    char why[4096] = "";
    Text command = {.size = 0};
    fill_command(scene, mode, "out.exr", &command);
    remove("out.exr");
    bool good = run_well(command.bytes, why, sizeof why);
    VolImage image = {0};
    good = good && read_image("out.exr", &image, why, sizeof why);
    good = good && image_agrees(scene, &image, rel, floor_, why, sizeof why);
    vol_image_free(&image);
    tap(good ? NULL : why, "%s%s%s", scene->name, *mode ? " " : "", mode);
}

static bool probe_agrees(const Scene *scene, json_t *probe, char *why, size_t why_size)
{
    size_t i;
    json_t *entry;
    json_array_foreach (scene->pixels, i, entry) {
        int x = (int)json_integer_value(json_array_get(entry, 0)), y = (int)json_integer_value(json_array_get(entry, 1));
        json_t *want = json_array_get(entry, 2), *channels = probed_channels(probe, x, y), *value;
        if (!channels || json_object_size(channels) != json_object_size(want)) {
            snprintf(why, why_size, "pixel %d,%d is missing or has other channels", x, y);
            return false;
        }
        const char *name;
        json_object_foreach (want, name, value) {
            char what[64];
            snprintf(what, sizeof what, "pixel %d,%d %s", x, y, name);
            json_t *got = json_object_get(channels, name);
            if (!near(json_is_number(got) ? json_number_value(got) : (double)NAN, json_number_value(value), 1e-12, 1e-12,
                      what, why, why_size))
                return false;
        }
    }
    return true;
}

static void test_probe(const Scene *scene)
{
    char why[4096] = "";
    Text options = {.size = 0}, command = {.size = 0};
    text_add(&options, "--precise");
    size_t i;
    json_t *entry;
    json_array_foreach (scene->pixels, i, entry)
        text_add(&options, " --probe %d,%d", (int)json_integer_value(json_array_get(entry, 0)),
                 (int)json_integer_value(json_array_get(entry, 1)));
    fill_command(scene, options.bytes, NULL, &command);
    text_add(&command, " >probe.json");
    bool good = run_well(command.bytes, why, sizeof why);
    json_t *probe = NULL;
    if (good) {
        json_error_t error;
        probe = json_load_file("probe.json", 0, &error);
        good = probe && probe_agrees(scene, probe, why, sizeof why);
        if (!probe)
            snprintf(why, sizeof why, "--probe: line %d: %s", error.line, error.text);
    }
    json_decref(probe);
    tap(good ? NULL : why, "%s --precise --probe", scene->name);
}

static void test_same_bytes(const Scene *scene)
{
    static const char *const ways[] = {"--cpu scalar -j1", "--cpu scalar -j2", "--cpu auto -j1", "--cpu auto -j2"};
    char why[4096] = "";
    bool good = true;
    for (size_t i = 0; good && i < sizeof ways / sizeof *ways; i++) {
        Text command = {.size = 0};
        fill_command(scene, ways[i], i ? "other.exr" : "first.exr", &command);
        good = run_well(command.bytes, why, sizeof why);
        if (good && i && !same_files("first.exr", "other.exr")) {
            snprintf(why, sizeof why, "%s and %s write other bytes", ways[0], ways[i]);
            good = false;
        }
    }
    tap(good ? NULL : why, "%s same bytes at every cpu level and number of threads", scene->name);
}

static double number(json_t *object, const char *key, const char *path)
{
    json_t *value = json_object_get(object, key);
    if (!json_is_number(value))
        die("%s: no number '%s'", path, key);
    return json_number_value(value);
}

static void test_scene(const char *path)
{
    char name[256], vdb[4096];
    const char *base = strrchr(path, '/');
    snprintf(name, sizeof name, "%s", base ? base + 1 : path);
    char *dot = strrchr(name, '.');
    if (!dot || strlen(path) < 5)
        die("'%s' is not named SCENE.json", path);
    *dot = '\0';
    snprintf(vdb, sizeof vdb, "%.*s.vdb", (int)(strlen(path) - 5), path);

    json_t *json = read_json(path), *tolerance = json_object_get(json, "tolerance");
    Scene scene = {name, vdb, json_string_value(json_object_get(json, "command")),
                   json_object_get(json_object_get(json, "expect"), "pixels"), number(tolerance, "abs", path),
                   number(tolerance, "rel", path), number(tolerance, "precise_rel", path)};
    if (!scene.command || !json_array_size(scene.pixels))
        die("%s: no command or no pixels", path);
    if (json_dump_file(json_object_get(json, "tf"), "tf.json", JSON_REAL_PRECISION(17)))
        die("cannot write tf.json");
    test_image(&scene, "", scene.rel, scene.abs);
    test_image(&scene, "--precise", scene.precise_rel, 1e-9);
    test_probe(&scene);
    test_same_bytes(&scene);
    json_decref(json);
}

int main(int argc, char **argv)
{
    if (argc < 2)
        die("usage: scene SCENE.json...");
    for (int i = 1; i < argc; i++)
        test_scene(argv[i]);
    return tap_end();
}
