makevdb --dims 9,9,9 --field noise:1 >a.vdb
makevdb --dims 9,9,9 --field noise:1 >b.vdb
vol-diff a.vdb b.vdb
