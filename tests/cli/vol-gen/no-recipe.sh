vol-gen -o a.vdb
