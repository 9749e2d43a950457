echo '{"pellucid": "transfer-function/1", "scatter": [[-2, 0.5], [0, 0.5]]}' >tf.json
echo '{"pellucid": "transfer-function/1", "scatter": [[0, 0.5], [1, 0.5]]}' >up.json
makevdb --field linear:1,0,0,-1 >a.vdb
makevdb --field linear:1,0,0,0 >b.vdb
vol-render -t tf.json --size 4x4 -o a.exr a.vdb && vol-render -t up.json --size 4x4 -o b.exr b.vdb && vol-diff a.exr b.exr
