/* Inputs of the wrong kind: what they are, and what to do about it. */
#include <string.h>

#include "cmd/shell/program.h"
#include "import/import.h"

/* The first bytes of a VDB or an EXR, and no more. */
static bool is_cut_short(const VolBytes *bytes)
{
    return (bytes->size < 8 && memcmp(bytes->data, " BDV\0\0\0\0", bytes->size) == 0) ||
           (bytes->size < 4 && memcmp(bytes->data, "\x76\x2f\x31\x01", bytes->size) == 0);
}

VolStatus run_wrong_kind(const char *doing, const char *name, const char *wanted, const VolBytes *bytes, VolError *err)
{
    VolKind kind = vol_kind(bytes);
    const char *format = vol_import_format(bytes);
    const char *what = kind == VOL_KIND_VDB    ? "a VDB volume"
                       : kind == VOL_KIND_EXR  ? "an EXR image"
                       : kind == VOL_KIND_JSON ? "JSON"
                                               : NULL;
    if (kind == VOL_KIND_EMPTY)
        return vol_fail(err, VOL_BAD_INPUT, "%s '%s': it is empty", doing, name);
    if (is_cut_short(bytes))
        return vol_fail(err, VOL_BAD_INPUT, "%s '%s': it ends early, after %zu bytes", doing, name, bytes->size);
    if (what)
        return vol_fail(err, VOL_BAD_INPUT, "%s '%s': it is %s, not %s", doing, name, what, wanted);
    if (format)
        return vol_fail(err, VOL_BAD_INPUT, "%s '%s': it is %s, not %s: vol-import makes a VDB of it", doing, name, format,
                        wanted);
    VolForeign is = vol_import_foreign(bytes, name);
    if (is.what)
        return vol_fail(err, VOL_BAD_INPUT, "%s '%s': %s, not %s%s", doing, name, is.what, wanted, is.advice);
    return vol_fail(err, VOL_BAD_INPUT, "%s '%s': it is not %s (%zu bytes); vol-import reads other volumes", doing, name,
                    wanted, bytes->size);
}

VolStatus run_refuse_volume(const VolBytes *bytes, const char *name, VolError *err)
{
    static const char doing[] = "bad transfer function";
    VolKind kind = vol_kind(bytes);
    const char *format = kind == VOL_KIND_OTHER ? vol_import_format(bytes) : NULL;
    if (kind == VOL_KIND_VDB)
        return vol_fail(err, VOL_BAD_INPUT, "%s '%s': it is a VDB volume", doing, name);
    if (format)
        return vol_fail(err, VOL_BAD_INPUT, "%s '%s': it is a volume (%s); vol-import makes a VDB of it", doing, name,
                        format);
    VolForeign is = kind == VOL_KIND_OTHER ? vol_import_foreign(bytes, NULL) : (VolForeign){NULL};
    if (is.what)
        return vol_fail(err, VOL_BAD_INPUT, "%s '%s': %s%s", doing, name, is.what, is.advice);
    return VOL_OK;
}
