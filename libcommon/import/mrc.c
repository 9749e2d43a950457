/* MRC and CCP4 maps (Cheng et al. 2015): a header of 1024 bytes, an extended header, the samples.
 *
 * Columns, rows and sections of the file run along the axes MAPC, MAPR and MAPS of a cell whose edges and angles
 * the header gives: a along x, b in the xy plane (the usual orthogonalisation).  World units are the header's,
 * Angstrom. Place: the ORIGIN words where any is not 0, else NSTART in steps of the cell. */
#include <inttypes.h>
#include <math.h>
#include <string.h>

#include "base/fmath.h"
#include "base/half.h"
#include "import/readers.h"

enum { HEADER = 1024 };

bool vol_is_mrc(const VolBytes *bytes) { return bytes->size >= 212 && memcmp(bytes->data + 208, "MAP", 3) == 0; }

static int32_t word(const unsigned char *p, int number, bool big)
{
    return (int32_t)vol_get_u32(p + 4 * (number - 1), big);
}

static double real_word(const unsigned char *p, int number, bool big)
{
    return (double)vol_get_f32(p + 4 * (number - 1), big);
}

/* The order in which MAPC is 1, 2 or 3; where it is neither, the machine stamp's; where that is none either, the one
 * in which the columns are fewer.  The stamp comes second, since programs that swap bytes forget it. */
static bool is_big_endian(const unsigned char *p)
{
    for (int big = 0; big < 2; big++)
        if (word(p, 17, big) >= 1 && word(p, 17, big) <= 3)
            return big;
    if (p[212] == 0x44 || p[212] == 0x11)
        return p[212] == 0x11;
    return vol_get_u32(p, true) < vol_get_u32(p, false);
}

/* IMOD's stamp, and the flags behind it. */
enum { IMOD_STAMP = 1146047817, IMOD_SIGNED = 1, IMOD_PACKED = 16 };

static bool imod_flags(const unsigned char *p, bool big, uint32_t *flags)
{
    *flags = vol_get_u32(p + 156, big);
    return vol_get_u32(p + 152, big) == IMOD_STAMP;
}

enum { MODE_HALF = 12, MODE_4BIT = 101 };

/* Bytes are signed, as the standard has it, unless IMOD says that its own are not.  Where it says that each holds two
 * samples, the columns are twice as many as the header says. */
static VolStatus read_bytes_mode(const unsigned char *p, const char *name, int32_t *mode, VolSampled *out, VolError *err)
{
    uint32_t flags;
    bool imod = imod_flags(p, out->big_endian, &flags), packed = imod && flags & IMOD_PACKED;
    if (packed && flags & IMOD_SIGNED)
        return vol_fail(err, VOL_BAD_INPUT,
                        "cannot import '%s': MRC mode 0 with two samples of 4 bits in signed bytes (IMOD's flags, byte "
                        "156): there are no such samples",
                        name);
    out->type = imod && !(flags & IMOD_SIGNED) ? VOL_SAMPLE_U8 : VOL_SAMPLE_I8;
    out->dims[0] *= packed ? 2 : 1;
    *mode = packed ? MODE_4BIT : 0;
    return VOL_OK;
}

/* Halves and 4-bit samples are unpacked later. */
static VolStatus read_mode(const unsigned char *p, const char *name, int32_t *mode_read, VolSampled *out, VolError *err)
{
    static const struct {
        int32_t mode;
        VolSample type;
        int components;
    } modes[] = {
        {1, VOL_SAMPLE_I16, 1}, {2, VOL_SAMPLE_F32, 1}, {3, VOL_SAMPLE_I16, 2},         {4, VOL_SAMPLE_F32, 2},
        {6, VOL_SAMPLE_U16, 1}, {16, VOL_SAMPLE_U8, 3}, {MODE_HALF, VOL_SAMPLE_U16, 1}, {MODE_4BIT, VOL_SAMPLE_U8, 1},
    };
    int32_t mode = word(p, 4, out->big_endian);
    out->components = 1;
    *mode_read = mode;
    if (mode == 0)
        return read_bytes_mode(p, name, mode_read, out, err);
    for (size_t i = 0; i < sizeof modes / sizeof *modes; i++)
        if (modes[i].mode == mode) {
            out->type = modes[i].type;
            out->components = modes[i].components;
            return VOL_OK;
        }
    return vol_fail(err, VOL_BAD_INPUT,
                    "cannot import '%s': MRC mode %" PRId32 " is not read (0, 1, 2, 3, 4, 6, 12, 16, 101 are)", name,
                    mode);
}

