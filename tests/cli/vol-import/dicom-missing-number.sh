# slices of 1 x 1 without places, with the numbers 1, 2, 4
mkdir s
for n in 1 2 4; do
    {
        head -c 128 /dev/zero
        printf 'DICM\002\000\020\000UI\024\0001.2.840.10008.1.2.1\000'
        printf '\040\000\023\000IS\002\000%s \050\000\020\000US\002\000\001\000\050\000\021\000US\002\000\001\000' $n
        printf '\050\000\060\000DS\004\0001\\1 \050\000\000\001US\002\000\020\000\050\000\001\001US\002\000\020\000'
        printf '\050\000\002\001US\002\000\017\000\340\177\020\000OW\000\000\002\000\000\000%b\000' "\\00$n"
    } >s/$n
done
vol-import --no-history --spacing 1,1,1 -o a.vdb s
printf 'NRRD0004\ntype: float\ndimension: 3\nsizes: 1 1 3\nspacings: 1 1 1\nencoding: text\n\n1 2 4\n' >want.nrrd
vol-import --no-history -o want.vdb want.nrrd
vol-diff a.vdb want.vdb
