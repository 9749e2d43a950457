# What is of the wrong kind is named for what it is, by every program that is given it.
. "$TESTS/lib.sh"
vol-gen field sphere --size 8 -o a.vdb 2>/dev/null || vol-gen field "$(vol-gen --list | head -n 1 | cut -d ' ' -f 1)" --size 8 -o a.vdb
cp "$EXAMPLES"/tf/glass.json tf.json
vol-render -t tf.json --size 8x8 -o a.exr a.vdb
printf '<VTKFile type="UnstructuredGrid"></VTKFile>' >a.vtu
printf "<?xml version='1.0'?>\n<VTKFile version = '1.0' type='PPolyData'></VTKFile>" >a.pvtp
printf '# vtk DataFile Version 3.0\nt\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 0 float\n' >mesh.vtk
printf '# vtk DataFile Version 3.0\nt\nBINARY\n\ndataset polydata\nPOINTS 0 float\n' >poly.vtk
printf 'NRRD0004\ntype: float\ndimension: 3\nsizes: 1 1 1\nencoding: text\n\n1\n' >a.nrrd
printf '\211PNG\r\n\032\n0000IHDR' >a.png
printf '\3757zXZ\000abcdef' >a.xz
printf '\050\265\057\375abcdef' >a.zst
printf 'PK\003\004abcdef' >a.zip
printf '\377\330\377\340abcdef' >a.jpg
printf 'II*\000abcdef' >a.tif
printf '<?xml version="1.0"?>\n<VoreenData version="1"><Volumes><VolumeHandle/></Volumes></VoreenData>' >a.vvd
printf 'CDF\001\000\000\000\000\000\000\000\012\000\000\000\001\000\000\000\007num_dim\000' >a.exo
{ printf '\002\000\000\000\002\000\000\000\002\000\000\000'; head -c 96 /dev/zero; } >a.p3d

while read -r file says; do
    exits 3 "vol-import $file" vol-import -o no.vdb "$file"
    says "vol-import: error: cannot import '$file': $says" "vol-import $file: says what it is"
done <<'END'
a.exr it is an EXR image, no volume*vol-info*
tf.json it is JSON, no volume*vol-render -t*tf-preint*
a.png it is a PNG image, no volume
a.jpg it is a JPEG image, no volume
a.tif it is a TIFF image, no volume
a.vvd it describes a volume (.vvd): import the raw file*--dims*
a.xz it is packed by xz: unpack it first (xz -d)
a.zst it is packed by zstd: unpack it first (zstd -d)
a.zip it is a ZIP archive: unpack it first
a.vtu VTK files of kind 'UnstructuredGrid' are not read*
END
while read -r file says; do
    said_of=${says%%, not*}
    exits 3 "vol-render $file" vol-render -t tf.json -o no.exr "$file"
    says "vol-render: error: cannot read '$file': it is $says" "vol-render $file: says what it is"
    exits 3 "vol-info $file" vol-info "$file"
    says "vol-info: error: cannot inspect '$file': it is ${says%not VDB*}not VDB or EXR*" "vol-info $file: says what it is"
    exits 3 "exr-join $file" exr-join -o no.exr "$file"
    says "exr-join: error: cannot join '$file': it is ${says%not VDB*}not an EXR image*" "exr-join $file: says what it is"
    exits 3 "-t $file" vol-render -t "$file" -o no.exr a.vdb
    says "vol-render: error: bad transfer function '$file': it is *${said_of}*" "-t $file: says what it is"
    exits 3 "tf-preint $file" tf-preint -o no.exr "$file"
    says "tf-preint: error: bad transfer function '$file': it is *${said_of}*" "tf-preint $file: says what it is"
done <<'END'
a.vtu .vtu (a VTK unstructured grid), not VDB: vol-import does not read it in this version
a.pvtp .pvtp (VTK polygons), not VDB: vol-import does not read it in this version
mesh.vtk legacy .vtk (an unstructured grid), not VDB: vol-import does not read it in this version
poly.vtk legacy .vtk (polygons), not VDB: vol-import does not read it in this version
a.nrrd NRRD, not VDB: vol-import makes a VDB of it
a.png a PNG image, not VDB
a.xz packed by xz, not VDB: unpack it first (xz -d)
a.exo an Exodus mesh (netCDF), not VDB: vol-import does not read it in this version
a.p3d laid out as PLOT3D, not VDB: vol-import does not read it in this version
END
exits 3 'vol-info of .vvd' vol-info a.vvd
says "vol-info: error: cannot inspect 'a.vvd': it describes a volume (.vvd), not VDB or EXR: import the raw file*" '.vvd: says what it is'
exits 3 'exr-join of a VDB' exr-join -o no.exr a.vdb
says "exr-join: error: cannot join 'a.vdb': it is a VDB volume, not an EXR image" 'exr-join of a VDB: says what it is'
finish
