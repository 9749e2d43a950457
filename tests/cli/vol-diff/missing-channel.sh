makeexr 8x8 R=0.5 A=0 >a.exr
makeexr 8x8 R=0.5 >b.exr
vol-diff --max 1000 a.exr b.exr
