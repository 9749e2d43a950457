# commas as well as blanks between samples in text
printf "NRRD0004\ntype: float\ndimension: 3\nsizes: 2 2 2\nencoding: text\n\n0, 1 ,2,3 4, 5\n6, 7\n" >a.nrrd
vol-import -o a.vdb a.nrrd
makevdb --field linear:1,2,4,0 >want.vdb
vol-diff a.vdb want.vdb
