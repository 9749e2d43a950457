# Every scene of this folder with light grids, through light-solve.
# shellcheck disable=SC2046
exec "$OUT/tests/tools/grids" $(grep -l '"grids"' "$TESTS"/micro/*.json)
