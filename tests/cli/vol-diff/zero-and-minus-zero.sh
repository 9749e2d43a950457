makeexr 8x8 R=0 >a.exr
makeexr 8x8 R=-0 >b.exr
vol-diff a.exr b.exr
