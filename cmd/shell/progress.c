#include <stdio.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "cmd/shell/shell.h"

static struct {
    const char *program;
    ShellProgress kind;
    double started, drawn; /* seconds; drawn: the last time, 0 never */
    bool visible;          /* a line without an end stands on the terminal */
    bool finished;         /* 100 % has been said */
} progress;

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

void shell_progress_begin(const char *program, int mode, bool quiet, bool fake_terminal)
{
    bool terminal = fake_terminal || isatty(STDERR_FILENO);
    bool foreground = fake_terminal || (terminal && tcgetpgrp(STDERR_FILENO) == getpgrp());
    progress.program = program;
    progress.started = now();
    if (mode == 1)
        progress.kind = terminal ? SHELL_PROGRESS_TERMINAL : SHELL_PROGRESS_LINES;
    else if (mode == 0 && !quiet && foreground)
        progress.kind = SHELL_PROGRESS_TERMINAL;
    else
        progress.kind = SHELL_PROGRESS_OFF;
}

void shell_progress_draw(double fraction)
{
    if (progress.kind == SHELL_PROGRESS_OFF || progress.finished)
        return;
    bool terminal = progress.kind == SHELL_PROGRESS_TERMINAL, last = fraction >= 1;
    double time = now(), pause = terminal ? 0.25 : 10;
    if (!last && time - (progress.drawn > 0 ? progress.drawn : progress.started) < pause)
        return;
    char line[160];
    double percent = 100 * (fraction > 0 ? fraction < 1 ? fraction : 1 : 0);
    int length = snprintf(line, sizeof line, "%s%.40s: progress %5.1f%%  %.1fs%s", terminal ? "\r" : "",
                          progress.program, percent, time - progress.started, terminal ? "\033[K" : "\n");
    progress.drawn = time;
    progress.visible = terminal;
    progress.finished = last;
    if (write(STDERR_FILENO, line, (size_t)length) < 0)
        progress.kind = SHELL_PROGRESS_OFF;
}

const char *shell_progress_clear(void)
{
    if (!progress.visible)
        return "";
    progress.visible = false;
    return "\r\033[K";
}
