/* Adapters to C++ libraries are shared objects loaded on first use, so that a program pays (start-up time, memory) only
 * for what its input needs, and no C++ reaches into the C code. */
#ifndef VOL_BASE_PLUGIN_H
#define VOL_BASE_PLUGIN_H

#include "base/status.h"

/* Loads `pellucid-NAME.so` from (in order) $PELLUCID_ADAPTERS, ../lib/pellucid beside the running program's folder, and
 * finds its table of functions (symbol `pellucid_NAME_adapter`).  Cached; thread-safe.  VOL_BAD_INPUT names the missing
 * file and why it would not load; VOL_NOMEM where memory or threads are short. */
VolStatus vol_plugin(const char *name, const void **table, VolError *err);

/* The adapter whose libraries are being loaded now, else NULL.  Async-signal-safe: their initialisers may call abort() where
 * they get no thread or no memory. */
const char *vol_plugin_being_loaded(void);

#endif
