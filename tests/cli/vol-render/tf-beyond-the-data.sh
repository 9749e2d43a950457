echo '{"pellucid": "transfer-function/1", "scatter": [[5, 0], [6, 0.5]]}' >tf.json
makevdb --field linear:1,0,0,0 >a.vdb
vol-render -t tf.json --size 4x4 -o a.exr a.vdb
