/* Blocks of values compressed by Blosc.  LZ4 behind a shuffle of bytes, which
 * is what OpenVDB writes, is unpacked here: Blosc itself works on through a
 * null pointer where it gets no memory, and loading it takes longer than many a
 * volume. Other chunks go through its adapter. */
#ifndef VOL_IO_BLOSC_H
#define VOL_IO_BLOSC_H

#include <stddef.h>

#include "base/status.h"

/* VOL_OK only where the chunk is sound and holds exactly `to_size` bytes;
 * VOL_BAD_INPUT where it is damaged.  Reads and writes within both whatever the
 * bytes.  Safe to call from several threads at once. */
VolStatus vol_blosc_unpack(const unsigned char *chunk, size_t size, void *to, size_t to_size, VolError *err);

#endif
