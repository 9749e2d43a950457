# Files of formats that are known but not read: the message names them.
. "$TESTS/lib.sh"
printf '<VTKFile type="PolyData"></VTKFile>' >a.vtp
printf '<?xml version="1.0"?><!-- %5000s -->\n<VTKFile version="1.0" type = "PImageData">' ' ' >a.pvti
gzip -n <a.pvti >b.pvti
printf '# vtk DataFile Version 3.0\nDATASET STRUCTURED_POINTS\nASCII\ndataset unstructured_grid\n' >a.vtk
printf 'CDF\001\000\000\000\000\000\000\000\012\000\000\000\001\000\000\000\007num_dim\000' >a.exo
printf '\211HDF\r\n\032\n\000\000 VTKHDF' >a.vtkhdf
printf 'FORMAT\ntype: ensight gold\n' >a.case
printf '2 2 2\n1 2 3\n' >a.xyz
while read -r file says; do
    exits 3 "$file is refused" vol-import -o no.vdb "$file"
    says "vol-import: error: cannot import '$file': $says not read in this version*" "$file: says what it is"
done <<'END'
a.vtp VTK files of kind 'PolyData' are
a.pvti VTK files of kind 'PImageData' are
b.pvti VTK files of kind 'PImageData' are
a.vtk VTK files of kind 'UNSTRUCTURED_GRID' are
a.exo it is an Exodus mesh (netCDF), which is
a.vtkhdf it is a VTKHDF file (HDF5), which is
a.case it is an EnSight case file, which is
a.xyz its name says PLOT3D, which is
END
exits 3 'two files' vol-import -o no.vdb a.xyz a.exo
says "vol-import: error: cannot import 'a.xyz': its name says PLOT3D*" 'two files: the first is named'
exits 3 'gzip, and a long comment' vol-info b.pvti
says "vol-info: error: *'b.pvti': it is .pvti (a VTK image in pieces), not VDB*" 'gzip, and a long comment: other programs know it'
check_not 'no output of any' test -e no.vdb
finish
