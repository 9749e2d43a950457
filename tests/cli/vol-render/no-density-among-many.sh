echo '{"pellucid": "transfer-function/1", "scatter": [[0, 0.5], [1, 0.5]]}' >tf.json
makevdb --name smoke --also --name steam >a.vdb
vol-render -t tf.json --size 4x4 -o a.exr a.vdb
