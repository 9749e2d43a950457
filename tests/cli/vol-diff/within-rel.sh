makeexr 8x8 R=100 >a.exr
makeexr --poke 3,4,R=100.5 8x8 R=100 >b.exr
vol-diff --rel 0.01 a.exr b.exr
