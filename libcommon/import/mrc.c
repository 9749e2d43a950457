/* MRC and CCP4 maps (Cheng et al. 2015): a header of 1024 bytes, an extended header, the samples.
 *
 * Columns, rows and sections of the file run along the axes MAPC, MAPR and MAPS of a cell whose edges and angles
 * the header gives: a along x, b in the xy plane (the usual orthogonalisation).  World units are the header's,
 * Angstrom. Place: the ORIGIN words where any is not 0, else NSTART in steps of the cell. */
#include <inttypes.h>
#include <math.h>
#include <string.h>

#include "base/fmath.h"
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

/* The machine stamp where it is sound, else the order in which MAPC, MAPR, MAPS are small. */
static bool is_big_endian(const unsigned char *p)
{
    if (p[212] == 0x44)
        return false;
    if (p[212] == 0x11)
        return true;
    uint32_t mapc = vol_get_u32(p + 64, true);
    return mapc >= 1 && mapc <= 3;
}

static VolStatus read_mode(int32_t mode, const char *name, VolSample *type, VolError *err)
{
    switch (mode) {
    case 0: *type = VOL_SAMPLE_I8; return VOL_OK;
    case 1: *type = VOL_SAMPLE_I16; return VOL_OK;
    case 2: *type = VOL_SAMPLE_F32; return VOL_OK;
    case 6: *type = VOL_SAMPLE_U16; return VOL_OK;
    default:
        return vol_fail(err, VOL_BAD_INPUT,
                        "cannot import '%s': MRC mode %" PRId32 " is not read (0, 1, 2, 6 are)", name, mode);
    }
}

/* Edges of the cell as vectors; angles alpha (b, c), beta (a, c), gamma (a, b) in degrees.  Right angles are
 * exact. */
static void cell_edges(const unsigned char *p, bool big, VolVec3 edge[3])
{
    double cosine[3], length[3];
    for (int i = 0; i < 3; i++) {
        double degrees = real_word(p, 14 + i, big);
        length[i] = real_word(p, 11 + i, big);
        cosine[i] = degrees == 90 || degrees == 0 ? 0 : vol_cos(degrees * (3.14159265358979323846 / 180));
    }
    double sine = sqrt(1 - cosine[2] * cosine[2]);
    double y = (cosine[0] - cosine[1] * cosine[2]) / sine;
    edge[0] = vol_vec3(length[0], 0, 0);
    edge[1] = vol_vec3(length[1] * cosine[2], length[1] * sine, 0);
    edge[2] = vol_vec3(length[2] * cosine[1], length[2] * y, length[2] * sqrt(1 - cosine[1] * cosine[1] - y * y));
}

static VolStatus read_affine(const unsigned char *p, bool big, const char *name, VolAffine *out, VolError *err)
{
    VolVec3 edge[3], place = {0};
    bool used[3] = {false, false, false};
    cell_edges(p, big, edge);
    *out = (VolAffine){0};
    for (int a = 0; a < 3; a++) {
        int32_t along = word(p, 17 + a, big);
        if (along < 1 || along > 3 || used[along - 1])
            return vol_fail(err, VOL_BAD_INPUT,
                            "cannot import '%s': MAPC, MAPR, MAPS %" PRId32 " %" PRId32 " %" PRId32
                            " are no permutation of 1 2 3", name, word(p, 17, big), word(p, 18, big),
                            word(p, 19, big));
        used[along - 1] = true;
        int32_t samples = word(p, 7 + along, big);
        VolVec3 step = samples > 0 ? vol_scale(edge[along - 1], 1.0 / samples) : (VolVec3){0};
        out->m[a][0] = step.x;
        out->m[a][1] = step.y;
        out->m[a][2] = step.z;
        place = vol_along(place, word(p, 5 + a, big), step);
    }
    VolVec3 origin = {real_word(p, 50, big), real_word(p, 51, big), real_word(p, 52, big)};
    if (origin.x != 0 || origin.y != 0 || origin.z != 0)
        place = origin;
    out->m[3][0] = place.x;
    out->m[3][1] = place.y;
    out->m[3][2] = place.z;
    return VOL_OK;
}

VolStatus vol_read_mrc(const VolSource *source, VolSampled *out, VolError *err)
{
    const unsigned char *p = source->bytes->data;
    if (source->bytes->size < HEADER)
        return vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': truncated: the header is %d bytes, there are %zu",
                        source->name, HEADER, source->bytes->size);
    bool big = is_big_endian(p);
    int32_t extended = word(p, 24, big);
    if (extended < 0)
        return vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': an extended header of %" PRId32 " bytes",
                        source->name, extended);

    *out = (VolSampled){.big_endian = big, .components = 1, .times = 1, .offset = HEADER + (size_t)extended};
    VolStatus status = read_mode(word(p, 4, big), source->name, &out->type, err);
    for (int a = 0; a < 3; a++)
        out->dims[a] = word(p, 1 + a, big);
    if (!status)
        status = read_affine(p, big, source->name, &out->index_to_world, err);
    if (status)
        return status;
    vol_sampled_order(out);
    out->bytes = *source->bytes;
    *source->bytes = (VolBytes){0};
    return vol_sampled_check(out, source->name, false, err);
}
