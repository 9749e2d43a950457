#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "base/printable.h"
#include "cmd/shell/shell.h"

void shell_say(const char *program, const char *severity, const char *text)
{
    char text_only[1400], line[1500];
    const char *clear = shell_progress_clear();
    size_t prefix = strlen(clear);
    memcpy(line, clear, prefix);
    snprintf(text_only, sizeof text_only, "%s: %s: %s", program, severity, text);
    size_t length = prefix + vol_printable(line + prefix, sizeof line - prefix - 1, text_only);
    line[length++] = '\n';
    if (write(STDERR_FILENO, line, length) < 0)
        return; /* nobody is left to be told */
}
