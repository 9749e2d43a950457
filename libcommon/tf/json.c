#include "tf/json.h"

#include <stdbool.h>

#include "base/refusals.h"

/* jansson reports want of memory as all kinds of things, so its allocations are watched while it parses. */
VolStatus vol_json_load(const char *text, size_t size, size_t flags, const char *name, json_t **out, VolError *err)
{
    json_error_t e;
    vol_watch_jansson();
    size_t refusals = vol_refusals();
    json_t *root = json_loadb(text, size, flags, &e);
    bool out_of_memory = vol_refusals() != refusals;
    if (root && out_of_memory) {
        json_decref(root);
        root = NULL;
    }
    *out = root;
    if (root)
        return VOL_OK;
    if (out_of_memory)
        return vol_fail(err, VOL_NOMEM, "out of memory while reading '%.200s'", name);
    return vol_fail(err, VOL_BAD_INPUT, "bad transfer function '%.200s': line %d: %s", name, e.line > 0 ? e.line : 1,
                    e.text);
}
