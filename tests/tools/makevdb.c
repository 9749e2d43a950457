/* Makes small volumes for the tests, on stdout.  Unlike vol-gen it can make what no user would want.
 *
 *     makevdb [--name NAME] [--type float|double|half|int32|vec3s] [--dims X,Y,Z] [--origin I,J,K] [--voxel H]
 *             [--map M00,..,M32] [--background B] [--sparse] [--empty] [--field FIELD] [--poke I,J,K,V]...
 *             [--tile I,J,K,SIDE,V[,0]]... [--unfold] [--class CLASS] [--box] [--text KEY=VALUE] [--frustum]
 *             [--light SPEC] [--also ...]
 *
 * --map: twelve numbers, world = (i, j, k, 1) M by rows.  --field: const:V, linear:A,B,C,D (A x + B y + C z + D in world
 * space), tent:Z,A,B (A x + B |z - Z|), bowl:X,Y,Z (squared distance to a point), gauss:X,Y,Z,S (exp(-r^2 / 2 S^2)),
 * waves (smooth, in [0, 1]), noise:SEED (independent voxels in [0, 1)), nan.  --poke sets one voxel.
 * --tile: a cube of 8, 128 or 4096 voxels of one value, inactive where a 0 ends it, beside the box of voxels (--sparse; none
 * with --empty).  --unfold writes tiles as voxels, those of 4096 as tiles of 128.  --box: the domain is the box of --dims
 * and --origin, whatever is active.
 * --light: light:spec of the grid.
 * --also begins another grid, which starts from the same settings.  --frustum: the last grid's transform becomes the second
 * half of a camera's frustum, as other programs write them. */
#include <stdint.h>

#include "base/fmath.h"
#include "io/vdb.h"
#include "tool.h"

enum { MAX_POKES = 8, MAX_TILES = 64 };

typedef struct Spec {
    const char *name, *type, *field, *light;
    int32_t dims[3], origin[3];
    VolAffine map;
    double background;
    bool sparse, empty;
    double pokes[MAX_POKES][4];
    size_t poke_count;
    const char *grid_class;
    double tiles[MAX_TILES][6]; /* place, side, value, active */
    size_t tile_count;
    bool unfold, box;
} Spec;

static void numbers(const char *text, double *out, size_t count, const char *what)
{
    char *end = NULL;
    for (size_t i = 0; i < count; i++) {
        out[i] = strtod(text, &end);
        if (end == text || *end != (i + 1 < count ? ',' : '\0'))
            die("%s wants %zu numbers", what, count);
        text = end + 1;
    }
}

static void tile(const char *text, double out[6])
{
    size_t commas = 0;
    for (const char *at = text; *at; at++)
        commas += *at == ',';
    out[5] = 1;
    numbers(text, out, commas == 5 ? 6 : 5, "--tile");
}

static void integers(const char *text, int32_t out[3], const char *what)
{
    double n[3];
    numbers(text, n, 3, what);
    for (int a = 0; a < 3; a++)
        out[a] = (int32_t)n[a];
}

/* A well mixed number in [0, 1) of a voxel's place: 53 bits. */
static double noise(const int32_t ijk[3], uint64_t seed)
{
    uint64_t h = seed * 0x9e3779b97f4a7c15u + 1;
    for (int a = 0; a < 3; a++) {
        h ^= (uint64_t)(uint32_t)ijk[a];
        h *= 0xbf58476d1ce4e5b9u;
        h ^= h >> 29;
        h *= 0x94d049bb133111ebu;
        h ^= h >> 32;
    }
    return (double)(h >> 11) * 0x1p-53;
}

