/* Formats of volumes and meshes that are known here but not read, and what else files may be. */
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "import/readers.h"
#include "io/in.h"

enum { LOOKED_AT = 1 << 20 }; /* names of a header lie in the first bytes */

static bool has(const VolBytes *bytes, size_t at, const char *text, size_t size)
{
    return at <= bytes->size && bytes->size - at >= size && memcmp(bytes->data + at, text, size) == 0;
}

static bool mentions(const VolBytes *bytes, const char *text)
{
    size_t end = bytes->size < LOOKED_AT ? bytes->size : LOOKED_AT;
    for (size_t at = 0; at < end; at++)
        if (bytes->data[at] == (unsigned char)text[0] && has(bytes, at, text, strlen(text)))
            return true;
    return false;
}

/* ---- PLOT3D ---- */

/* How PLOT3D files may be written: they have no magic number, but their size follows from their first numbers. */
typedef struct Plot3d {
    bool big, records, many; /* records: Fortran's, each between two counts of its bytes; many: blocks */
} Plot3d;

/* The points of every block, all added; 0: these are no sizes of blocks. */
static uint64_t add_points(const VolBytes *bytes, Plot3d how, uint64_t *blocks)
{
    size_t mark = how.records ? 4 : 0, at = mark;
    *blocks = 1;
    if (bytes->size < 64)
        return 0;
    if (how.many) {
        *blocks = vol_get_u32(bytes->data + at, how.big);
        if (how.records && (vol_get_u32(bytes->data, how.big) != 4 || vol_get_u32(bytes->data + 8, how.big) != 4))
            return 0;
        at += 4 + 2 * mark;
    }
    if (*blocks < 1 || *blocks > 100000 || bytes->size < at + 12 * *blocks + mark)
        return 0;
    if (how.records && (vol_get_u32(bytes->data + at - 4, how.big) != 12 * *blocks ||
                        vol_get_u32(bytes->data + at + 12 * *blocks, how.big) != 12 * *blocks))
        return 0;
    uint64_t sum = 0;
    for (uint64_t block = 0; block < *blocks; block++) {
        uint64_t points = 1;
        for (int a = 0; a < 3; a++, at += 4) {
            uint32_t n = vol_get_u32(bytes->data + at, how.big);
            if (n < 1 || n > 65536)
                return 0;
            points *= n;
        }
        sum += points;
    }
    return sum;
}

/* As many bytes as that, or, of large files, a few more. */
static bool is_size(const VolBytes *bytes, uint64_t wanted, uint64_t points)
{
    return bytes->size >= wanted && bytes->size - wanted <= (points >= 4096 ? 1024 : 0);
}

/* A grid has three coordinates a point, perhaps with a mark for blank ones; a solution four numbers a block and
 * five a point: floats or doubles. */
static bool is_plot3d_as(const VolBytes *bytes, Plot3d how)
{
    uint64_t blocks, points = add_points(bytes, how, &blocks), marks = how.records ? 8 : 0;
    if (points < 8)
        return false;
    uint64_t head = 12 * blocks + marks + (how.many ? 4 + marks : 0);
    for (uint64_t size = 4; size <= 8; size += 4)
        if (is_size(bytes, head + blocks * marks + 3 * size * points, points) ||
            is_size(bytes, head + blocks * marks + (3 * size + 4) * points, points) ||
            is_size(bytes, head + blocks * (2 * marks + 4 * size) + 5 * size * points, points))
            return true;
    return false;
}

static bool is_plot3d(const VolBytes *bytes)
{
    for (int n = 0; n < 8; n++)
        if (is_plot3d_as(bytes, (Plot3d){n & 1, n & 2, n & 4}))
            return true;
    return false;
}

/* ---- The others ---- */

static bool is_hdf5(const VolBytes *bytes)
{
    static const char magic[] = "\x89HDF\r\n\x1a\n";
    bool found = has(bytes, 0, magic, 8);
    for (size_t at = 512; !found && at < bytes->size && at <= LOOKED_AT;
         at *= 2) /* behind what users put before it */
        found = has(bytes, at, magic, 8);
    return found;
}

/* FORMAT, then "type:  ensight gold", comments and empty lines left aside. */
static bool is_ensight_case(const VolBytes *bytes)
{
    VolBytes head = {bytes->data, bytes->size < 4096 ? bytes->size : 4096};
    bool format = false, found = false, over = false;
    for (size_t at = 0; !over;) {
        char *line;
        over = vol_next_line(&head, &at, &line, NULL) || !line;
        char *text = over ? NULL : vol_trim(line);
        if (text && text[0] && text[0] != '#') {
            found = format && strncasecmp(text, "type:", 5) == 0 && strstr(text, "ensight");
            over = format || strcasecmp(text, "FORMAT") != 0;
            format = true;
        }
        free(line);
    }
    return found;
}

static const char *by_name(const char *name)
{
    static const struct {
        const char *ending, *what;
    } endings[] = {{".xyz", "its name says PLOT3D"},   {".q", "its name says PLOT3D"},
                   {".p3d", "its name says PLOT3D"},   {".exo", "its name says Exodus"},
                   {".ex2", "its name says Exodus"},   {".case", "its name says EnSight"},
                   {".vtkhdf", "its name says VTKHDF"}};
    size_t length = name ? strlen(name) : 0;
    for (size_t i = 0; i < sizeof endings / sizeof *endings; i++) {
        size_t n = strlen(endings[i].ending);
        if (length > n && strcasecmp(name + length - n, endings[i].ending) == 0)
            return endings[i].what;
    }
    return NULL;
}

