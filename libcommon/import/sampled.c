#include "import/sampled.h"

#include <errno.h>
#include <inttypes.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static const struct {
    const char *name;
    size_t size;
} samples[] = {
    [VOL_SAMPLE_U8] = {"u8", 1},   [VOL_SAMPLE_I8] = {"i8", 1},   [VOL_SAMPLE_U16] = {"u16", 2},
    [VOL_SAMPLE_I16] = {"i16", 2}, [VOL_SAMPLE_U32] = {"u32", 4}, [VOL_SAMPLE_I32] = {"i32", 4},
    [VOL_SAMPLE_U64] = {"u64", 8}, [VOL_SAMPLE_I64] = {"i64", 8}, [VOL_SAMPLE_F32] = {"f32", 4},
    [VOL_SAMPLE_F64] = {"f64", 8},
};

size_t vol_sample_size(VolSample type) { return samples[type].size; }

bool vol_sample_named(const char *name, VolSample *out)
{
    for (size_t i = 0; i < sizeof samples / sizeof *samples; i++)
        if (strcmp(samples[i].name, name) == 0)
            return *out = (VolSample)i, true;
    return false;
}

uint16_t vol_get_u16(const unsigned char *p, bool big_endian)
{
    return (uint16_t)(big_endian ? p[0] << 8 | p[1] : p[1] << 8 | p[0]);
}

uint32_t vol_get_u32(const unsigned char *p, bool big_endian)
{
    uint32_t first = vol_get_u16(p, big_endian), second = vol_get_u16(p + 2, big_endian);
    return big_endian ? first << 16 | second : second << 16 | first;
}

uint64_t vol_get_u64(const unsigned char *p, bool big_endian)
{
    uint64_t first = vol_get_u32(p, big_endian), second = vol_get_u32(p + 4, big_endian);
    return big_endian ? first << 32 | second : second << 32 | first;
}

