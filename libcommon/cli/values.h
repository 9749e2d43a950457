/* From words to typed fields.  Used within cli/ only. */
#ifndef VOL_CLI_VALUES_H
#define VOL_CLI_VALUES_H

#include "cli/words.h"

/* Zeroes the option's field. */
void vol_clear_value(const VolOpt *option, void *options);

/* Parses `text` as the option's kind says and stores it in the field of `options`.  VOL_USAGE:
 * "bad value 'x' for '--name': why". */
VolStatus vol_store_value(VolArena **arena, const VolOpt *option, void *options, const char *text, VolError *err);

#endif
