# packed samples are unpacked first, and --header counts in what was unpacked
set -e
makevdb --field linear:1,2,4,0 >want.vdb
for packer in gzip bzip2; do
    printf "ab\000\001\002\003\004\005\006\007" | $packer >a.packed
    vol-import --dims 2,2,2 --type u8 --header 2 -f -o a.vdb a.packed
    vol-diff a.vdb want.vdb
    vol-import --dims 2,2,2 --type u8 --header 2 -f -o a.vdb <a.packed
    vol-diff a.vdb want.vdb
    printf "ab\000\001\002\003" | $packer >s.1
    printf "ab\004\005\006\007" | $packer >s.2
    vol-import --dims 2,2 --type u8 --header 2 --slices 1:2 -f -o a.vdb s.%d
    vol-diff a.vdb want.vdb
done
