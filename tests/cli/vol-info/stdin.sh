makevdb >a.vdb
vol-info <a.vdb >1
vol-info - <a.vdb >2
cat a.vdb | vol-info >3
cmp 1 2 && cmp 1 3
