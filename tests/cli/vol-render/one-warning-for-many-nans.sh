echo '{"pellucid": "transfer-function/1", "scatter": [[0, 0.5], [1, 0.5]]}' >tf.json
makevdb --dims 20,20,20 --poke 2,2,2,nan --poke 9,9,9,nan --poke 9,17,3,inf >a.vdb
vol-render -t tf.json --size 4x4 -o a.exr a.vdb 2>said
test "$(wc -l <said)" = 1 && grep -q 'warning: .*3 voxels' said
