makevdb --name smoke --dims 3,4,5 >a.vdb
vol-info a.vdb >text
grep -q smoke text && grep -q -E "3.*4.*5" text
