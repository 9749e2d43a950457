#include "base/status.h"

#include <errno.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "base/printable.h"

VolStatus vol_fail(VolError *err, VolStatus status, const char *format, ...)
{
    if (!err)
        return status;
    va_list args;
    char text[sizeof err->text];
    va_start(args, format);
    vsnprintf(text, sizeof text, format, args);
    va_end(args);
    vol_printable(err->text, sizeof err->text, text);
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
