makevdb --dims 9,9,9 --field noise:1 >a.vdb
makevdb --dims 9,9,9 --field noise:1 --poke 4,4,4,0.5 >b.vdb
vol-diff a.vdb b.vdb
