#include "import/vtk_words.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

bool vol_vtk_space(unsigned char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }

bool vol_vtk_number(const char *text, VolSample type, uint64_t *bits)
{
    char *end;
    *bits = 0;
    errno = 0;
    if (type == VOL_SAMPLE_F32) {
        float value = strtof(text, &end);
        uint32_t word;
        memcpy(&word, &value, sizeof word);
        *bits = word;
    } else if (type == VOL_SAMPLE_F64) {
        double value = strtod(text, &end);
        memcpy(bits, &value, sizeof value);
    } else if (type == VOL_SAMPLE_U64) {
        *bits = strtoull(text, &end, 10);
        if (errno == ERANGE)
            return false;
    } else if (type == VOL_SAMPLE_I64) {
        *bits = (uint64_t)strtoll(text, &end, 10);
        if (errno == ERANGE)
            return false;
    } else {
        bool wide = type == VOL_SAMPLE_U16 || type == VOL_SAMPLE_U32 || vol_sample_size(type) == 1;
        long long value = strtoll(text, &end, 10), half = 1ll << (8 * vol_sample_size(type) - 1);
        if (value < -half || value >= (wide ? 2 * half : half))
            return false;
        *bits = (uint64_t)value;
    }
    return end > text && !*end;
}

void vol_vtk_put(unsigned char *out, uint64_t bits, size_t size, bool big_endian)
{
    for (size_t i = 0; i < size; i++)
        out[i] = (unsigned char)(bits >> 8 * (big_endian ? size - 1 - i : i));
}

/* From the end, so that no bits are overwritten before they were looked at. */
void vol_vtk_spread_bits(unsigned char *bytes, size_t count)
{
    for (size_t n = count; n-- > 0;)
        bytes[n] = bytes[n / 8] >> (7 - n % 8) & 1;
}

bool vol_vtk_word(const VolBytes *bytes, size_t *at, char *word, size_t size)
{
    size_t n = 0;
    while (*at < bytes->size && vol_vtk_space(bytes->data[*at]))
        ++*at;
    bool found = *at < bytes->size;
    for (; *at < bytes->size && !vol_vtk_space(bytes->data[*at]); ++*at)
        if (n + 1 < size)
            word[n++] = (char)bytes->data[*at];
    word[n] = 0;
    return found;
}
