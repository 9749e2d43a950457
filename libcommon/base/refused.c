#include "base/refused.h"

#include <stdatomic.h>

static atomic_size_t refusals;

size_t vol_refusals(void) { return atomic_load(&refusals); }

void vol_count_refusal(void) { atomic_fetch_add(&refusals, 1); }
