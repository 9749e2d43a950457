makeexr --window 0,0,3,3 8x8 R=0.5 >a.exr
makeexr --window 4,4,7,7 8x8 R=0.5 >b.exr
vol-diff --max 1000 a.exr b.exr
