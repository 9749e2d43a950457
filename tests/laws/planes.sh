# Rays that run exactly along a plane of voxels, as an orthographic view along an axis has them, see that plane: a plateau at
# an isosurface's value is met whatever the spacing, though the coordinates of such rays are rounded.
. "$TESTS/lib.sh"

# volume FILE SPACING: 4 x 4 x 6 voxels, 1 in the plane y = 2 but for its ends along z, else 0.
volume() {
    awk -v s="$2" 'BEGIN {
        printf "NRRD0004\ntype: float\ndimension: 3\nsizes: 4 4 6\nencoding: ascii\nspace dimension: 3\n"
        printf "space directions: (%.17g,0,0) (0,%.17g,0) (0,0,%.17g)\nspace origin: (%.17g,0,0)\n\n", s, s, s, 100 * s
        for (n = 0; n < 96; n++) print (int(n / 4) % 4 == 2 && n >= 16 && n < 80)
    }' >v.nrrd
    must vol-import -q -f --no-history -o "$1" v.nrrd
}
echo '{"pellucid": "transfer-function/1", "model": "unshaded", "isosurfaces": [{"value": 1, "opacity": 1}]}' >opaque.json
echo '{"pellucid": "transfer-function/1", "model": "classic", "particle_step": 1000, "scatter": [[0, 0], [1, 0.5]],
       "isosurfaces": [{"value": 1, "opacity": 0.6}]}' >classic.json
volume v1.vdb 1
for spacing in 0.1 0.3 0.7 3.3 1e-3 12345.678; do
    volume v.vdb $spacing
    height=$(awk -v s=$spacing 'BEGIN { printf "%.17g", 4 * s }')
    for e in exact direct integrals full; do
        for p in '' --precise; do
            # shellcheck disable=SC2086
            must vol-render -q -f --no-history -t opaque.json --ortho 4 --size 4x4 --estimator $e $p -o a.exr v1.vdb
            # shellcheck disable=SC2086
            must vol-render -q -f --no-history -t opaque.json --ortho "$height" --size 4x4 --estimator $e $p -o b.exr v.vdb
            check "spacing $spacing, $e $p" vol-diff a.exr b.exr
        done
    done
    must vol-render -q -f --no-history -t classic.json --ortho "$height" --size 4x4 -o a.exr v.vdb
    must vol-render -q -f --no-history -t classic.json --ortho "$height" --size 4x4 --precise -o b.exr v.vdb
    check "spacing $spacing, classic: float as double" vol-diff --max 1e-5 a.exr b.exr
done
must vol-render -q -f --no-history -t opaque.json --ortho 4 --size 4x4 -o a.exr v1.vdb
check 'one row is opaque' sh -c "vol-info --json a.exr | grep -q '\"mean\": 0.25'"
finish
