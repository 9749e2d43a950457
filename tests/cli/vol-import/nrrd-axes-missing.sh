printf "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 2 2 2\nspacings: 1 2\nencoding: raw\n\n01234567" >a.nrrd
vol-import -o a.vdb a.nrrd
