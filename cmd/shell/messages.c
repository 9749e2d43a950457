#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "cmd/shell/shell.h"

void shell_say(const char *program, const char *severity, const char *text)
{
    char line[1400];
    const char *clear = shell_progress_clear();
    size_t prefix = strlen(clear);
    memcpy(line, clear, prefix);
    int n = snprintf(line + prefix, sizeof line - prefix - 1, "%s: %s: %s", program, severity, text);
    size_t length = prefix + (size_t)n;
    if (n < 0 || length > sizeof line - 2)
        length = sizeof line - 2;
    for (size_t i = prefix; i < length; i++)
        if ((unsigned char)line[i] < 0x20 || line[i] == 0x7f)
            line[i] = '?';
    line[length++] = '\n';
    if (write(STDERR_FILENO, line, length) < 0)
        return; /* nobody is left to be told */
}
