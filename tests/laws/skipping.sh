# Skipping changes no byte of any layer: volumes whose values end, over whole bricks, exactly where the transfer function
# begins to show something.  (Random scenes: unit/test_kernels.)
. "$TESTS/lib.sh"

volume() { # NAME SIDE VALUE: u8, VALUE an awk expression of x, which is in the last third above what bricks before it have
    awk -v side="$2" "BEGIN { for (z = 0; z < side; z++) for (y = 0; y < side; y++) for (x = 0; x < side; x++)
        printf \"%c\", $3 }" >"$1.raw"
    must vol-import --dims "$2,$2,$2" --type u8 --spacing 1,1,1 -o "$1.vdb" "$1.raw"
}
# A plateau inside a stretch that only surfaces show; one at its lower end; and values that rise up to that end.  The
# domain's far faces lie at voxel centres: cells beyond them are no part of the field, whatever rounding says.
volume inside 24 'x < 16 ? 65 : 49 + x'
volume at-end 24 'x < 17 ? 60 : 44 + x'
volume up-to-end 24 '44 + x'

surface='"surface": [[60, 0.3], [80, 0.3]]'
look() { printf '{"pellucid": "transfer-function/1", "scalar_step": 1, "particle_step": 1, %s}\n' "$2" >"$1.json"; }
look surface "$surface"
look unshaded "$surface, \"model\": \"unshaded\""
look jumps '"surface": [[60, 0], [60, 0.3], [80, 0.3], [80, 0]]'
look both "$surface, \"scatter\": [[70, 0], [80, 0.6]]"
look classic '"scatter": [[60, 0], [80, 0.6]], "model": "classic"'
look particles '"scatter": [[60, 0], [60, 0.5], [65, 0.5], [65, 0]]'
look emission '"emit": [[60, 0], [80, 1]]'
look coloured "$surface, \"absorb\": [[65, 0, [1, 0, 0]], [80, 0.4, [1, 0.5, 0]]]"
look isosurfaces '"isosurfaces": [{"value": 60, "opacity": 0.5}, {"value": 65, "opacity": 0.5}]'
look isosurface "$surface, \"isosurfaces\": [{\"value\": 65, \"opacity\": 0.5}]"

options='-q --size 48x48 --aov steps,Z,surface,scatter,emit,normal'
for volume in inside at-end up-to-end; do
    for look in surface unshaded jumps both classic particles emission coloured isosurfaces isosurface; do
        different=
        for estimator in exact full integrals direct; do
            scene="--estimator $estimator -t $look.json $volume.vdb"
            must vol-render $options -o skipped.exr $scene
            must vol-render $options -o met.exr --no-skip $scene
            cmp -s skipped.exr met.exr || different="$different $estimator"
        done
        check "$volume, $look: skipped or not" test -z "$different"
    done
done
finish
