vol-gen field noise --size 32 --seed 3 -j1 -o a.vdb && vol-gen field noise --size 32 --seed 3 -j2 -o b.vdb && cmp a.vdb b.vdb &&
TZ=Asia/Tokyo LC_ALL=de_DE.UTF-8 TMPDIR=/nowhere vol-gen field noise --size 32 --seed 3 --cpu scalar | cmp - a.vdb
