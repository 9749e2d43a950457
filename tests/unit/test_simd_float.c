/* The vocabulary of vectors in float. */
#include "tests/unit/simd_checks.h"
