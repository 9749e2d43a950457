echo '{"pellucid": "transfer-function/1", "scatter": [[0, 0.5], [1, 0.5]]}' >tf.json
makevdb --field nan >a.vdb
vol-render -t tf.json --size 4x4 -o a.exr a.vdb || exit
makeexr 4x4 R=0 G=0 B=0 A=0 >want.exr
vol-diff a.exr want.exr >report || exit 9
