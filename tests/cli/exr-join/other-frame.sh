makeexr --window 0,0,3,7 8x8 R=0.5 >a.exr
makeexr --window 4,0,8,7 9x8 R=0.5 >b.exr
exr-join -o j.exr a.exr b.exr
