# Volumes of one voxel, of one line of voxels, of nothing.
. "$TESTS/lib.sh"
echo '{"pellucid": "transfer-function/1", "scatter": [[0, 0.5], [1, 0.5]]}' >tf.json
for size in 1 1,5,1 1,1,5; do
    must vol-gen field constant --size "$size" -o v.vdb
    for light in sun:1,1,0 point:0,0,0 spot:0,5,0,0,-1,0,30; do
        exits 0 "$size, $light" light-solve -t tf.json --light "$light" -f -o lit.vdb v.vdb
        check "$size, $light: in silence" test ! -s stderr
        exits 0 "$size, $light, --resolution" light-solve -t tf.json --resolution 4 --light "$light" -f -o lit.vdb v.vdb
    done
done
must makevdb --empty >empty.vdb
exits 0 'an empty grid' light-solve -t tf.json --light sun:1,1,0 -o lit.vdb empty.vdb
says "light-solve: warning: grid 'density' is empty*" 'an empty grid: says so'
check 'an empty grid: one line' test "$(wc -l <stderr)" = 1
must vol-info lit.vdb -o lit.txt
check 'an empty grid: light all the same' grep -q light.0.direct lit.txt
echo '{"pellucid": "transfer-function/1", "scatter": [[5, 0], [6, 0.5]]}' >nothing.json
must vol-gen field sphere --size 8 -o v.vdb
exits 0 'nothing is shown' light-solve -t nothing.json --light sun:1,1,0 -f -o lit.vdb v.vdb
finish
