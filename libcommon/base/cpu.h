/* Which kernels this machine can run, and how many threads it grants. */
#ifndef VOL_BASE_CPU_H
#define VOL_BASE_CPU_H

#include <stdbool.h>

#include "base/status.h"

/* Levels with fused multiply-add only, so that all give the same bytes. */
typedef enum VolCpu { VOL_CPU_SCALAR, VOL_CPU_AVX2, VOL_CPU_AVX512, VOL_CPU_NEON } VolCpu;

/* "auto", "scalar", "avx2", "avx512", "neon"; VOL_USAGE where the machine lacks it (listing what it has).  A level that
 * has no kernels of its own yet runs those of the level below. */
VolStatus vol_cpu_choose(const char *name, VolCpu *out, VolError *err);
const char *vol_cpu_name(VolCpu cpu);
const char *vol_cpu_list(void); /* "scalar,avx2" */

/* Whether kernels compiled for AVX2 and fused multiply-add are to be run. */
static inline bool vol_cpu_runs_avx2(VolCpu cpu) { return cpu == VOL_CPU_AVX2 || cpu == VOL_CPU_AVX512; }

/* `wanted` 0: what affinity and the cgroup's cpu.max allow (rounded up, at least 1). */
int vol_thread_count(int wanted);

#endif
