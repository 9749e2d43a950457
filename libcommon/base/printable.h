/* Text of any origin made fit for a terminal and a log. */
#ifndef VOL_BASE_PRINTABLE_H
#define VOL_BASE_PRINTABLE_H

#include <stddef.h>

/* Copies `from` into `to` of `room` bytes (at least 1), cut where it is full.  Valid UTF-8 stays; control characters (those
 * of U+0080 to U+009F, too) and all other bytes become \xNN.  Made so once, a text stays as it is.  Returns its length. */
size_t vol_printable(char *to, size_t room, const char *from);

#endif
