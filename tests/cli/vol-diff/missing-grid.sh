makevdb --also --name heat >a.vdb
makevdb >b.vdb
vol-diff --max 1000 a.vdb b.vdb
