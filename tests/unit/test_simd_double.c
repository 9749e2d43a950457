/* The vocabulary of vectors in double. */
#define VOL_DOUBLE
#include "tests/unit/simd_checks.h"
