# data files beside the header, each compressed by itself
set -e
mkdir there
for encoding in gzip bzip2; do
    printf "\000\001\002\003" | $encoding >there/s.1
    printf "\004\005\006\007" | $encoding >there/s.2
    printf "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 2 2 2\nencoding: $encoding\n" >there/head
    { cat there/head; printf "data file: LIST 2\ns.1\ns.2\n"; } >there/list.nhdr
    { cat there/head; printf "data file: s.%%d 1 2 1 2\n"; } >there/pattern.nhdr
    makevdb --field linear:1,2,4,0 >want.vdb
    for form in list pattern; do
        vol-import -f -o a.vdb there/$form.nhdr
        vol-diff a.vdb want.vdb
    done
done
