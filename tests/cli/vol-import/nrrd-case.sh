# field names and words in any case
printf "NRRD0004\nTYPE: UChar\nDimension: 3\nSIZES: 2 2 2\nEncoding: RAW\nSpacings: 1 1 1\n\n\000\001\002\003\004\005\006\007" >a.nrrd
vol-import -o a.vdb a.nrrd
makevdb --field linear:1,2,4,0 >want.vdb
vol-diff a.vdb want.vdb
