makeexr 8x8 R=0.5 >a.exr
makeexr 8x9 R=0.5 >b.exr
vol-diff --max 1000 a.exr b.exr
