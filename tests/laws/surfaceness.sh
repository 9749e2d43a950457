# The classic model with surfaceness by the gradient's magnitude bends where its ramp begins and ends: the exact estimator in
# single precision, with half as many nodes, is as good as in double.
. "$TESTS/lib.sh"

awk 'BEGIN {
    print "NRRD0004\ntype: float\ndimension: 3\nsizes: 3 3 3\nencoding: ascii\n"
    for (n = 0; n < 27; n++) print 0.5 + 0.3 * sin(2.3 * n * n + 1)
}' >v.nrrd
must vol-import -q -f --no-history -o v.vdb v.nrrd
for ramp in '0.02, 0.2' '0.1, 0.11' '0, 0.3'; do
    echo "{\"pellucid\": \"transfer-function/1\", \"model\": \"classic\", \"interpolate\": \"extinction\",
           \"scatter\": [[0.3, 0.2, [0.4, 0.2, 0.9]], [0.8, 0.6, [1, 0.5, 0.2]]], \"surfaceness\": {\"gradient\": [$ramp]}}" >t.json
    for light in '' '--light sun:1,-1,-1' '--light point:3,30,30:500,400,300'; do
        # shellcheck disable=SC2086
        must vol-render -q -f --no-history -t t.json --size 24x24 $light -o a.exr v.vdb
        # shellcheck disable=SC2086
        must vol-render -q -f --no-history -t t.json --size 24x24 $light --precise -o b.exr v.vdb
        check "ramp $ramp $light" vol-diff --max 1e-5 a.exr b.exr
    done
done
finish
