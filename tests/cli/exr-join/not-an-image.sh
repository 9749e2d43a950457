makevdb >a.vdb
exr-join -o j.exr a.vdb
