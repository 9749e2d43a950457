echo '{"pellucid": "transfer-function/1", "scatter": [[0, 0.5], [1, 0.5]]}' >tf.json
makevdb --dims 5,5,5 --poke 2,2,2,inf >a.vdb
makevdb --dims 5,5,5 --poke 2,2,2,nan >b.vdb
vol-render -t tf.json --size 8x8 -o a.exr a.vdb || exit
vol-render -t tf.json --size 8x8 -o b.exr b.vdb 2>said
vol-diff a.exr b.exr >report || exit 9
