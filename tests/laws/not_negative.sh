# Light is never negative: not where colours run to 0 at a node and the field is that node's value but for rounding, not in
# float, not in double, and not in any layer.
. "$TESTS/lib.sh"

# Fields of one value, a knot's or its neighbours' in double, for nodes that are no round numbers.
awk 'BEGIN {
    srand(7)
    for (n = 0; n < 12; n++) {
        split("-1000 -7.3 0.1 -0.33333333333333331 -12345.6", first)
        v0 = first[1 + n % 5]; v1 = 0.2 + rand(); c = 0.1 + rand()
        list = n % 2 ? "scatter" : "emit"; other = n % 3 ? "surface" : "scatter"
        model = n % 3 == 1 ? "classic" : n % 3 ? "hybrid" : "unshaded"
        nodes = sprintf("[[%.17g, %.3f, [%.17g, %.17g, 0.5]], [%.17g, %.3f, [0, 0, 0.5]], [%.17g, 0.4, [0, 0.1, 0.5]]]", v0,
                        rand(), c, c / 3, v1, rand(), v1 + 1)
        printf "{\"pellucid\": \"transfer-function/1\", \"interpolate\": \"%s\", \"model\": \"%s\", \"%s\": %s%s}\n",
               n % 4 < 2 ? "opacity" : "extinction", model, list, nodes,
               other != list ? ", \"" other "\": " nodes : "" > ("tf" n ".json")
        for (k = 0; k < 3; k++)
            printf "%d %.17g\n", n, v1 * (1 - k * 1.1102230246251565e-16)
    }
}' >values
bad=0
while read -r n value; do
    must makevdb --type double --dims 3,3,3 --field "const:$value" >a.vdb
    for estimator in exact full integrals direct; do
        for precision in '' --precise; do
            must vol-render -q -t "tf$n.json" --size 4x4 --estimator $estimator $precision --aov surface,scatter,emit \
                --probe 1,1 --probe 2,1 a.vdb >pixels.json
            if grep -q ': -[0-9]' pixels.json; then
                bad=$((bad + 1))
                { echo "tf$n $value $estimator $precision"; grep ': -[0-9]' pixels.json; } >>negative
            fi
        done
    done
done <values
if [ "$bad" = 0 ]; then passed 'at the value of a node'; else failed 'at the value of a node' negative; fi

# Fields that run through all of it.
must makevdb --type double --dims 9,9,9 --field linear:0.17,-0.09,0.21,-0.3 >ramp.vdb
must makevdb --dims 9,9,9 --field waves --sparse >waves.vdb
n=0
while [ $n -lt 12 ]; do
    for volume in ramp waves; do
        for estimator in exact full integrals direct; do
            for precision in '' --precise; do
                must vol-render -q -f -t "tf$n.json" --size 12x12 --estimator $estimator $precision \
                    --aov surface,scatter,emit -o out.exr $volume.vdb
                vol-info out.exr | grep -q 'min: -' && echo "tf$n $volume $estimator $precision" >>dark
            done
        done
    done
    n=$((n + 1))
done
if [ ! -s dark ]; then passed 'on the way through nodes'; else failed 'on the way through nodes' dark; fi
finish
