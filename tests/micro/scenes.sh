# Every scene of this folder, through vol-render.
exec "$OUT/tests/tools/scene" "$TESTS"/micro/*.json
