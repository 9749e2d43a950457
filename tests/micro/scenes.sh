# Every scene of this folder that is rendered as it is, through vol-render.
# shellcheck disable=SC2046
exec "$OUT/tests/tools/scene" $(grep -L light-solve "$TESTS"/micro/*.json)
