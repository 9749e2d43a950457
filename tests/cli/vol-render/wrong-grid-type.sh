echo '{"pellucid": "transfer-function/1", "scatter": [[0, 0.5], [1, 0.5]]}' >tf.json
makevdb --type vec3s >a.vdb
vol-render -t tf.json --size 4x4 --grid density -o a.exr a.vdb
