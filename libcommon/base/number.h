/* Numbers as users write them, in the C locale whatever the machine's. */
#ifndef VOL_BASE_NUMBER_H
#define VOL_BASE_NUMBER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* The whole text must be one finite number. */
bool vol_parse_real(const char *text, double *out);
bool vol_parse_int(const char *text, int64_t *out);

/* Comma-separated reals: exactly between min and max of them; returns the count or -1. */
int vol_parse_reals(const char *text, double *out, int min, int max);

/* Copies text up to `separator` (or the end) into `piece`; returns what follows it, NULL at the end or where it does not
 * fit (piece is then empty, so that no number is found in it). */
const char *vol_cut_text(const char *text, char separator, char *piece, size_t size);

#endif
