makeexr --window 0,0,3,7 8x8 R=0.5 >a.exr
makeexr --window 4,0,7,7 8x8 R=0.5 >b.exr
makeexr 8x8 R=0.5 >whole.exr
exr-join -o j.exr a.exr b.exr && exr-join b.exr a.exr >k.exr && cmp j.exr k.exr && vol-diff j.exr whole.exr
