echo '{"pellucid": "transfer-function/1", "scatter": [[0, 0.5], [1, 0.5]]}' >tf.json
makevdb >a.vdb
vol-render -t tf.json --size 4x4 --eye 0,0,5 --look-at 0,0,9 --background 0.25,0.5,0.75 -o a.exr a.vdb || exit
makeexr 4x4 R=0.25 G=0.5 B=0.75 A=0 >want.exr
vol-diff a.exr want.exr >report || exit 9
