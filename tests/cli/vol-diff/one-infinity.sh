makeexr --poke 7,7,R=inf 8x8 R=0.5 >a.exr
makeexr 8x8 R=0.5 >b.exr
vol-diff --max 1e30 --rel 1e30 b.exr a.exr
