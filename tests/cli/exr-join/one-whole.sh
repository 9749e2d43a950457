makeexr 8x8 R=0.5 >a.exr
exr-join -o j.exr a.exr && vol-diff a.exr j.exr