/* The samples unpacked to `type`, in this machine's order; the packed ones were found to be there. */
static VolStatus unpack(int32_t mode, VolSampled *out, VolError *err)
{
    size_t nx = (size_t)out->dims[0], rows = (size_t)out->dims[1] * (size_t)out->dims[2] * (size_t)out->times;
    size_t size = mode == MODE_HALF ? sizeof(float) : 1;
    unsigned char *to = vol_alloc(nx * rows, size);
    if (!to)
        return vol_fail_memory(err, nx * rows * size);
    const unsigned char *from = out->bytes.data + out->offset;
    for (size_t n = 0; mode == MODE_HALF && n < nx * rows; n++) {
        float value = vol_half_to_float(vol_get_u16(from + 2 * n, out->big_endian));
        memcpy(to + size * n, &value, size);
    }
    for (size_t row = 0; mode == MODE_4BIT && row < rows; row++)
        for (size_t i = 0; i < nx; i++) /* a row begins with a byte, the earlier sample is its low half */
            to[row * nx + i] = from[row * ((nx + 1) / 2) + i / 2] >> (i % 2 ? 4 : 0) & 15;
    vol_bytes_free(&out->bytes);
    const uint16_t one = 1;
    out->bytes = (VolBytes){to, nx * rows * size};
    out->offset = 0;
    out->big_endian = *(const unsigned char *)&one == 0;
    out->type = mode == MODE_HALF ? VOL_SAMPLE_F32 : VOL_SAMPLE_U8;
    return VOL_OK;
}

/* Edges of the cell as vectors of length 1; angles alpha (b, c), beta (a, c), gamma (a, b) in degrees.  Right angles
 * are exact, and stand for those that are not given (0).  False: no cell has such angles. */
static bool cell_directions(const unsigned char *p, bool big, VolVec3 edge[3])
{
    double cosine[3];
    for (int i = 0; i < 3; i++) {
        double degrees = real_word(p, 14 + i, big);
        if (!(degrees >= 0 && degrees < 180))
            return false;
        cosine[i] = degrees == 90 || degrees == 0 ? 0 : vol_cos(degrees * (3.14159265358979323846 / 180));
    }
    double sine = sqrt(1 - cosine[2] * cosine[2]);
    double y = (cosine[0] - cosine[1] * cosine[2]) / sine;
    double z = sqrt(1 - cosine[1] * cosine[1] - y * y);
    edge[0] = vol_vec3(1, 0, 0);
    edge[1] = vol_vec3(cosine[2], sine, 0);
    edge[2] = vol_vec3(cosine[1], y, z);
    return sine > 1e-6 && z > 1e-6;
}

/* The step along axis `along` (0 .. 2) of the cell: its length by its intervals, 1 where either is not given. */
static double cell_step(const unsigned char *p, bool big, int along, bool *made)
{
    double length = real_word(p, 11 + along, big);
    int32_t intervals = word(p, 8 + along, big);
    return vol_step_or_one(length > 0 && intervals > 0 ? length / intervals : 0, made);
}

/* MAPC, MAPR, MAPS as 0 .. 2; all 0 in files older than they are. */
static VolStatus read_axes(const unsigned char *p, bool big, const char *name, int axes[3], VolError *err)
{
    const int32_t map[3] = {word(p, 17, big), word(p, 18, big), word(p, 19, big)};
    bool unset = map[0] == 0 && map[1] == 0 && map[2] == 0, used[3] = {false, false, false};
    for (int a = 0; a < 3; a++) {
        int32_t along = unset ? a + 1 : map[a];
        if (along < 1 || along > 3 || used[along - 1])
            return vol_fail(err, VOL_BAD_INPUT,
                            "cannot import '%s': MAPC, MAPR, MAPS %" PRId32 " %" PRId32 " %" PRId32
                            " are no permutation of 1 2 3", name, map[0], map[1], map[2]);
        used[along - 1] = true;
        axes[a] = along - 1;
    }
    return VOL_OK;
}

