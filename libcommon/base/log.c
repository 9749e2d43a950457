#include "base/log.h"

#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>

static void say(const VolLog *log, VolSeverity severity, const char *format, va_list args)
{
    if (!log || !log->say)
        return;
    char line[1024];
    vsnprintf(line, sizeof line, format, args);
    log->say(log->user, severity, line);
}

void vol_warn(const VolLog *log, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    say(log, VOL_WARNING, format, args);
    va_end(args);
}

void vol_note(const VolLog *log, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    say(log, VOL_NOTE, format, args);
    va_end(args);
}
