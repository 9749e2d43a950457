# slices of 1 x 1 at z = 9, 12, 15, 21: the one at 18 is missing
mkdir s
for z in 09 12 15 21; do
    {
        head -c 128 /dev/zero
        printf 'DICM\002\000\020\000UI\024\0001.2.840.10008.1.2.1\000'
        printf '\040\000\062\000DS\006\0007\\8\\%s\050\000\020\000US\002\000\001\000\050\000\021\000US\002\000\001\000' $z
        printf '\050\000\060\000DS\004\0001\\1 \050\000\000\001US\002\000\020\000\050\000\001\001US\002\000\020\000'
        printf '\050\000\002\001US\002\000\017\000\340\177\020\000OW\000\000\002\000\000\000\005\000'
    } >s/$z
done
vol-import --no-history --fill-gaps -o a.vdb s
printf 'NRRD0004\ntype: float\ndimension: 3\nspace dimension: 3\nsizes: 1 1 5\nspace directions: (1,0,0) (0,1,0) (0,0,3)\n' >want.nrrd
printf 'space origin: (7,8,9)\nencoding: text\n\n5 5 5 nan 5\n' >>want.nrrd
vol-import --no-history -o want.vdb want.nrrd
vol-info a.vdb | grep -v argsHash >a.txt
vol-info want.vdb | grep -v argsHash >want.txt
cmp a.txt want.txt || exit 1
vol-import -o b.vdb s
