# Pictures that were looked at once and must stay as they are, pixel for pixel: scenes/NAME.sh writes `out.exr` into the
# current folder, ref/NAME.exr is what it was.  `tests/golden/update` renews them.
. "$TESTS/lib.sh"
for scene in "$TESTS"/golden/scenes/*.sh; do
    name=${scene##*/}
    name=${name%.sh}
    mkdir "$name"
    exits 0 "$name renders" sh -c "cd $name && exec sh -e -u $scene"
    check "$name is as it was" vol-diff "$TESTS/golden/ref/$name.exr" "$name/out.exr"
done
for ref in "$TESTS"/golden/ref/*.exr; do
    name=${ref##*/}
    check "${name%.exr} has a scene" test -f "$TESTS/golden/scenes/${name%.exr}.sh"
    check "${name%.exr} is small" test "$(wc -c <"$ref")" -lt 65536
done
finish
