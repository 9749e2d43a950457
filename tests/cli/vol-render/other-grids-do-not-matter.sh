echo '{"pellucid": "transfer-function/1", "scatter": [[0, 0.5], [1, 0.5]]}' >tf.json
makevdb --type vec3s --name v --also --type float --name density >a.vdb
makevdb >b.vdb
vol-render -t tf.json --size 4x4 -o a.exr a.vdb && vol-render -t tf.json --size 4x4 -o b.exr b.vdb && vol-diff a.exr b.exr
