/* Segments that no table covers, in float. */
#include "tests/unit/pieces_checks.h"
