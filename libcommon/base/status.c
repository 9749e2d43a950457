#include "base/status.h"

#include <errno.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

static void replace_control_characters(char *text)
{
    for (unsigned char *c = (unsigned char *)text; *c; c++)
        if (*c < 0x20 || *c == 0x7f)
            *c = '?';
}

VolStatus vol_fail(VolError *err, VolStatus status, const char *format, ...)
{
    if (!err)
        return status;
    va_list args;
    va_start(args, format);
    vsnprintf(err->text, sizeof err->text, format, args);
    va_end(args);
    replace_control_characters(err->text);
    return status;
}

VolStatus vol_fail_errno(VolError *err, int errnum, const char *what, const char *subject)
{
    VolStatus status = errnum == ENOMEM ? VOL_NOMEM : VOL_IO;
    return vol_fail(err, status, "%s '%s': %s", what, subject, strerror(errnum));
}

VolStatus vol_fail_within(VolError *err, VolStatus status, const char *prefix_format, ...)
{
    if (!err)
        return status;
    VolError inner = *err;
    char prefix[512];
    va_list args;
    va_start(args, prefix_format);
    vsnprintf(prefix, sizeof prefix, prefix_format, args);
    va_end(args);
    return vol_fail(err, status, "%s: %.900s", prefix, inner.text);
}
