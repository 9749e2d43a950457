makeexr --window 0,0,4,7 8x8 R=0.5 >a.exr
makeexr --window 4,0,7,7 8x8 R=0.5 >b.exr
exr-join -o j.exr a.exr b.exr
