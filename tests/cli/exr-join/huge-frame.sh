# Two crops of 8 x 8 pixels in a frame of 1e18: the hole is named at once.
makeexr --window 0,0,7,7 --display 0,0,1000000000,1000000000 8x8 R=1 >a.exr
makeexr --window 8,0,15,7 --display 0,0,1000000000,1000000000 8x8 R=1 >b.exr
timeout 20 exr-join -o joined.exr a.exr b.exr
