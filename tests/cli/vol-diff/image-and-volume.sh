makevdb >a.vdb
makeexr 8x8 R=1 >b.exr
vol-diff a.vdb b.exr