static double field(const Spec *spec, const int32_t ijk[3])
{
    for (size_t p = 0; p < spec->poke_count; p++)
        if (ijk[0] == (int32_t)spec->pokes[p][0] && ijk[1] == (int32_t)spec->pokes[p][1] &&
            ijk[2] == (int32_t)spec->pokes[p][2])
            return spec->pokes[p][3];
    VolVec3 x = vol_apply(&spec->map, vol_vec3(ijk[0], ijk[1], ijk[2]));
    const char *colon = strchr(spec->field, ':');
    const char *rest = colon ? colon + 1 : "";
    size_t length = colon ? (size_t)(colon - spec->field) : strlen(spec->field);
    double p[4];
#define IS(word) (length == sizeof word - 1 && strncmp(spec->field, word, length) == 0)
    if (IS("const")) {
        numbers(rest, p, 1, "const");
        return p[0];
    }
    if (IS("linear")) {
        numbers(rest, p, 4, "linear");
        return p[0] * x.x + p[1] * x.y + p[2] * x.z + p[3];
    }
    if (IS("tent")) {
        numbers(rest, p, 3, "tent");
        return p[1] * x.x + p[2] * fabs(x.z - p[0]);
    }
    if (IS("bowl") || IS("gauss")) {
        p[3] = 1;
        numbers(rest, p, IS("bowl") ? 3 : 4, spec->field);
        VolVec3 d = vol_sub(x, vol_vec3(p[0], p[1], p[2]));
        return IS("bowl") ? vol_dot(d, d) : vol_exp(-0.5 * vol_dot(d, d) / (p[3] * p[3]));
    }
    if (IS("waves"))
        return 0.5 + (vol_sin(3 * x.x + x.y) + vol_sin(2.5 * x.y - x.z) + vol_sin(3.5 * x.z + 0.7 * x.x)) / 6;
    if (IS("noise")) {
        numbers(rest, p, 1, "noise");
        return noise(ijk, (uint64_t)p[0]);
    }
    if (IS("nan"))
        return (double)NAN;
    die("unknown field '%s'", spec->field);
#undef IS
}

static VolVdbStore store_of(const char *type)
{
    static const char *const names[] = {"float", "half", "double", "int32", "vec3s"};
    static const VolVdbStore stores[] = {VOL_STORE_FLOAT, VOL_STORE_HALF, VOL_STORE_DOUBLE, VOL_STORE_INT32,
                                         VOL_STORE_VEC3S};
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        if (strcmp(type, names[i]) == 0)
            return stores[i];
    die("unknown type '%s'", type);
}

static void must(VolStatus status, const VolError *err)
{
    if (status != VOL_OK)
        die("%s", err->text);
}

static void put_dense(VolVdbWriter *writer, const Spec *spec, size_t components)
{
    VolError err = {""};
    const int32_t *n = spec->dims;
    size_t count = (size_t)n[0] * (size_t)n[1] * (size_t)n[2];
    double *values = malloc(count * components * sizeof *values);
    if (!values)
        die("out of memory");
    size_t at = 0;
    for (int32_t k = 0; k < n[2]; k++)
        for (int32_t j = 0; j < n[1]; j++)
            for (int32_t i = 0; i < n[0]; i++) {
                int32_t ijk[3] = {spec->origin[0] + i, spec->origin[1] + j, spec->origin[2] + k};
                for (size_t c = 0; c < components; c++)
                    values[at++] = field(spec, ijk);
            }
    must(vol_vdb_put_dense_double(writer, spec->origin, n, values, &err), &err);
    free(values);
}

/* One leaf of 8^3 values (z fastest); only those inside the box are active. */
static void put_leaf(VolVdbWriter *writer, const Spec *spec, const int32_t origin[3], size_t components)
{
    double values[512 * 3];
    uint64_t active[8] = {0};
    for (int n = 0; n < 512; n++) {
        int32_t ijk[3] = {origin[0] + (n >> 6), origin[1] + (n >> 3 & 7), origin[2] + (n & 7)};
        bool inside = true;
        for (int a = 0; a < 3; a++)
            inside = inside && ijk[a] >= spec->origin[a] && ijk[a] < spec->origin[a] + spec->dims[a];
        if (inside)
            active[n >> 6] |= (uint64_t)1 << (n & 63);
        for (size_t c = 0; c < components; c++)
            values[(size_t)n * components + c] = inside ? field(spec, ijk) : spec->background;
    }
    VolError err = {""};
    must(vol_vdb_put_leaf_double(writer, origin, values, active, &err), &err);
}

static void put_sparse(VolVdbWriter *writer, const Spec *spec, size_t components)
{
    int32_t lo[3], hi[3];
    for (int a = 0; a < 3; a++) {
        lo[a] = spec->origin[a] & ~7;
        hi[a] = spec->origin[a] + spec->dims[a];
    }
    for (int32_t i = lo[0]; i < hi[0]; i += 8)
        for (int32_t j = lo[1]; j < hi[1]; j += 8)
            for (int32_t k = lo[2]; k < hi[2]; k += 8)
                put_leaf(writer, spec, (int32_t[3]){i, j, k}, components);
}

