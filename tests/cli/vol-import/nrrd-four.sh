# space and time in vectors of four numbers
set -e
printf "NRRD0004\ntype: uchar\ndimension: 4\nspace dimension: 4\nsizes: 2 2 2 2\nencoding: raw\n" >a.nrrd
printf "space directions: (1,0,0,0) (0,1,0,0) (0,0,1,0) (0,0,0,1)\nspace origin: (0,0,0,7)\n\n" >>a.nrrd
printf "\000\001\002\003\004\005\006\007\001\002\003\004\005\006\007\010" >>a.nrrd
makevdb --field linear:1,2,4,0 >want.vdb
vol-import -q -o a.vdb a.nrrd
vol-diff a.vdb want.vdb
makevdb --field linear:1,2,4,1 >want.vdb
vol-import -f -o a.vdb --time-step 1 a.nrrd
vol-diff a.vdb want.vdb
