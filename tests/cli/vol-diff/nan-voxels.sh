makevdb --field nan >a.vdb
cp a.vdb b.vdb
vol-diff --max 1000 a.vdb b.vdb
