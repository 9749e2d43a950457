makeexr 8x8 R=1 >b.exr
vol-diff --max -1 b.exr b.exr
