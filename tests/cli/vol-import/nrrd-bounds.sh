# bounds without centers are those of cells
set -e
head="NRRD0004\ntype: uchar\ndimension: 3\nsizes: 2 2 2\nencoding: hex\n"
printf "${head}axis mins: 0 10 20\naxis maxs: 2 14 26\n\n00010203 04050607\n" >bounds.nrrd
printf "${head}space dimension: 3\nspace directions: (1,0,0) (0,2,0) (0,0,3)\nspace origin: (0.5,11,21.5)\n\n0001020304050607" >want.nrrd
vol-import --no-history -o a.vdb bounds.nrrd
vol-import --no-history -o want.vdb want.nrrd
vol-diff a.vdb want.vdb
