#include <inttypes.h>
#include <stdio.h>
#include <string.h>

#include "cli/words.h"

static void add_number(VolText *text, int64_t frame, int digits)
{
    char number[80];
    snprintf(number, sizeof number, "%0*" PRId64, digits, frame);
    vol_text_add(text, number);
}

/* Length of a %d or %0Nd at `at` (N up to 20), 0 where there is none. */
static size_t percent_form(const char *at, int *digits)
{
    const char *p = at + 1;
    *digits = 1;
    if (*p == '0') {
        for (*digits = 0, p++; *p >= '0' && *p <= '9' && *digits <= 20; p++)
            *digits = *digits * 10 + (*p - '0');
        if (*digits < 1 || *digits > 20)
            return 0;
    }
    return *p == 'd' ? (size_t)(p + 1 - at) : 0;
}

VolStatus vol_fill_frame(const char *pattern, int64_t frame, char **out, VolError *err)
{
    VolText text = {0};
    for (const char *p = pattern; *p;) {
        size_t hashes = strspn(p, "#"), form;
        int digits;
        if (hashes == 1 || hashes > 20) {
            vol_bytes_free(&text.bytes);
            return vol_fail(err, VOL_USAGE, "cannot fill in the frame in '%s': %s", pattern,
                            hashes == 1 ? "a single # is ambiguous: 1 or 4 digits? (use %d, %04d or ####)"
                                        : "more than 20 digits");
        }
        if (hashes) {
            add_number(&text, frame, (int)hashes);
            p += hashes;
        } else if (*p == '%' && (form = percent_form(p, &digits))) {
            add_number(&text, frame, digits);
            p += form;
        } else {
            char one[2] = {*p++, 0};
            if (*one == '%' && *p == '%') /* as printf has it */
                p++;
            vol_text_add(&text, one);
        }
    }
    *out = vol_text_end(&text);
    return *out ? VOL_OK : vol_fail_memory(err, strlen(pattern));
}
