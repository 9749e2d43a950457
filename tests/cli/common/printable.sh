# Whatever bytes there are in names of files, grids, keys and fields: messages are text.  Valid UTF-8 stays.
. "$TESTS/lib.sh"
bytes() { printf "$1"; }
raw=$(bytes 'a\377\033[31m\302\233\303\251b')
shown=$(bytes 'a\\\\xff\\\\x1b\\[31m\\\\xc2\\\\x9b\303\251b')
is_text() { # NAME PATTERN COMMAND... : it says PATTERN, in printable characters alone
    name=$1 pattern=$2
    shift 2
    "$@" >stdout 2>stderr
    says "$pattern" "$name"
    check "$name: text" sh -c 'tr -d "\n\040-\176" <stderr | tr -d "\303\251" | cmp - /dev/null'
}
name=$(bytes 'g\377\302\233\303\251b')
must makevdb --name "$name" >grid.vdb
must makevdb --name "$name" --empty >empty.vdb
echo '{"pellucid": "transfer-function/1", "scatter": [[0, 0.5], [1, 0.5]]}' >tf.json
is_text 'a grid' "*it holds $(bytes 'g\\\\xff\\\\xc2\\\\x9b\303\251b') *" vol-render -t tf.json --grid other -o out.exr grid.vdb
is_text 'in a warning' "*'$(bytes 'g\\\\xff\\\\xc2\\\\x9b\303\251b')' is empty*" vol-render -t tf.json -o out.exr --size 2x2 empty.vdb
is_text 'an option' "*no grid '$shown' *" vol-render -t tf.json --grid "$raw" -o out.exr grid.vdb
is_text 'a file' "*'$shown'*" vol-info "$raw"
printf '{"pellucid": "transfer-function/1", "k\\u009b\\u0007\303\251": 1}' >key.json
is_text 'a key' "*key '$(bytes 'k\\\\xc2\\\\x9b\\\\x07\303\251')'*" vol-render -t key.json grid.vdb
printf '{"pellucid": "transfer-function/1", "model": "\\u001b[1m"}' >value.json
is_text 'a value' "*'\\\\x1b\\[1m' is none of*" vol-render -t value.json grid.vdb
printf '{"pellucid": "transfer-function/1", "\377": 1}' >broken.json
is_text 'no UTF-8' '*line 1*' vol-render -t broken.json grid.vdb
printf 'NRRD0004\ntype: f\351\001loat\n' >field.nrrd
is_text 'a field of a NRRD' "*'type: f\\\\xe9\\\\x01loat'*" vol-import field.nrrd
printf 'ObjectType = Image\nNDims = 3\nDimSize = 2 2 2\nElementType = MET_\377\nElementDataFile = LOCAL\n' >field.mha
is_text 'a field of a MetaImage' "*MET_\\\\xff*" vol-import field.mha
printf '# vtk DataFile Version 3.0\nt\nBINARY\nDATASET \377\033\n' >field.vtk
is_text 'a word of VTK' "*\\\\xff\\\\x1b*" vol-import field.vtk
makevdb >a.vdb
vol-diff grid.vdb a.vdb >said
cp said stderr
says "*$(bytes 'g\\\\xff\\\\xc2\\\\x9b\303\251b')*" 'a report'
finish
