echo '{"pellucid": "transfer-function/1", "scatter": [[0, 0.5], [1, 0.5]]}' >tf.json
makevdb >a.vdb
mkfifo p
cat tf.json >p &
vol-render -t p --size 4x4 -o a.exr a.vdb && vol-render -t tf.json --size 4x4 -o b.exr a.vdb && vol-diff a.exr b.exr
