makeexr 8x8 R=0.5 >a.exr
makeexr --poke 3,4,R=0.5000001 8x8 R=0.5 >b.exr
vol-diff a.exr b.exr
