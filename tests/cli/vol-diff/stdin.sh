makeexr 8x8 R=1 >b.exr
vol-diff - b.exr <b.exr
