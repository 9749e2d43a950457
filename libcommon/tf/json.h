/* Inside tf/: jansson, with want of memory told from faults of the text. */
#ifndef VOL_TF_JSON_H
#define VOL_TF_JSON_H

#include <jansson.h>

#include "base/status.h"

/* `name` is for messages; flags are jansson's.  Released with json_decref. */
VolStatus vol_json_load(const char *text, size_t size, size_t flags, const char *name, json_t **out, VolError *err);

#endif
