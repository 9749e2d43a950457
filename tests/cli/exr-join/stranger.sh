# other channels: not of this frame
makeexr --window 0,0,3,7 8x8 R=0.5 >a.exr
makeexr --window 4,0,7,7 8x8 G=0.5 >b.exr
exr-join -o j.exr a.exr b.exr
