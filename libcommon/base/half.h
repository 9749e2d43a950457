/* IEEE 754 half precision. */
#ifndef VOL_BASE_HALF_H
#define VOL_BASE_HALF_H

#include <stdint.h>
#include <string.h>

/* Exact. */
static inline float vol_half_to_float(uint16_t half)
{
    uint32_t sign = (uint32_t)(half & 0x8000u) << 16, rest = half & 0x7fffu, bits;
    float value;
    if (rest >= 0x7c00u) { /* infinite or NaN */
        bits = sign | 0x7f800000u | (rest & 0x3ffu) << 13;
    } else {
        float magnitude; /* the exponent's bias is 15 here, 127 there: right for subnormal numbers too */
        bits = rest << 13;
        memcpy(&magnitude, &bits, sizeof magnitude);
        magnitude *= 0x1p112f;
        memcpy(&bits, &magnitude, sizeof bits);
        bits |= sign;
    }
    memcpy(&value, &bits, sizeof value);
    return value;
}

#endif
