/* Words and numbers of VTK's files, XML and legacy. */
#ifndef VOL_IMPORT_VTK_WORDS_H
#define VOL_IMPORT_VTK_WORDS_H

#include "import/sampled.h"

bool vol_vtk_space(unsigned char c); /* as the C locale has it */

/* The bits of a number that is the whole of the text; false: it is none of the type.  Integers may be written with or
 * without sign where their bits are the same, as VTK reads them. */
bool vol_vtk_number(const char *text, VolSample type, uint64_t *bits);
void vol_vtk_put(unsigned char *out, uint64_t bits, size_t size, bool big_endian);

/* Spreads `count` bits, the highest first, over as many bytes, in place. */
void vol_vtk_spread_bits(unsigned char *bytes, size_t count);

/* The next word of the bytes from *at on, cut to fit; *at moves behind it.  False: none is left. */
bool vol_vtk_word(const VolBytes *bytes, size_t *at, char *word, size_t size);

#endif
