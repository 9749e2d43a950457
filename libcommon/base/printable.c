#include "base/printable.h"

#include <stdbool.h>
#include <stdint.h>
#include <string.h>

/* Bytes of the UTF-8 character at `text` that can be shown; 0: there is none. */
static size_t shown_character(const unsigned char *text)
{
    unsigned char first = text[0];
    size_t length = first < 0x80 ? 1 : first < 0xc2 ? 0 : first < 0xe0 ? 2 : first < 0xf0 ? 3 : first < 0xf5 ? 4 : 0;
    if (length <= 1)
        return first >= 0x20 && first != 0x7f ? length : 0;
    uint32_t code = first & (0x7fu >> length);
    for (size_t n = 1; n < length; n++) {
        if ((text[n] & 0xc0) != 0x80)
            return 0;
        code = code << 6 | (text[n] & 0x3f);
    }
    const bool too_long = (length == 3 && code < 0x800) || (length == 4 && code < 0x10000);
    const bool control = code < 0xa0, surrogate = code >= 0xd800 && code <= 0xdfff;
    return too_long || control || surrogate || code > 0x10ffff ? 0 : length;
}

size_t vol_printable(char *to, size_t room, const char *from)
{
    static const char digits[] = "0123456789abcdef";
    const unsigned char *at = (const unsigned char *)from;
    size_t used = 0;
    while (*at) {
        size_t length = shown_character(at);
        char escaped[4] = {'\\', 'x', digits[*at >> 4], digits[*at & 15]};
        size_t wanted = length ? length : sizeof escaped;
        if (used + wanted >= room)
            break;
        memcpy(to + used, length ? (const char *)at : escaped, wanted);
        used += wanted;
        at += length ? length : 1;
    }
    to[used] = '\0';
    return used;
}
