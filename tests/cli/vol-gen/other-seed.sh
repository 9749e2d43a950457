vol-gen field noise --size 32 --seed 3 -o a.vdb && vol-gen field noise --size 32 --seed 4 -o b.vdb || exit 9
vol-diff a.vdb b.vdb
