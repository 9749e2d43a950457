/* An image as a foreign file holds it: samples of any type, order and byte order, described but not yet converted.
 * Every reader of this folder ends in one of these; convert.c turns it into voxels. */
#ifndef VOL_IMPORT_SAMPLED_H
#define VOL_IMPORT_SAMPLED_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/mem.h"
#include "base/status.h"
#include "base/vec.h"

typedef enum VolSample {
    VOL_SAMPLE_U8, VOL_SAMPLE_I8, VOL_SAMPLE_U16, VOL_SAMPLE_I16, VOL_SAMPLE_U32, VOL_SAMPLE_I32, VOL_SAMPLE_U64,
    VOL_SAMPLE_I64, VOL_SAMPLE_F32, VOL_SAMPLE_F64
} VolSample;

size_t vol_sample_size(VolSample type);
/* "u8", "i8", "u16", ... ; false: no such type */
bool vol_sample_named(const char *name, VolSample *out);

/* Sample (i, j, k) of component c at time t lies at offset + size (i stride[0] + j stride[1] + k stride[2] +
 * c component_stride + t time_stride) in `bytes`; its value is slope sample + intercept. */
typedef struct VolSampled {
    VolBytes bytes; /* owned */
    size_t offset;
    VolSample type;
    bool big_endian;
    int64_t dims[3];
    int64_t components, times;
    int64_t stride[3], component_stride, time_stride; /* in samples */
    bool scaled;             /* slope and intercept are to be applied */
    double slope, intercept;
    bool float_holds;        /* a float suffices for the values, whatever `type` is */
    VolAffine index_to_world; /* m[a] is 0 0 0 where the file gives axis a no spacing */
    double lengths[3];        /* of the axes whose m[a] is 0 0 0, if the file gives them; else 0 */
    bool spacing_made[3];     /* the file gives axis a a direction, but no spacing: m[a] has length 1 */
} VolSampled;

/* The step itself, or 1 where it is 0 or not finite; *made tells which.  For readers that know the direction. */
double vol_step_or_one(double step, bool *made);

/* Strides for the usual order: component fastest, then x, y, z, time. */
void vol_sampled_order(VolSampled *image);

/* Whether dimensions are positive, fit, and all samples lie within the bytes; VOL_BAD_INPUT says how many bytes
 * are missing.  With `exact`, bytes left over are an error too. */
VolStatus vol_sampled_check(const VolSampled *image, const char *name, bool exact, VolError *err);

/* Text samples (white space or commas between) to samples of the image's type in `image->bytes`, in this machine's
 * byte order, for the text encodings.  What the type does not hold is refused. */
VolStatus vol_sampled_from_text(VolSampled *image, const char *name, VolError *err);
/* The same for `count` samples of a part of a text. */
VolStatus vol_scan_samples(const unsigned char *data, size_t size, VolSample type, uint64_t count, const char *name,
                           VolBytes *out, VolError *err);
bool vol_machine_is_big_endian(void);

void vol_sampled_free(VolSampled *image);

/* ---- Little helpers of the readers ---- */

uint16_t vol_get_u16(const unsigned char *p, bool big_endian);
uint32_t vol_get_u32(const unsigned char *p, bool big_endian);
uint64_t vol_get_u64(const unsigned char *p, bool big_endian);
float vol_get_f32(const unsigned char *p, bool big_endian);
double vol_get_f64(const unsigned char *p, bool big_endian);

/* The bytes of a zlib or gzip stream (several gzip members one after the other are one stream).  Trailing bytes
 * that are no gzip member are left.  VOL_BAD_INPUT where the stream is damaged or ends early. */
VolStatus vol_gunzip(const unsigned char *data, size_t size, const char *name, VolBytes *out, VolError *err);
/* The same of a deflate stream alone. */
VolStatus vol_inflate(const unsigned char *data, size_t size, const char *name, VolBytes *out, VolError *err);
size_t vol_gunzip_head(const VolBytes *bytes, unsigned char *out, size_t room); /* how much was unpacked, 0: none */

/* The same for bzip2. */
VolStatus vol_bunzip2(const unsigned char *data, size_t size, const char *name, VolBytes *out, VolError *err);
size_t vol_bunzip2_head(const VolBytes *bytes, unsigned char *out, size_t room);

/* vol_bytes_append for data of a size that only unpacking tells: what needs more memory than there is is refused
 * before it is taken. */
VolStatus vol_append_unpacked(VolBytes *bytes, size_t *capacity, const void *data, size_t size, const char *name,
                              VolError *err);

/* Files that are packed as a whole, told by their first bytes. */
bool vol_is_packed(const VolBytes *bytes);
size_t vol_unpack_head(const VolBytes *bytes, unsigned char *out, size_t room);
VolStatus vol_unpack(VolBytes *bytes, const char *name, VolError *err); /* in place; nothing if not packed */

#endif
