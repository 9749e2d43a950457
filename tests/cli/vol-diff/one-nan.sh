makeexr --poke 7,7,R=nan 8x8 R=0.5 >a.exr
makeexr 8x8 R=0.5 >b.exr
vol-diff --max 1000 b.exr a.exr
