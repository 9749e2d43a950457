makevdb >a.vdb
vol-render -t a.vdb --size 4x4 -o a.exr a.vdb
