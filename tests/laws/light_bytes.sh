# Light grids: the same bytes for any number of threads, at any cpu level, from a file or a pipe.
. "$TESTS/lib.sh"
must vol-gen field noise --size 24 --param frequency=3 -o v.vdb
for tf in glass smoke boundary-delta; do
    for light in sun:1,-2,0.3 point:0.1,0.2,0.3 spot:0,3,0,0,-1,0,40; do
        must light-solve -q -f -t "$EXAMPLES/tf/$tf.json" --light "$light" -j1 --cpu scalar -o first.vdb v.vdb
        for how in -j1 -j2 -j5 '-j2 --cpu avx2'; do
            # shellcheck disable=SC2086
            light-solve -q -f -t "$EXAMPLES/tf/$tf.json" --light "$light" $how -o other.vdb v.vdb 2>said ||
                { grep -q cpu said && continue; }
            check "$tf, $light, $how" cmp first.vdb other.vdb
        done
    done
done
finish
