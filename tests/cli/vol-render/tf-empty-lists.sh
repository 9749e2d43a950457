echo '{"pellucid": "transfer-function/1", "scatter": [], "surface": [], "isosurfaces": []}' >tf.json
makevdb >a.vdb
vol-render -t tf.json --size 4x4 -o a.exr a.vdb || exit
makeexr 4x4 R=0 G=0 B=0 A=0 >black.exr
vol-diff a.exr black.exr
