/* How often memory was asked for and not given, in the whole process.  Libraries may carry on without it, with a key less in
 * their JSON or an attribute less in their image: a run that saw one does not end well. */
#ifndef VOL_BASE_REFUSED_H
#define VOL_BASE_REFUSED_H

#include <stddef.h>

size_t vol_refusals(void); /* in mem.h's functions and those of refusals.h; async-signal-safe */
void vol_count_refusal(void);

#endif
