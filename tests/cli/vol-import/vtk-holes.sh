# What a VTK file lacks is no memory that nobody wrote: it is refused, and what is there comes out the same each time.
vti() { # WHOLE-EXTENT PIECES
    printf '<VTKFile type="ImageData"><ImageData WholeExtent="%s">%s</ImageData></VTKFile>\n' "$1" "$2"
}
piece() { # EXTENT NUMBERS
    printf '<Piece Extent="%s"><PointData Scalars="s"><DataArray type="Float32" Name="s">%s</DataArray></PointData></Piece>' "$1" "$2"
}
. "$TESTS/lib.sh"
front=$(piece '0 1 0 1 0 0' '0 1 2 3')
back=$(piece '0 1 0 1 1 1' '4 5 6 7')
vti '0 1 0 1 0 1' "$front" >hole.vti
vti '0 1 0 1 0 1' "$front<Piece Extent=\"0 1 0 1 1 1\"><PointData Scalars=\"s\"/></Piece>" >without.vti
vti '0 1 0 1 0 1' "$front$(piece '0 1 0 1 1 1' '4 5 6')" >short.vti
vti '0 1 0 1 0 1' '' >none.vti
vti '0 1 0 1 0 1' "$front$back" >whole.vti
legacy='# vtk DataFile Version 3.0\nt\nASCII\nDATASET STRUCTURED_POINTS\nDIMENSIONS 2 2 2\nPOINT_DATA 8\nSCALARS s float 1\nLOOKUP_TABLE default\n'
printf "${legacy}0 1 2 3 4 5 6\n" >short.vtk
printf "${legacy}0 1 2 3 4 5 6 7\n" >whole.vtk

while read -r file says; do
    exits 3 "$file is refused" vol-import -o no.vdb "$file"
    says "vol-import: error: cannot import '$file': $says" "$file: says what is missing"
done <<'END'
hole.vti array 's' (points) has no value at 0 0 1 of WholeExtent 0 1 0 1 0 1: no piece covers it
without.vti array 's' (points) has no value at 0 0 1 *: piece 2 (extent 0 1 0 1 1 1) is without the array
short.vti array 's' (points) of piece 2 (extent 0 1 0 1 1 1): truncated: it holds 3 of its 4 values
none.vti *there are none
short.vtk truncated after *: array 's' holds 7 of its 8 values
END
check_not 'no output of any' test -e no.vdb

must makevdb --field linear:1,2,4,0 >want.vdb
for file in whole.vti whole.vtk; do
    for fill in 0 85 170; do
        MALLOC_PERTURB_=$fill vol-import --no-history -f -o "$fill.vdb" "$file"
    done
    check "$file: the same bytes whatever lay in memory" cmp 0.vdb 85.vdb
    check "$file: and again" cmp 0.vdb 170.vdb
    check "$file: the values" vol-diff 0.vdb want.vdb
done
finish
