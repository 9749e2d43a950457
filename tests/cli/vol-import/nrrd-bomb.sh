# a few kilobytes that unpack to 8 GB are refused before the memory is taken
printf "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 2 2 2\nencoding: gzip\n\n" >a.nrrd
head -c 16777216 /dev/zero | gzip >part
for n in 1 2 3 4 5 6 7 8; do cat part part part part part part part part; done >parts
for n in 1 2 3 4 5 6 7 8; do cat parts; done >>a.nrrd
[ "$SANITIZED" = 1 ] && exit 77
ulimit -v 500000
vol-import -o a.vdb a.nrrd