static VolStatus read_affine(const unsigned char *p, const VolSource *source, VolSampled *out, VolError *err)
{
    bool big = out->big_endian;
    VolVec3 edge[3], place = {0};
    int axes[3];
    VolStatus status = read_axes(p, big, source->name, axes, err);
    if (status)
        return status;
    if (!cell_directions(p, big, edge)) {
        vol_warn(source->log, "'%s': no cell has the angles %g %g %g; right angles are taken", source->name,
                 real_word(p, 14, big), real_word(p, 15, big), real_word(p, 16, big));
        edge[0] = vol_vec3(1, 0, 0), edge[1] = vol_vec3(0, 1, 0), edge[2] = vol_vec3(0, 0, 1);
    }
    for (int a = 0; a < 3; a++) {
        VolVec3 step = vol_scale(edge[axes[a]], cell_step(p, big, axes[a], &out->spacing_made[a]));
        out->index_to_world.m[a][0] = step.x;
        out->index_to_world.m[a][1] = step.y;
        out->index_to_world.m[a][2] = step.z;
        place = vol_along(place, word(p, 5 + a, big), step);
    }
    VolVec3 origin = {real_word(p, 50, big), real_word(p, 51, big), real_word(p, 52, big)};
    if (origin.x != 0 || origin.y != 0 || origin.z != 0)
        place = origin;
    out->index_to_world.m[3][0] = place.x;
    out->index_to_world.m[3][1] = place.y;
    out->index_to_world.m[3][2] = place.z;
    return VOL_OK;
}

/* Space groups from 401 on say that the sections are those of several volumes, each as many as the cell has intervals. */
static VolStatus read_stack(const unsigned char *p, const char *name, VolSampled *out, VolError *err)
{
    int32_t group = word(p, 23, out->big_endian), sections = word(p, 10, out->big_endian);
    if (group < 401 || group > 630)
        return VOL_OK;
    if (sections < 1 || out->dims[2] % sections != 0)
        return vol_fail(err, VOL_BAD_INPUT,
                        "cannot import '%s': a stack of volumes of %" PRId32 " sections each (space group %" PRId32
                        "), but there are %" PRId64 " sections",
                        name, sections, group, out->dims[2]);
    out->times = out->dims[2] / sections;
    out->dims[2] = sections;
    return VOL_OK;
}

/* Rows of 4-bit samples are judged by their bytes. */
static VolStatus check_size(const VolSampled *image, int32_t mode, const char *name, VolError *err)
{
    VolSampled stored = *image;
    if (mode == MODE_4BIT && stored.dims[0] > 0)
        stored.dims[0] = (stored.dims[0] + 1) / 2;
    return vol_sampled_check(&stored, name, false, err);
}

VolStatus vol_read_mrc(const VolSource *source, VolSampled *out, VolError *err)
{
    const unsigned char *p = source->bytes->data;
    if (source->bytes->size < HEADER)
        return vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': truncated: the header is %d bytes, there are %zu",
                        source->name, HEADER, source->bytes->size);
    bool big = is_big_endian(p);
    int32_t extended = word(p, 24, big), mode = 0;
    if (extended < 0)
        return vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': an extended header of %" PRId32 " bytes",
                        source->name, extended);

    *out = (VolSampled){.big_endian = big, .times = 1, .offset = HEADER + (size_t)extended};
    for (int a = 0; a < 3; a++)
        out->dims[a] = word(p, 1 + a, big);
    VolStatus status = read_mode(p, source->name, &mode, out, err);
    if (!status && out->dims[2] > 0)
        status = read_stack(p, source->name, out, err);
    if (!status)
        status = read_affine(p, source, out, err);
    if (status)
        return status;
    vol_sampled_order(out);
    out->bytes = *source->bytes;
    *source->bytes = (VolBytes){0};
    status = check_size(out, mode, source->name, err);
    return !status && (mode == MODE_HALF || mode == MODE_4BIT) ? unpack(mode, out, err) : status;
}
