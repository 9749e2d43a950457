# what writers that know no voxel size leave: a cell of 0
{ printf "\002\000\000\000\002\000\000\000\002\000\000\000\000\000\000\000"; head -c 12 /dev/zero
  printf "\002\000\000\000\002\000\000\000\002\000\000\000"; head -c 24 /dev/zero
  printf "\001\000\000\000\002\000\000\000\003\000\000\000"; head -c 132 /dev/zero; printf "MAP D\104\000\000"
  head -c 808 /dev/zero; printf "\000\001\002\003\004\005\006\007"; } >a.mrc
vol-import -o a.vdb a.mrc
vol-import -q --spacing 1,1,1 a.mrc >given.vdb
makevdb --field linear:1,2,4,0 >want.vdb
vol-diff a.vdb want.vdb
vol-diff given.vdb want.vdb
