# Closed forms and one trilinear cell, through vol-render.
exec "$OUT/tests/tools/closed_forms" "$TESTS/reference/closed_forms.json" "$TESTS/reference/cell_reference.json"
