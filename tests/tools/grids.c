/* Solves for the light of tiny scenes and compares every voxel that they name with what they expect.
 *
 *     grids SCENE.json...
 *
 * Scenes as for `scene`, but their command begins with light-solve, and expect.grids holds {name: [[i, j, k, value], ..]}.
 * What comes after a `|` in the command is left out.  Runs in the current folder, with the programs found through PATH.  Two
 * lines of TAP per scene: the voxels, and the same bytes at every cpu level and number of threads. */
#include "io/vdb.h"
#include "tool.h"

typedef struct Scene {
    const char *name, *vdb, *command;
    json_t *grids;
    double abs, rel;
} Scene;

/* The command up to `|`, with `extra` options put after the program's name. */
static void fill_command(const Scene *scene, const char *extra, const char *output, Text *out)
{
    static const char program[] = "light-solve ";
    if (strncmp(scene->command, program, strlen(program)) != 0)
        die("%s: the command does not begin with %s", scene->name, program);
    text_add(out, "%s%s ", program, extra);
    for (const char *c = scene->command + strlen(program); *c && *c != '|';) {
        if (strncmp(c, "$TF", 3) == 0) {
            text_add(out, "tf.json");
            c += 3;
        } else if (strncmp(c, "$VDB", 4) == 0) {
            text_add(out, "'%s'", scene->vdb);
            c += 4;
        } else {
            text_add(out, "%c", *c++);
        }
    }
    text_add(out, " -f -o %s", output);
}

/* One voxel that is looked for. */
typedef struct Wanted {
    int32_t at[3];
    int components; /* 1, or 3 of RGB */
    double value[3];
    bool seen;
} Wanted;

static VolStatus see_type(void *user, const VolVdbGridInfo *info, VolError *err)
{
    (void)err;
    Wanted *wanted = user;
    wanted->components = vol_vdb_components(info->value);
    return VOL_OK;
}

static VolStatus see_leaf(void *user, const int32_t origin[3], const double *values, const uint64_t active[8], VolError *err)
{
    (void)err;
    Wanted *wanted = user;
    int n = 0;
    for (int a = 0; a < 3; a++) {
        int32_t in_leaf = wanted->at[a] - origin[a];
        if (in_leaf < 0 || in_leaf > 7)
            return VOL_OK;
        n = n * 8 + in_leaf;
    }
    wanted->seen = active[n / 64] >> n % 64 & 1;
    for (int c = 0; c < wanted->components; c++)
        wanted->value[c] = values[n * wanted->components + c];
    return VOL_OK;
}

static bool grid_agrees(const Scene *scene, const VolVdb *vdb, const char *name, json_t *voxels, char *why, size_t why_size)
{
    const VolVdbVisitor visitor = {.begin = see_type, .leaf_double = see_leaf};
    VolError err;
    size_t index, i;
    json_t *entry;
    if (vol_vdb_find(vdb, name, &index, &err) != VOL_OK) {
        snprintf(why, why_size, "%s", err.text);
        return false;
    }
    json_array_foreach (voxels, i, entry) {
        Wanted wanted = {.seen = false};
        char what[128];
        for (size_t a = 0; a < 3; a++)
            wanted.at[a] = (int32_t)json_integer_value(json_array_get(entry, a));
        if (vol_vdb_visit(vdb, index, &visitor, &wanted, &err) != VOL_OK)
            die("%s: %s", scene->name, err.text);
        snprintf(what, sizeof what, "%s voxel %d,%d,%d", name, wanted.at[0], wanted.at[1], wanted.at[2]);
        if (!wanted.seen) {
            snprintf(why, why_size, "%s is not active", what);
            return false;
        }
        json_t *value = json_array_get(entry, 3);
        if (wanted.components != (json_is_array(value) ? 3 : 1)) {
            snprintf(why, why_size, "%s has %d components", what, wanted.components);
            return false;
        }
        for (int c = 0; c < wanted.components; c++) {
            json_t *one = json_is_array(value) ? json_array_get(value, (size_t)c) : value;
            if (!near(wanted.value[c], json_number_value(one), scene->rel, scene->abs, what, why, why_size))
                return false;
        }
    }
    return true;
}

static void test_grids(const Scene *scene)
{
    char why[4096] = "";
    Text command = {.size = 0};
    VolBytes bytes;
    VolVdb *vdb = NULL;
    VolError err;
    fill_command(scene, "", "lit.vdb", &command);
    bool good = run_well(command.bytes, why, sizeof why);
    if (good && (vol_read_whole("lit.vdb", true, &bytes, &err) || vol_vdb_open(bytes, "lit.vdb", &vdb, &err))) {
        snprintf(why, sizeof why, "%s", err.text);
        good = false;
    }
    const char *name;
    json_t *voxels;
    json_object_foreach (scene->grids, name, voxels)
        good = good && grid_agrees(scene, vdb, name, voxels, why, sizeof why);
    if (vdb)
        vol_vdb_close(vdb);
    tap(good ? NULL : why, "%s light grids", scene->name);
}

static void test_same_bytes(const Scene *scene)
{
    static const char *const ways[] = {"--cpu scalar -j1", "--cpu scalar -j2", "--cpu auto -j1", "--cpu auto -j2"};
    char why[4096] = "";
    bool good = true;
    for (size_t i = 0; good && i < sizeof ways / sizeof *ways; i++) {
        Text command = {.size = 0};
        fill_command(scene, ways[i], i ? "other.vdb" : "first.vdb", &command);
        good = run_well(command.bytes, why, sizeof why);
        if (good && i && !same_files("first.vdb", "other.vdb")) {
            snprintf(why, sizeof why, "%s and %s write other bytes", ways[0], ways[i]);
            good = false;
        }
    }
    tap(good ? NULL : why, "%s same light at every cpu level and number of threads", scene->name);
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
    const Scene scene = {name, vdb, json_string_value(json_object_get(json, "command")),
                         json_object_get(json_object_get(json, "expect"), "grids"),
                         json_number_value(json_object_get(tolerance, "abs")),
                         json_number_value(json_object_get(tolerance, "rel"))};
    if (!scene.command || !json_object_size(scene.grids))
        die("%s: no command or no grids", path);
    if (json_dump_file(json_object_get(json, "tf"), "tf.json", JSON_REAL_PRECISION(17)))
        die("cannot write tf.json");
    test_grids(&scene);
    test_same_bytes(&scene);
    json_decref(json);
}

int main(int argc, char **argv)
{
    if (argc < 2)
        die("usage: grids SCENE.json...");
    for (int i = 1; i < argc; i++)
        test_scene(argv[i]);
    return tap_end();
}