static void put_smaller_tiles(VolVdbWriter *writer, const int32_t origin[3], double value, bool is_active)
{
    enum { SIDE = 128, COUNT = 32 };
    VolError err = {""};
    const double values[3] = {value, value, value};
    for (int32_t n = 0; n < COUNT * COUNT * COUNT; n++) {
        const int32_t at[3] = {origin[0] + n / (COUNT * COUNT) * SIDE, origin[1] + n / COUNT % COUNT * SIDE,
                               origin[2] + n % COUNT * SIDE};
        must(vol_vdb_put_tile(writer, at, SIDE, values, is_active, &err), &err);
    }
}

static void put_unfolded(VolVdbWriter *writer, const int32_t origin[3], int32_t side, double value, bool is_active)
{
    VolError err = {""};
    double values[512];
    uint64_t active[8];
    memset(active, is_active ? 0xff : 0, sizeof active);
    for (int n = 0; n < 512; n++)
        values[n] = value;
    for (int32_t i = 0; i < side; i += 8)
        for (int32_t j = 0; j < side; j += 8)
            for (int32_t k = 0; k < side; k += 8) {
                const int32_t at[3] = {origin[0] + i, origin[1] + j, origin[2] + k};
                must(vol_vdb_put_leaf_double(writer, at, values, active, &err), &err);
            }
}

static void put_tiles(VolVdbWriter *writer, const Spec *spec)
{
    VolError err = {""};
    for (size_t n = 0; n < spec->tile_count; n++) {
        const double *tile = spec->tiles[n], value[3] = {tile[4], tile[4], tile[4]};
        const int32_t origin[3] = {(int32_t)tile[0], (int32_t)tile[1], (int32_t)tile[2]}, side = (int32_t)tile[3];
        if (spec->unfold && side == 4096)
            put_smaller_tiles(writer, origin, tile[4], tile[5] != 0);
        else if (spec->unfold)
            put_unfolded(writer, origin, side, tile[4], tile[5] != 0);
        else
            must(vol_vdb_put_tile(writer, origin, side, value, tile[5] != 0, &err), &err);
    }
}

/* What vol-import writes beside a dense box. */
static void set_box(VolVdbMetaList *meta, const Spec *spec)
{
    VolError err = {""};
    int32_t last[3];
    for (int a = 0; a < 3; a++)
        last[a] = spec->origin[a] + spec->dims[a] - 1;
    must(vol_meta_set_text(meta, "vol:domain", "box", &err), &err);
    must(vol_meta_set_vec3i(meta, "vol:domainMin", spec->origin, &err), &err);
    must(vol_meta_set_vec3i(meta, "vol:domainMax", last, &err), &err);
}

static void put_grid(VolVdbWriter *writer, const Spec *spec)
{
    VolError err = {""};
    VolVdbNewGrid grid = {.name = spec->name, .store = store_of(spec->type), .index_to_world = spec->map,
                          .grid_class = spec->grid_class};
    if (spec->box)
        set_box(&grid.meta, spec);
    if (spec->light)
        must(vol_meta_set_text(&grid.meta, "light:spec", spec->light, &err), &err);
    size_t components = grid.store == VOL_STORE_VEC3S ? 3 : 1;
    for (size_t c = 0; c < 3; c++)
        grid.background[c] = spec->background;
    must(vol_vdb_begin_grid(writer, &grid, &err), &err);
    if (!spec->empty) {
        if (spec->sparse)
            put_sparse(writer, spec, components);
        else
            put_dense(writer, spec, components);
    }
    put_tiles(writer, spec);
    vol_meta_free(&grid.meta);
    must(vol_vdb_end_grid(writer, &err), &err);
}

static void set_text(VolVdbWriter *writer, const char *text)
{
    VolError err = {""};
    char key[256];
    const char *equals = strchr(text, '=');
    if (!equals || (size_t)(equals - text) >= sizeof key)
        die("--text wants KEY=VALUE");
    snprintf(key, sizeof key, "%.*s", (int)(equals - text), text);
    must(vol_meta_set_text(vol_vdb_writer_file_meta(writer), key, equals + 1, &err), &err);
}