const char *vol_import_unread(const VolBytes *bytes, const char *name)
{
    static const char fortran[] = "Fortran Binary", c[] = "C Binary";
    bool hdf5 = is_hdf5(bytes);
    if (hdf5 && mentions(bytes, "VTKHDF"))
        return "it is a VTKHDF file (HDF5)";
    if (hdf5 || has(bytes, 0, "CDF\1", 4) || has(bytes, 0, "CDF\2", 4) || has(bytes, 0, "CDF\5", 4)) {
        /* Every Exodus file has a dimension of this name. */
        if (mentions(bytes, "num_nodes") || mentions(bytes, "num_dim"))
            return hdf5 ? "it is an Exodus mesh (netCDF in HDF5)" : "it is an Exodus mesh (netCDF)";
        return hdf5 ? "it is HDF5 (as are netCDF 4 and VTKHDF)" : "it is netCDF (as are Exodus meshes)";
    }
    if (is_ensight_case(bytes))
        return "it is an EnSight case file";
    if (has(bytes, 0, c, strlen(c)) || has(bytes, 4, fortran, strlen(fortran)))
        return "it is an EnSight geometry file";
    if (is_plot3d(bytes))
        return "it is laid out as PLOT3D";
    return by_name(name);
}

/* ---- What is no volume ---- */

static const char not_read[] = ": vol-import does not read it in this version",
                  unpack_it[] = ": unpack it first",
                  raw_file[] = ": import the raw file that it names by vol-import --dims X,Y,Z --type TYPE";

static VolForeign by_magic(const VolBytes *bytes)
{
    static const struct {
        const char *magic;
        size_t size;
        VolForeign is;
    } kinds[] = {
        {"\x89PNG\r\n\x1a\n", 8, {"it is a PNG image", ""}},
        {"\xff\xd8\xff", 3, {"it is a JPEG image", ""}},
        {"\0\0\0\x0cjP  ", 8, {"it is a JPEG 2000 image", ""}},
        {"II*", 4, {"it is a TIFF image", ""}},
        {"MM\0*", 4, {"it is a TIFF image", ""}},
        {"GIF8", 4, {"it is a GIF image", ""}},
        {"#?RADIANCE", 10, {"it is a Radiance image", ""}},
        {"%PDF-", 5, {"it is a PDF document", ""}},
        {"\xfd""7zXZ", 6, {"it is packed by xz", ": unpack it first (xz -d)"}},
        {"\x28\xb5\x2f\xfd", 4, {"it is packed by zstd", ": unpack it first (zstd -d)"}},
        {"\x04\x22\x4d\x18", 4, {"it is packed by lz4", ": unpack it first (lz4 -d)"}},
        {"PK\3\4", 4, {"it is a ZIP archive", unpack_it}},
        {"7z\xbc\xaf\x27\x1c", 6, {"it is a 7z archive", unpack_it}},
        {"NanoVDB", 7, {"it is NanoVDB", ": nanovdb_convert makes a VDB of it"}},
    };
    for (size_t i = 0; i < sizeof kinds / sizeof *kinds; i++)
        if (has(bytes, 0, kinds[i].magic, kinds[i].size))
            return kinds[i].is;
    if (has(bytes, 257, "ustar", 5))
        return (VolForeign){"it is a tar archive", unpack_it};
    if (has(bytes, 0, "<", 1) && mentions(bytes, "<VoreenData") && mentions(bytes, "<Volumes"))
        return (VolForeign){"it describes a volume (.vvd)", raw_file};
    return (VolForeign){NULL, ""};
}

VolForeign vol_import_foreign(const VolBytes *bytes, const char *name)
{
    unsigned char head[1 << 16]; /* comments may come before what tells */
    VolBytes seen = *bytes;
    if (vol_is_packed(bytes))
        seen = (VolBytes){head, vol_unpack_head(bytes, head, sizeof head)};
    const char *mesh = seen.size ? vol_vtk_mesh(&seen) : NULL;
    if (mesh)
        return (VolForeign){mesh, not_read, true};
    VolForeign other = by_magic(&seen);
    const char *unread = other.what ? NULL : vol_import_unread(&seen, name);
    return unread ? (VolForeign){unread, not_read, true} : other;
}

/* Whether what begins with a bracket is text. */
static bool is_text(const VolBytes *bytes)
{
    for (size_t i = 0; i < bytes->size && i < 256; i++)
        if (bytes->data[i] < 32 && !strchr("\t\n\r", bytes->data[i]))
            return false;
    return true;
}

VolStatus vol_refuse_unread(const VolBytes *bytes, const char *name, VolError *err)
{
    VolKind kind = vol_kind(bytes);
    VolForeign is = vol_import_foreign(bytes, name);
    if (kind == VOL_KIND_VDB)
        return vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': it is VDB already", name);
    if (kind == VOL_KIND_EXR)
        return vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': it is an EXR image, no volume (vol-info describes it)",
                        name);
    if (kind == VOL_KIND_JSON && is_text(bytes))
        return vol_fail(err, VOL_BAD_INPUT,
                        "cannot import '%s': it is JSON, no volume; transfer functions go to vol-render -t and tf-preint",
                        name);
    if (is.mesh)
        return vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': %s, which is not read in this version", name, is.what);
    if (is.what)
        return vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': %s%s", name, is.what,
                        is.advice[0] ? is.advice : ", no volume");
    return vol_fail(
        err, VOL_BAD_INPUT,
        "cannot import '%s': unknown format (tried NIfTI, NRRD, MetaImage, .vti, legacy .vtk, MRC, DICOM, "
        "Inviwo .dat; raw samples need --dims and --type)",
        name);
}
