makevdb >a.vdb
echo '{"pellucid": "transfer-function/1", "scatter": [[0, 0.5], [1, 0.5]]}' >tf.json
vol-render -t tf.json --size 8x8 --crop 4x8+0+0 -o a.exr a.vdb
vol-render -t tf.json --size 8x8 --crop 4x8+4+0 --background 1,0,0 -o b.exr a.vdb
exr-join -o j.exr a.exr b.exr
