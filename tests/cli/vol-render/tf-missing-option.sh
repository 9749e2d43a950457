makevdb >a.vdb
vol-render --size 4x4 -o a.exr a.vdb
