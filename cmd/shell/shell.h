/* What the files of cmd/shell share. */
#ifndef CMD_SHELL_SHELL_H
#define CMD_SHELL_SHELL_H

#include <stdbool.h>

#include "base/status.h"

/* `prog: severity: text`, one line, one write(2), so that lines of several programs in a pipeline do not mix.  Clears a
 * progress line first. */
void shell_say(const char *program, const char *severity, const char *text);

/* INT, TERM, HUP and PIPE: temporaries are unlinked, then the signal does what it does by default.  An abort() within the
 * loading of an adapter, or after a refusal of memory, becomes exit code 5. */
void shell_catch_signals(const char *name);

/* Does work(user) on a stack that is large enough, whatever `ulimit -s` says; VOL_NOMEM where there is none. */
VolStatus shell_with_stack(int (*work)(void *user), void *user, int *result, VolError *err);

typedef enum ShellProgress { SHELL_PROGRESS_OFF, SHELL_PROGRESS_LINES, SHELL_PROGRESS_TERMINAL } ShellProgress;

/* `mode` as in --progress: 0 auto, 1 always, 2 never. */
void shell_progress_begin(const char *program, int mode, bool quiet, bool fake_terminal);
void shell_progress_draw(double fraction);
const char *shell_progress_clear(void); /* what to write so that the line goes away, "" where there is none */

#endif