/* A frustum's map stands before the one that is there: kind, box, taper, depth. */
static void make_frustum(VolBytes *bytes)
{
    enum { KIND = 4 + 19, NUMBERS = 8 * 8, MORE = KIND + NUMBERS };
    static const double numbers[8] = {0, 0, 0, 8, 8, 8, 2, 3};
    static const char kind[] = "\x13\0\0\0NonlinearFrustumMap";
    VolError err = {""};
    VolVdb *vdb = NULL;
    VolBytes copy = {malloc(bytes->size), bytes->size};
    unsigned char *longer = malloc(bytes->size + MORE);
    if (!copy.data || !longer)
        die("out of memory");
    memcpy(copy.data, bytes->data, bytes->size);
    must(vol_vdb_open(copy, "itself", &vdb, &err), &err);
    const VolVdbEntry *last = vol_vdb_entry(vdb, vol_vdb_count(vdb) - 1);
    size_t place = last->map_offset - strlen(last->map) - 4;
    memcpy(longer, bytes->data, place);
    memcpy(longer + place, kind, KIND);
    memcpy(longer + place + KIND, numbers, NUMBERS);
    memcpy(longer + place + MORE, bytes->data + place, bytes->size - place);
    for (size_t back = 16; back >= 8; back -= 8) { /* where buffers begin, where the grid ends */
        uint64_t offset;
        memcpy(&offset, longer + last->offset - back, sizeof offset);
        offset += MORE;
        memcpy(longer + last->offset - back, &offset, sizeof offset);
    }
    vol_vdb_close(vdb);
    size_t size = bytes->size + MORE;
    vol_bytes_free(bytes);
    *bytes = (VolBytes){longer, size};
}

int main(int argc, char **argv)
{
    bool frustum = false;
    VolError err = {""};
    VolVdbWriter *writer = NULL;
    must(vol_vdb_writer_new(VOL_COMPRESS_BLOSC, &writer, &err), &err);
    Spec spec = {.name = "density", .type = "float", .field = "const:1", .dims = {2, 2, 2},
                 .map = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, 0}}}};
    for (int i = 1; i < argc; i++) {
        const char *option = argv[i];
        if (strcmp(option, "--sparse") == 0) {
            spec.sparse = true;
            continue;
        } else if (strcmp(option, "--empty") == 0) {
            spec.empty = true;
            continue;
        } else if (strcmp(option, "--frustum") == 0) {
            frustum = true;
            continue;
        } else if (strcmp(option, "--unfold") == 0) {
            spec.unfold = true;
            continue;
        } else if (strcmp(option, "--box") == 0) {
            spec.box = true;
            continue;
        } else if (strcmp(option, "--also") == 0) {
            put_grid(writer, &spec);
            continue;
        }
        const char *value = ++i < argc ? argv[i] : NULL;
        double n[12];
        if (!value)
            die("'%s' wants a value", option);
        if (strcmp(option, "--name") == 0)
            spec.name = value;
        else if (strcmp(option, "--type") == 0)
            spec.type = value;
        else if (strcmp(option, "--class") == 0)
            spec.grid_class = value;
        else if (strcmp(option, "--tile") == 0 && spec.tile_count < MAX_TILES)
            tile(value, spec.tiles[spec.tile_count++]);
        else if (strcmp(option, "--field") == 0)
            spec.field = value;
        else if (strcmp(option, "--text") == 0)
            set_text(writer, value);
        else if (strcmp(option, "--light") == 0)
            spec.light = value;
        else if (strcmp(option, "--dims") == 0)
            integers(value, spec.dims, option);
        else if (strcmp(option, "--origin") == 0)
            integers(value, spec.origin, option);
        else if (strcmp(option, "--background") == 0)
            numbers(value, &spec.background, 1, option);
        else if (strcmp(option, "--voxel") == 0) {
            numbers(value, n, 1, option);
            for (int a = 0; a < 3; a++)
                spec.map.m[a][a] = n[0];
        } else if (strcmp(option, "--map") == 0) {
            numbers(value, n, 12, option);
            memcpy(spec.map.m, n, sizeof n);
        } else if (strcmp(option, "--poke") == 0 && spec.poke_count < MAX_POKES)
            numbers(value, spec.pokes[spec.poke_count++], 4, option);
        else
            die("unknown option '%s'", option);
    }
    put_grid(writer, &spec);
    VolBytes bytes = {0};
    must(vol_vdb_finish(writer, &bytes, &err), &err);
    if (frustum)
        make_frustum(&bytes);
    if (fwrite(bytes.data, 1, bytes.size, stdout) != bytes.size || fflush(stdout))
        die("cannot write");
    vol_bytes_free(&bytes);
    vol_vdb_writer_free(writer);
    return 0;
}
