makeexr 8x8 R=0.5 >a.exr
makeexr --poke 3,4,R=0.51 8x8 R=0.5 >b.exr
vol-diff --max 0.009 a.exr b.exr
