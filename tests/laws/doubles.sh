# Fields of doubles and large integers: pictures in single precision are those of --precise, though no float holds the values.
. "$TESTS/lib.sh"

# volume FILE TYPE BASE SCALE: 6^3 voxels that waver around BASE by SCALE.
volume() {
    awk -v type="$2" -v base="$3" -v scale="$4" 'BEGIN {
        print "NRRD0004\ntype: " type "\ndimension: 3\nsizes: 6 6 6\nencoding: ascii\n"
        form = type == "double" ? "%.17g\n" : "%.0f\n"
        for (z = 0; z < 6; z++) for (y = 0; y < 6; y++) for (x = 0; x < 6; x++)
            printf form, base + scale * sin(0.9 * x + 0.5) * cos(0.7 * y) * sin(1.1 * z + 0.2)
    }' >v.nrrd
    must vol-import -q -f --no-history -o "$1" v.nrrd
}
alike() { # NAME VOLUME TF [options]
    alike_name=$1 alike_volume=$2 alike_tf=$3
    shift 3
    for e in exact direct integrals full; do
        for p in '' --precise; do
            # shellcheck disable=SC2086
            vol-render -q -f --no-history -t "$alike_tf" --size 24x24 --estimator $e $p "$@" -o "a$p.exr" "$alike_volume"
        done
        check "$alike_name, $e: float as double" vol-diff --max 1e-5 a.exr a--precise.exr
    done
}

for base in 1000 1e5 1e6 1e9 -1e9; do
    volume v.vdb double $base 1
    awk -v b=$base 'BEGIN { printf "{\"pellucid\": \"transfer-function/1\", \"model\": \"unshaded\", \"scatter\":"
        printf "[[%.17g, 0], [%.17g, 0.6, [1, 0.5, 0.2]], [%.17g, 0.1]]}\n", b - 0.5, b, b + 0.5 }' >particles.json
    awk -v b=$base 'BEGIN { printf "{\"pellucid\": \"transfer-function/1\", \"isosurfaces\":"
        printf "[{\"value\": %.17g, \"opacity\": 0.5, \"color\": [1, 0.5, 0.25]}]}\n", b + 0.25 }' >isosurface.json
    alike "particles around $base" v.vdb particles.json
    alike "an isosurface around $base" v.vdb isosurface.json
done

volume v.vdb int32 100000000 900
echo '{"pellucid": "transfer-function/1", "model": "unshaded", "particle_step": 3,
       "scatter": [[1e8, 0], [100000500, 0.6, [1, 0.5, 0.2]], [100001000, 0.1]]}' >t.json
alike 'integers beyond 2^24' v.vdb t.json

# Plateaus exactly at a value where something begins, and just below it.
for value in 0.1 0.7 3.3 1e-30 1e30; do
    must vol-gen field constant -q -f --no-history --double --size 6 --param value=$value -o c.vdb
    awk -v v=$value 'BEGIN { printf "{\"pellucid\": \"transfer-function/1\", \"scatter\": [[%s, 0], [%s, 0.9], [%.17g, 0.9]]}\n",
        v, v, 2 * v }' >t.json
    alike "a plateau where something begins at $value" c.vdb t.json
    for at in 0 1; do
        awk -v v=$value -v at=$at 'BEGIN {
            print "NRRD0004\ntype: double\ndimension: 3\nsizes: 4 4 5\nencoding: ascii\n"
            for (n = 0; n < 80; n++) printf "%.17g\n", (n >= 32 && n < 64) ? v * (1 - at * 2 ^ (-50)) : 0
        }' >v.nrrd
        must vol-import -q -f --no-history -o v.vdb v.nrrd
        echo "{\"pellucid\": \"transfer-function/1\", \"model\": \"unshaded\",
               \"isosurfaces\": [{\"value\": $value, \"opacity\": 1}]}" >t.json
        alike "a plateau $at/2^50 below an isosurface at $value" v.vdb t.json --ortho 3
    done
done
finish
