echo '{"pellucid": "transfer-function/1", "scatter": [[0, 0.5], [1, 0.5]]}' >tf.json
makeexr 4x4 R=1 >a.exr
vol-render -t tf.json -o b.exr a.exr
