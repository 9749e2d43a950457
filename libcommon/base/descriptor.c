#include "base/descriptor.h"

#include <ctype.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static bool in_names(char c) { return isalnum((unsigned char)c) || c == '_' || c == '.' || c == '-' || c == '/'; }

/* "/", "//" and "/./" are the same; NULL where there is no slash. */
static const char *skip_slashes(const char *at)
{
    if (*at != '/')
        return NULL;
    while (*at == '/' || (at[0] == '.' && at[1] == '/'))
        at++;
    return at;
}

/* Behind "/word", where the word ends there; else NULL. */
static const char *skip_word(const char *at, const char *word)
{
    size_t length = strlen(word);
    at = at ? skip_slashes(at) : NULL;
    return at && !strncmp(at, word, length) && (at[length] == '/' || !in_names(at[length])) ? at + length : NULL;
}

static const char *skip_number(const char *at, long *number)
{
    at = at ? skip_slashes(at) : NULL;
    if (!at || !isdigit((unsigned char)*at))
        return NULL;
    char *end;
    *number = strtol(at, &end, 10);
    return *end == '/' || !in_names(*end) ? end : NULL;
}

/* /proc/self, /proc/thread-self, /proc/PID, and with /task/TID behind them. */
static const char *skip_process(const char *at, bool *ours)
{
    long pid = 0, task;
    const char *proc = skip_word(at, "proc"), *end = skip_word(proc, "self");
    *ours = true;
    if (!end)
        end = skip_word(proc, "thread-self");
    if (!end) {
        end = skip_number(proc, &pid);
        *ours = pid == (long)getpid();
    }
    const char *behind = skip_number(skip_word(end, "task"), &task);
    return behind ? behind : end;
}

size_t vol_descriptor_name(const char *text, int *fd)
{
    static const char *const standard[] = {"stdin", "stdout", "stderr"};
    const char *dev = skip_word(text, "dev"), *end = NULL;
    bool ours = true;
    long number = -1;
    for (int i = 0; i < 3 && !end; i++)
        if ((end = skip_word(dev, standard[i])))
            number = i;
    if (!end)
        end = skip_number(skip_word(dev, "fd"), &number);
    if (!end)
        end = skip_number(skip_word(skip_process(text, &ours), "fd"), &number);
    if (!end || *end == '/')
        return 0;
    if (fd)
        *fd = ours && number <= 1 << 20 ? (int)number : -1;
    return (size_t)(end - text);
}
