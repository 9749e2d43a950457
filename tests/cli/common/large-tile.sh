# A file of a few hundred bytes that claims 4096^3 voxels in one tile costs what it holds, not what it claims.
. "$TESTS/lib.sh"
look() { printf '{"pellucid": "transfer-function/1", "particle_step": 4, %s}\n' "$2" >"$1.json"; }
look particles '"scatter": [[0, 0, [1, 0.5, 0.2]], [1, 0.6, [0.2, 0.7, 1]]]'
look surfaces '"scatter": [[0, 0], [1, 0.0005]], "scalar_step": 1, "surface": [[0.1, 0.2], [0.9, 0.5]]'
must makevdb --empty --sparse --tile 0,0,0,4096,0.5 >one.vdb
must makevdb --empty --sparse --unfold --tile 0,0,0,4096,0.5 >nodes.vdb
must makevdb --empty --sparse --tile -4096,0,0,4096,0.5 --tile 102400000,0,0,4096,0.2 --tile 0,-409600,4096,4096,nan \
    --tile 8,8,8,8,1 --tile 0,128,0,128,1 >apart.vdb

# Of address space, which is more than memory.
quick() { # COMMAND...
    if [ "$SANITIZED" = 1 ]; then "$@"; else ( ulimit -v 1000000; exec timeout 20 "$@" ); fi
}
for volume in one nodes apart; do
    for estimator in exact full integrals direct; do
        for look in particles surfaces; do
            check "vol-render: $volume, $estimator, $look" \
                quick vol-render -q -j2 --size 64x64 --estimator $estimator -t $look.json -o $volume.exr $volume.vdb
        done
    done
    check "vol-info: $volume" quick vol-info $volume.vdb
    check "vol-diff: $volume" quick sh -c "vol-diff $volume.vdb $volume.vdb >said; test \$? -le 1" # NaN is never the same
done
check 'a tile and its parts are the same' quick vol-diff one.vdb nodes.vdb

# In the middle of the picture a ray crosses all of it, half a voxel more at each end as it fades: one medium.
look medium '"scatter": [[0, 0.000244140625, [0.25, 0.5, 1]], [1, 0.000244140625, [0.25, 0.5, 1]]]'
for estimator in exact full integrals direct; do
    must vol-render -q --precise --size 1x1 --eye 2000,2000,100000 --look-at 2000,2000,0 --estimator $estimator -t medium.json \
        --probe 0,0 one.vdb >pixel.json
    alpha=$(tr ',' '\n' <pixel.json | sed -n 's/.*"A": *\([0-9.e-]*\).*/\1/p')
    check "$estimator: the medium in closed form" awk -v got="$alpha" 'BEGIN {
        want = 1 - exp(4097 / 4 * log(1 - 0.000244140625)); exit !(got - want < 1e-12 && want - got < 1e-12) }'
done
finish
