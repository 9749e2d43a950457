# Pictures do not depend on the unit of the field; single enormous voxels and lengths are no trouble; an isosurface that the
# field only touches is not met, or met by every estimator alike.
. "$TESTS/lib.sh"

# volume FILE SCALE: 4^3 voxels between 0 and 1, times SCALE.
volume() {
    awk -v s="$2" 'BEGIN {
        print "NRRD0004\ntype: double\ndimension: 3\nsizes: 4 4 4\nencoding: ascii\nspace dimension: 3"
        print "space directions: (1,0,0) (0,1,0) (0,0,1)\n"
        for (i = 0; i < 64; i++) printf "%.17g\n", s * (i * 37 % 64) / 63
    }' >v.nrrd
    must vol-import -q -f --no-history -o "$1" v.nrrd
}
# look FILE SCALE KEY: a function over 0 to SCALE.
look() {
    awk -v s="$2" -v key="$3" 'BEGIN {
        printf "{\"pellucid\": \"transfer-function/1\", \"scalar_step\": %.17g, ", s
        printf "\"%s\": [[0, 0, [1, 0, 0]], [%.17g, 0.3, [1, 1, 0]], [%.17g, 0.9, [0, 0, 1]]]}\n", key, s * 0.5, s
    }' >"$1"
}
draw() { # OUT VOLUME LOOK [options]
    draw_out=$1 draw_volume=$2 draw_look=$3
    shift 3
    vol-render -q -f --no-history -t "$draw_look" --size 12x12 "$@" -o "$draw_out" "$draw_volume"
}

for scale in 1 1e-38 1e-24 1e-12 1e12 1e24 1e38; do volume "v$scale.vdb" $scale; done
for key in scatter surface emit; do
    for scale in 1 1e-38 1e-24 1e-12 1e12 1e24 1e38; do
        look "t$scale.json" $scale $key
        for e in exact direct integrals full; do
            draw "$key-$e-$scale.exr" "v$scale.vdb" "t$scale.json" --estimator $e
            [ $scale = 1 ] || check "$key, $e: values times $scale" vol-diff --max 1e-5 "$key-$e-1.exr" "$key-$e-$scale.exr"
        done
    done
done

# A step as short as no field needs: opaque, and nothing that is no number.
volume v.vdb 1
for key in particle_step scalar_step; do
    for length in 1e-38 1e-300 1e38; do
        echo "{\"pellucid\": \"transfer-function/1\", \"$key\": $length, \"scatter\": [[0, 0.2], [1, 0.5]],
               \"surface\": [[0, 0.1], [1, 0.4]]}" >t.json
        draw a.exr v.vdb t.json
        draw p.exr v.vdb t.json --precise
        check "$key $length: float and double" vol-diff --max 1e-5 a.exr p.exr
    done
done

# One voxel in zeros, seen along its axis: all but nothing of its two cells is above the last node, and holds two voxels of
# opacity 0.5.
echo '{"pellucid": "transfer-function/1", "scatter": [[0, 0], [1, 0.5]]}' >t.json
for value in 1e5 1e15 1e20 1e30 3e38; do
    awk -v v=$value 'BEGIN {
        print "NRRD0004\ntype: float\ndimension: 3\nsizes: 5 5 5\nencoding: ascii\n"
        for (i = 0; i < 125; i++) print i == 62 ? v : 0
    }' >v.nrrd
    must vol-import -q -f --no-history -o v.vdb v.nrrd
    for precise in '' --precise; do
        # shellcheck disable=SC2086
        vol-render -q -t t.json --size 1x1 --ortho 1e-3 $precise --probe 0,0 v.vdb >probe
        alpha=$(sed -n 's/.*"A": \([0-9.e-]*\).*/\1/p' probe)
        check "one voxel of $value $precise: alpha ${alpha:-unknown}" \
            awk -v a="${alpha:-9}" -v v=$value 'BEGIN { d = a - 0.75; exit !(d < 1e-5 && d > -1e-5 - 2 / v) }'
    done
done

finish
