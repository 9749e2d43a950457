makevdb --voxel 1 >a.vdb
makevdb --voxel 2 >b.vdb
vol-diff --max 1000 a.vdb b.vdb
