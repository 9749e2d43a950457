/* Inside tf/: lines of JSON files, for messages. */
#ifndef VOL_TF_LOCATE_H
#define VOL_TF_LOCATE_H

#include <stddef.h>

/* The line, from 1, where a key of the outermost object begins, or (element > 0, counted from 1) that element of the
 * first list in it.  0: not found, which keys written with escapes are not.  The text must be well-formed. */
size_t vol_json_line(const char *text, size_t size, const char *key, size_t element);

/* Index of the first byte at or after i that is no white space, or size. */
size_t vol_json_skip_space(const char *text, size_t size, size_t i);

#endif
