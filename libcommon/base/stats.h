/* What a run did, for --stats: a JSON object whose keys may be nested with dots ("skipped.leaves").
 * A NULL VolStats is accepted everywhere and does nothing.  Not for use from several threads. */
#ifndef VOL_BASE_STATS_H
#define VOL_BASE_STATS_H

#include <stdint.h>

#include "base/mem.h"
#include "base/status.h"

typedef struct VolStats VolStats;

VolStats *vol_stats_new(void); /* NULL: out of memory */
void vol_stats_free(VolStats *stats);
void vol_stats_count(VolStats *stats, const char *key, uint64_t value);  /* adds */
void vol_stats_number(VolStats *stats, const char *key, uint64_t value); /* sets */
void vol_stats_real(VolStats *stats, const char *key, double value);     /* sets */
void vol_stats_text(VolStats *stats, const char *key, const char *text); /* sets */

/* Seconds by stage: the time since the last call (or since _new) is added to "seconds.STAGE". */
void vol_stats_stage(VolStats *stats, const char *stage);

/* Adds "peak_memory_bytes" and "seconds.total"; indented JSON with a newline. */
VolStatus vol_stats_write(VolStats *stats, VolBytes *out, VolError *err);

#endif
