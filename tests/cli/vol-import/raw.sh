# eight voxels 0 .. 7, x fastest
printf "\000\001\002\003\004\005\006\007" >a.raw
vol-import --dims 2,2,2 --type u8 -o a.vdb a.raw
makevdb --field linear:1,2,4,0 >want.vdb
vol-diff a.vdb want.vdb
