# The marching estimator converges to the exact one with order 2; more samples converge too.
. "$TESTS/lib.sh"
cat >tf.json <<'END'
{ "pellucid": "transfer-function/1", "interpolate": "extinction", "particle_step": 0.5,
  "scatter": [[0, 0.1, [1, 0.8, 0.6]], [1, 0.8, [0.2, 0.5, 0.9]]], "emit": [[0, 0.1], [1, 0.3, [1, 0.5, 0.2]]] }
END
must makevdb --dims 17,17,17 --voxel 0.0625 --field linear:0.5,0.3,0.4,-0.1 >linear.vdb
must makevdb --dims 17,17,17 --voxel 0.0625 --field waves >waves.vdb
view='--size 32x24 --eye 2,1.5,4 --look-at 0.5,0.5,0.5 --precise'

rms() { # A B: the largest root mean square difference of a channel
    vol-diff "$1" "$2" | sed -n 's/.* rms \([0-9.e+-]*\),.*/\1/p' | sort -g | tail -n 1
}
order() { # NAME LOW HIGH E1 E2
    if awk -v a="$4" -v b="$5" -v low="$2" -v high="$3" 'BEGIN { o = log(a / b) / log(2); exit !(b > 0 && o > low && o < high) }'
    then passed "$1"; else echo "errors $4 $5" >why; failed "$1" why; fi
}
for volume in linear waves; do
    must vol-render -t tf.json $view -o exact.exr $volume.vdb
    for step in 4 2 1 05; do
        length=$(echo $step | sed 's/05/0.5/')
        must vol-render -t tf.json $view --estimator direct --step ${length}v -o direct.exr $volume.vdb
        eval "e$step=\$(rms direct.exr exact.exr)"
    done
    # shellcheck disable=SC2154
    {
        order "$volume: direct, 2 voxels to 1" 1.7 2.3 "$e2" "$e1"
        order "$volume: direct, 1 voxel to 1/2" 1.7 2.3 "$e1" "$e05"
    }
    must vol-render -t tf.json $view --estimator direct --step 0.0625w -o world.exr $volume.vdb
    must vol-render -t tf.json $view --estimator direct --step 1v -o voxel.exr $volume.vdb
    check "$volume: a step in voxels is one in world units" vol-diff world.exr voxel.exr
done
finish
