#include "cmd/shell/stamp.h"

#include <stdlib.h>
#include <string.h>

static VolStatus stamp_history(const Run *run, const char *prior, VolVdbMetaList *file_meta, VolError *err)
{
    char *history = vol_history_append(prior, run->history_line);
    if (!history)
        return vol_fail_memory(err, strlen(run->history_line));
    VolStatus status = vol_meta_set_text(file_meta, "vol:history", history, err);
    free(history);
    return status;
}

/* KEY=VALUE of --set; `key` is allocated. */
static VolStatus split_pair(const char *pair, char **key, const char **value, VolError *err)
{
    const char *equals = strchr(pair, '=');
    if (!equals || equals == pair)
        return vol_fail(err, VOL_USAGE, "option --set: '%s' is not KEY=VALUE", pair);
    if (strncmp(pair, "vol:", 4) == 0)
        return vol_fail(err, VOL_USAGE, "option --set: keys that begin with 'vol:' are reserved, as '%s'", pair);
    *key = vol_format_text("%.*s", (int)(equals - pair), pair);
    *value = equals + 1;
    return *key ? VOL_OK : vol_fail_memory(err, strlen(pair));
}

static VolStatus stamp_pair(const char *pair, VolVdbMetaList *file_meta, VolError *err)
{
    char *key;
    const char *value;
    VolStatus status = split_pair(pair, &key, &value, err);
    if (status)
        return status;
    status = vol_meta_set_text(file_meta, key, value, err);
    free(key);
    return status;
}

VolStatus run_stamp_vdb(const Run *run, const char *prior, const uint64_t (*input_digests)[2], size_t inputs,
                        VolVdbMetaList *file_meta, VolError *err)
{
    VolStatus status = VOL_OK;
    if (!run->common->no_history)
        status = stamp_history(run, prior, file_meta, err);
    if (status)
        return status;

    char args_hash[33];
    vol_args_hash(run->hashed_line, input_digests, inputs, args_hash);
    status = vol_meta_set_text(file_meta, "vol:argsHash", args_hash, err);
    if (!status && run->common->frame_given)
        status = vol_meta_set(file_meta, "vol:frame", "int64", &run->common->frame, sizeof run->common->frame, err);
    for (size_t i = 0; !status && i < run->common->set.count; i++)
        status = stamp_pair(run->common->set.words[i], file_meta, err);
    return status;
}

VolStatus run_stamp_grid(const Run *run, VolVdbMetaList *grid_meta, VolError *err)
{
    char *creator = vol_format_text("%s %s", run->program->name, VOL_VERSION);
    if (!creator)
        return vol_fail_memory(err, 64);
    VolStatus status = vol_meta_set_text(grid_meta, "creator", creator, err);
    free(creator);
    return status;
}

static VolStatus stamp_part(const Run *run, const char *prior, const char *args_hash, VolPart *part, VolError *err)
{
    char *software = vol_format_text("%s %s", run->program->name, VOL_VERSION);
    char *history = vol_history_append(prior, run->history_line);
    VolStatus status = software && history ? VOL_OK : vol_fail_memory(err, 64);
    if (!status)
        status = vol_part_set_text(part, "Software", software, err);
    if (!status && !run->common->no_history)
        status = vol_part_set_text(part, "vol:history", history, err);
    if (!status)
        status = vol_part_set_text(part, "vol:argsHash", args_hash, err);
    double frame = (double)run->common->frame;
    if (!status && run->common->frame_given)
        status = vol_part_set_numbers(part, "imageCounter", VOL_ATTR_INT, &frame, err);
    for (size_t i = 0; !status && i < run->common->set.count; i++) {
        char *key;
        const char *value;
        status = split_pair(run->common->set.words[i], &key, &value, err);
        if (status)
            break;
        status = vol_part_set_text(part, key, value, err);
        free(key);
    }
    free(software);
    free(history);
    return status;
}

VolStatus run_stamp_exr(const Run *run, const char *prior, const uint64_t (*input_digests)[2], size_t inputs,
                        VolImage *image, VolError *err)
{
    char args_hash[33];
    VolStatus status = VOL_OK;
    vol_args_hash(run->hashed_line, input_digests, inputs, args_hash);
    for (size_t i = 0; !status && i < image->part_count; i++)
        status = stamp_part(run, prior, args_hash, &image->parts[i], err);
    return status;
}
