# Isosurfaces that the field touches and does not pass are not met; those in faces of the domain are met by every estimator.
. "$TESTS/lib.sh"

echo '{"pellucid": "transfer-function/1", "isosurfaces": [{"value": 0, "opacity": 1}]}' >iso.json

# Zeros and positive numbers, nothing below.
awk 'BEGIN {
    print "NRRD0004\ntype: float\ndimension: 3\nsizes: 12 12 12\nencoding: ascii\n"
    for (i = 0; i < 1728; i++) { x = (i * 7919 + int(i / 12) * 104729) % 1009; print x < 500 ? 0 : x / 37 }
}' >v.nrrd
must vol-import -q -f --no-history -o v.vdb v.nrrd
echo '{"pellucid": "transfer-function/1", "scatter": [[0, 0]]}' >nothing.json
must vol-render -q -f --no-history -t nothing.json --size 64x64 -o nothing.exr v.vdb
for e in exact direct integrals full; do
    for precise in '' --precise; do
        # shellcheck disable=SC2086
        vol-render -q -f --no-history -t iso.json --size 64x64 --estimator $e $precise -o a.exr v.vdb
        check "$e $precise: nothing passes below 0" vol-diff --max 0 nothing.exr a.exr
    done
done

# A sphere with caps: beyond them the background, exactly the isosurface's value.
must vol-gen -q -f --no-history field radius --param radius=1.2 --size 17 --sparse 0 -o r.vdb
draw() {
    draw_out=$1
    shift
    vol-render -q -f --no-history -t iso.json --size 48x48 -o "$draw_out" "$@" r.vdb
}
draw exact.exr
for e in exact direct integrals full; do
    for precise in '' --precise; do
        # shellcheck disable=SC2086
        draw a.exr --estimator $e --step 0.01v $precise
        check "$e $precise: the caps as exact shows them" vol-diff --max 0.02 exact.exr a.exr
    done
done

# Values 0 and 1 at random, and the isosurface at either: rays in planes and along rows of voxels, and from an eye in a plane.
awk 'BEGIN {
    printf "NRRD0004\ntype: float\ndimension: 3\nsizes: 9 9 9\nencoding: ascii\n\n"
    for (i = 0; i < 729; i++) { x = (i * 7919 + int(i / 9) * 104729) % 1009; print x % 2 }
}' >b.nrrd
must vol-import -q -f --no-history -o b.vdb b.nrrd
see() { vol-render -q -f --no-history -t iso.json --size 16x16 --eye "$view" --look-at 4,4,4 "$@" b.vdb; }
for value in 0 1; do
    echo '{"pellucid": "transfer-function/1", "isosurfaces": [{"value": '$value', "opacity": 0.3}], "model": "unshaded"}' >iso.json
    for view in 4,4,20 20,4,4 4,4.001,-9 12,4,12 -1,4,4; do
        for kind in '--ortho 8' '--ortho 4' '--fov 40'; do
            # shellcheck disable=SC2086
            must see $kind -o a.exr
            # shellcheck disable=SC2086
            must see $kind --precise -o b.exr
            check "at $value from $view, $kind: float as double" vol-diff --max 1e-5 b.exr a.exr
        done
    done
done

finish