float vol_get_f32(const unsigned char *p, bool big_endian)
{
    uint32_t bits = vol_get_u32(p, big_endian);
    float value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

double vol_get_f64(const unsigned char *p, bool big_endian)
{
    uint64_t bits = vol_get_u64(p, big_endian);
    double value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

void vol_sampled_order(VolSampled *image)
{
    /* Unsigned, since sizes that overflow are found only later, by vol_sampled_check. */
    uint64_t stride = (uint64_t)image->components;
    image->component_stride = 1;
    for (int a = 0; a < 3; a++) {
        image->stride[a] = (int64_t)stride;
        stride *= (uint64_t)image->dims[a];
    }
    image->time_stride = (int64_t)stride;
}

/* The product of positive factors; false if one is not positive or the product exceeds what we address. */
static bool positive_product(const int64_t *factors, size_t count, uint64_t *product)
{
    *product = 1;
    for (size_t i = 0; i < count; i++)
        if (factors[i] <= 0 || __builtin_mul_overflow(*product, (uint64_t)factors[i], product))
            return false;
    return *product <= (uint64_t)INT64_MAX / 64;
}

VolStatus vol_sampled_check(const VolSampled *image, const char *name, bool exact, VolError *err)
{
    const int64_t factors[5] = {image->dims[0], image->dims[1], image->dims[2], image->components,
                                image->times};
    const char *const what[5] = {"x", "y", "z", "components", "time steps"};
    uint64_t count;

    for (int i = 0; i < 5; i++)
        if (factors[i] < 1 || factors[i] > INT32_MAX)
            return vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': size %" PRId64 " (%s) is impossible", name,
                            factors[i], what[i]);
    if (!positive_product(factors, 5, &count))
        return vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': its sizes are too large", name);

    uint64_t wanted = count * vol_sample_size(image->type);
    uint64_t have = image->bytes.size > image->offset ? image->bytes.size - image->offset : 0;
    if (have < wanted || (exact && have != wanted))
        return vol_fail(
            err, VOL_BAD_INPUT,
            "cannot import '%s': %s: %" PRIu64 " samples of %s are %" PRIu64 " bytes, there are %" PRIu64, name,
            have < wanted ? "truncated" : "size does not match", count, samples[image->type].name, wanted, have);
    return VOL_OK;
}

/* What stands between the numbers of a text. */
static const char *const between = " \t\r\n\v\f,";

/* Whole numbers of 64 bits are more than a double holds: they are read as what they are. */
static bool scan_whole(const char *at, VolSample type, uint64_t *out, char **end)
{
    errno = 0;
    if (type == VOL_SAMPLE_U64 && *at != '-')
        *out = strtoull(at, end, 10);
    else if (type == VOL_SAMPLE_I64)
        *out = (uint64_t)strtoll(at, end, 10);
    else
        return false;
    return *end != at && !errno && (!**end || strchr(between, **end));
}

/* The number at `at` as a sample of the type in this machine's byte order; NULL, or what is wrong with it. */
static const char *scan_sample(const char *at, VolSample type, unsigned char *out, char **end)
{
    static const double least[] = {0, INT8_MIN, 0, INT16_MIN, 0, INT32_MIN, 0, (double)INT64_MIN};
    static const double limit[] = {UINT8_MAX + 1.0,  INT8_MAX + 1.0,       UINT16_MAX + 1.0,     INT16_MAX + 1.0,
                                   UINT32_MAX + 1.0, INT32_MAX + 1.0, 18446744073709551616.0, 9223372036854775808.0};
    uint64_t whole;
    if (!scan_whole(at, type, &whole, end)) {
        double value = strtod(at, end);
        if (*end == at || (**end && !strchr(between, **end)))
            return *at ? "no number" : "missing";
        if (type == VOL_SAMPLE_F32)
            return memcpy(out, &(float){(float)value}, sizeof(float)), NULL;
        if (type == VOL_SAMPLE_F64)
            return memcpy(out, &value, sizeof value), NULL;
        if (!(value >= least[type] && value < limit[type] && value == floor(value)))
            return "not of the type that the header gives";
        whole = value < 0 ? (uint64_t)(int64_t)value : (uint64_t)value;
    }
    switch (samples[type].size) {
    case 1: *out = (unsigned char)whole; break;
    case 2: memcpy(out, &(uint16_t){(uint16_t)whole}, 2); break;
    case 4: memcpy(out, &(uint32_t){(uint32_t)whole}, 4); break;
    default: memcpy(out, &whole, 8); break;
    }
    return NULL;
}

VolStatus vol_scan_samples(const unsigned char *data, size_t size, VolSample type, uint64_t count, const char *name,
                           VolBytes *out, VolError *err)
{
    /* Every sample takes at least one digit and one separator: refuse before allocating for a forged size. */
    if (count > size / 2 + size % 2)
        return vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': truncated: fewer numbers than its sizes say",
                        name);
    size_t each = vol_sample_size(type);
    char *text = vol_alloc(size + 1, 1);
    unsigned char *values = vol_alloc(count, each);
    VolStatus status = text && values ? VOL_OK : vol_fail_memory(err, size + count * each);
    if (!status) {
        memcpy(text, data, size);
        text[size] = 0;
    }
    char *at = text;
    for (uint64_t i = 0; !status && i < count; i++) {
        at += strspn(at, between);
        const char *wrong = scan_sample(at, type, values + i * each, &at);
        if (wrong)
            status = vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': sample %" PRIu64 " of %" PRIu64 " is %s",
                              name, i, count, wrong);
    }
    free(text);
    if (status)
        free(values);
    else
        *out = (VolBytes){values, count * each};
    return status;
}

bool vol_machine_is_big_endian(void)
{
    const uint16_t one = 1;
    return *(const unsigned char *)&one == 0;
}

VolStatus vol_sampled_from_text(VolSampled *image, const char *name, VolError *err)
{
    const int64_t factors[5] = {image->dims[0], image->dims[1], image->dims[2], image->components,
                                image->times};
    uint64_t count;
    VolBytes values = {0};
    if (!positive_product(factors, 5, &count) || image->offset > image->bytes.size)
        return vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': truncated: fewer numbers than its sizes say",
                        name);
    VolStatus status = vol_scan_samples(image->bytes.data + image->offset, image->bytes.size - image->offset,
                                        image->type, count, name, &values, err);
    if (status)
        return status;
    vol_bytes_free(&image->bytes);
    image->bytes = values;
    image->offset = 0;
    image->big_endian = vol_machine_is_big_endian();
    return VOL_OK;
}

void vol_sampled_free(VolSampled *image)
{
    vol_bytes_free(&image->bytes);
    *image = (VolSampled){0};
}
