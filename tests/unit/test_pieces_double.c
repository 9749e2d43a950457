/* Segments that no table covers, in double. */
#define VOL_DOUBLE
#include "tests/unit/pieces_checks.h"
