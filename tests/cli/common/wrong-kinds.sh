# Inputs of another kind than is wanted: the message says what they are and what makes the right thing of them.
. "$TESTS/lib.sh"
echo '{"pellucid": "transfer-function/1", "scatter": [[0, 0.5], [1, 0.5]]}' >tf.json
must makevdb >a.vdb
must makeexr 4x4 R=1 >a.exr

# A volume of another format, by its first bytes: text headers and samples.
printf 'NRRD0004\ntype: uchar\ndimension: 3\nsizes: 2 2 2\nencoding: raw\n\n01234567' >a.nrrd
printf '# vtk DataFile Version 3.0\nt\nASCII\nDATASET STRUCTURED_POINTS\n' >a.vtk
printf '<?xml version="1.0"?>\n<VTKFile type="ImageData"></VTKFile>\n' >a.vti
printf 'ObjectType = Image\nNDims = 3\nElementDataFile = LOCAL\n' >a.mha
{ head -c 128 /dev/zero; printf DICM; head -c 64 /dev/zero; } >a.dcm
# NIfTI: its size, 348, then its magic at 344.
{ printf '\134\001\000\000'; head -c 340 /dev/zero; printf 'n+1\000'; head -c 16 /dev/zero; } >a.nii
gzip -n <a.nii >a.nii.gz

while read -r file format; do
    exits 3 "$file to vol-render" vol-render -t tf.json -o x.exr "$file"
    says "vol-render: error: cannot read '$file': it is $format, not VDB: vol-import *" "$file to vol-render: names vol-import"
    exits 3 "$file to tf-preint" tf-preint --volume "$file" -o x.exr tf.json
    says "tf-preint: error: *'$file': it is $format*vol-import *" "$file to tf-preint: names vol-import"
    exits 3 "$file to vol-info" vol-info "$file"
    says "vol-info: error: *'$file': it is $format*vol-import *" "$file to vol-info: names vol-import"
    exits 3 "$file to vol-diff" vol-diff "$file" a.vdb
    says "vol-diff: error: *'$file': it is $format*vol-import *" "$file to vol-diff: names vol-import"
    exits 3 "$file to -t" vol-render -t "$file" -o x.exr a.vdb
    says "vol-render: error: bad transfer function '$file': it is a volume*$format*" "$file to -t: says that it is a volume"
done <<'END'
a.nrrd NRRD
a.nii NIfTI
a.nii.gz NIfTI
a.vtk legacy .vtk
a.vti .vti
a.mha MetaImage
a.dcm DICOM
END

exits 3 'VDB to -t' vol-render -t a.vdb -o x.exr a.vdb
says "vol-render: error: bad transfer function 'a.vdb': it is a VDB volume*" 'VDB to -t: says so'
exits 3 'VDB to tf-preint' tf-preint -o x.exr a.vdb
says "tf-preint: error: bad transfer function 'a.vdb': it is a VDB volume*" 'VDB to tf-preint: says so'
exits 3 'an image to vol-render' vol-render -t tf.json -o x.exr a.exr
says "vol-render: error: *'a.exr': it is an EXR image, not VDB*" 'an image to vol-render: says so'
exits 3 'JSON to vol-render' vol-render -t tf.json -o x.exr tf.json
says "vol-render: error: *'tf.json': it is JSON, not VDB*" 'JSON to vol-render: says so'
exits 3 'VDB to vol-import' vol-import a.vdb
says "vol-import: error: *'a.vdb': it is VDB already" 'VDB to vol-import: says so'
echo '<?xml version="1.0"?><VoreenData version="1"><Volumes><Volume><RawData filename="a.raw" format="UINT8" x="2" y="2" z="2"/>
    </Volume></Volumes></VoreenData>' >a.vvd
exits 3 '.vvd to -t' vol-render -t a.vvd -o x.exr a.vdb
says "vol-render: error: bad transfer function 'a.vvd': it describes a volume (.vvd)*vol-import*" '.vvd to -t: says so'
check_not 'no output of any' test -e x.exr

# The last program of a pipe whose others failed is the one that is heard.
for program in 'vol-info' 'vol-import' 'vol-render -t tf.json -o x.exr' 'vol-diff a.vdb -' 'tf-preint -o x.exr' 'exr-join a.exr -' \
    'vol-render -t - -o x.exr a.vdb'; do
    exits 3 "nothing from the pipe: $program" sh -c "false | $program"
    says "*: error: cannot read 'stdin': it ended before its first byte*" "says that its input ended: $program"
done
exits 3 'half a volume' sh -c 'head -c 300 a.vdb | vol-info'
says "vol-info: error: damaged VDB 'stdin'*end early?*" 'half a volume from the pipe'
exits 3 'a few bytes' sh -c 'head -c 5 a.vdb | vol-info'
says "vol-info: error: *'stdin': it ends early, after 5 bytes" 'a few bytes from the pipe'
: >empty
exits 3 'an empty file' vol-render -t tf.json -o x.exr empty
says "vol-render: error: cannot read 'empty': it is empty" 'an empty file: says so'
finish
