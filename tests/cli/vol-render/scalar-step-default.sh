# The default of scalar_step is of the nodes' range.  Where the nodes of `surface` lie at one value it is of all the file's, or
# of the data's: a picture does not depend on the unit of the field.
. "$TESTS/lib.sh"
# Number k of the unit is C printf's: exact for powers of two.
scaled() { awk -v x="$1" -v s="$2" 'BEGIN { printf "%.17g", x * s }'; }
render() { vol-render -q --size 12x12 --eye 4,9,-14 --fov 50 "$@"; }
tf() { # NAME SCALE
    v=$(scaled 3 "$2") w=$(scaled 5 "$2") j=$(scaled 4 "$2")
    case $1 in
    one) lists="\"surface\": [[$v, 0.02, [1, 0.5, 0.2]]]" ;;
    zero) lists='"surface": [[0, 0.02, [1, 0.5, 0.2]]]' ;;
    jump) lists="\"surface\": [[$j, 0.01, [1, 0.5, 0.2]], [$j, 0.03]]" ;;
    scatter) lists="\"surface\": [[$v, 0.02, [1, 0.5, 0.2]]], \"scatter\": [[$v, 0.1], [$w, 0]]" ;;
    isosurface) lists="\"surface\": [[$v, 0.02]], \"isosurfaces\": [{\"value\": $w, \"opacity\": 0.4}]" ;;
    esac
    printf '{"pellucid": "transfer-function/1", %s}\n' "$lists" >"$1.json"
}
volume() { # SCALE
    a=$(scaled 0.7 "$1") b=$(scaled -0.4 "$1") c=$(scaled 0.3 "$1") d=$(scaled 2 "$1")
    must makevdb --type double --dims 9,9,9 --field "linear:$a,$b,$c,$d"
}
for look in one zero jump scatter isosurface; do
    tf $look 1
    volume 1 >a.vdb
    for estimator in exact full integrals direct; do
        must render --estimator $estimator -t $look.json -o "$look-$estimator.exr" a.vdb
    done
    check "$look: something, but not opaque" sh -c "vol-info $look-exact.exr | grep -A6 'A\$' | grep -q 'max: 0.[0-9]*'"
    for unit in 0.0000152587890625 1e-3 100 1e8 1e-20 1e20; do
        tf $look $unit
        volume $unit >b.vdb
        for estimator in exact full integrals direct; do
            must render --estimator $estimator -t $look.json -o b.exr b.vdb
            check "$look, $estimator: values times $unit" vol-diff --max 1e-5 b.exr "$look-$estimator.exr"
        done
    done
done

# Tables know no data but those that they are told of.
tf zero 1
volume 1 >a.vdb
exits 3 'tables without a volume' tf-preint -o t.exr zero.json
says "*key 'surface' has nodes at one value alone*scalar_step*" 'says why'
must tf-preint -o t.exr --range -5,10 --part integrals --volume a.vdb zero.json
must render --estimator integrals -t t.exr -o t-picture.exr a.vdb
check 'tables for a volume' vol-diff --max 1e-6 t-picture.exr zero-integrals.exr
tf scatter 1
exits 0 'tables of a file with a range' tf-preint -o t.exr scatter.json
finish
