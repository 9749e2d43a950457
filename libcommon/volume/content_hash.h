/* A hash of what a volume is: its values, its domain and where it lies. */
#ifndef VOL_VOLUME_CONTENT_HASH_H
#define VOL_VOLUME_CONTENT_HASH_H

#include "volume/volume.h"

/* Equal volumes have equal hashes, however their trees are cut into leaves and tiles, whatever the type that holds their
 * values, and whatever `threads`.  `unit`: what 1 in the volume is in the user's field (a power of two).  Not of RGB. */
VolStatus vol_volume_hash(const VolVolume *volume, double unit, int threads, uint64_t out[2], VolError *err);

#endif
