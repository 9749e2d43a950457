makeexr 8x8 R=0.5 A=1 >a.exr
cp a.exr b.exr
vol-diff a.exr b.exr
