#include "tf/json.h"

#include <stdbool.h>
#include <stdlib.h>

/* jansson reports want of memory as all kinds of things, so its allocations are watched while it parses. */
static _Thread_local bool out_of_memory;

static void *watched_malloc(size_t size)
{
    void *block = malloc(size);
    out_of_memory |= !block;
    return block;
}

VolStatus vol_json_load(const char *text, size_t size, size_t flags, const char *name, json_t **out, VolError *err)
{
    json_malloc_t old_malloc;
    json_free_t old_free;
    json_error_t e;
    json_get_alloc_funcs(&old_malloc, &old_free);
    json_set_alloc_funcs(watched_malloc, free);
    out_of_memory = false;
    json_t *root = json_loadb(text, size, flags, &e);
    if (root && out_of_memory) {
        json_decref(root);
        root = NULL;
    }
    json_set_alloc_funcs(old_malloc, old_free);
    *out = root;
    if (root)
        return VOL_OK;
    if (out_of_memory)
        return vol_fail(err, VOL_NOMEM, "out of memory while reading '%.200s'", name);
    return vol_fail(err, VOL_BAD_INPUT, "bad transfer function '%.200s': line %d: %s", name, e.line > 0 ? e.line : 1,
                    e.text);
}
