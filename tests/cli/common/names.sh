# An output whose name promises another format: written all the same, with a warning.
. "$TESTS/lib.sh"
makevdb --dims 8,8,8 >a.vdb
makeexr 4x4 R=1 G=1 B=1 >a.exr
head -c 8 /dev/zero >a.raw
echo '{"pellucid": "transfer-function/1", "scatter": [[0, 0.5], [1, 0.5]]}' >tf.json

# warns FILE FORMATS COMMAND...
warns() {
    name=$1 formats=$2
    shift 2
    exits 0 "$*" "$@"
    says "*: warning: what is written to '$name' is $formats*" "$name: the warning"
    check "$name: it is there" test -s "$name"
}
silent() { exits 0 "$*" "$@" && check "$*: says nothing" test ! -s stderr; }

warns x.png 'EXR, not PNG: vol-info --plot makes a PNG of it' vol-render -t tf.json --size 4x4 -o x.png a.vdb
warns X.JPG 'EXR, not JPEG' vol-render -t tf.json --size 4x4 -o X.JPG a.vdb
warns x.vdb 'EXR, not VDB' vol-render -t tf.json --size 4x4 -o x.vdb a.vdb
warns j.png 'EXR, not PNG' exr-join -o j.png a.exr
warns d.tiff 'EXR, not TIFF' vol-diff -o d.tiff a.exr a.exr
warns t.json 'EXR, not JSON' tf-preint --size 8 -o t.json tf.json
warns t.jpg 'PNG, not JPEG' tf-preint --size 8 --plot t.jpg -o t.exr tf.json
warns g.vdb.gz 'VDB, not gzip' vol-gen field ramp --size 8 -o g.vdb.gz
warns i.nii 'VDB, not NIfTI' vol-import --dims 2,2,2 --type u8 -o i.nii a.raw
warns p.exr 'PNG, not EXR' vol-info --plot p.exr a.exr

silent vol-render -t tf.json --size 4x4 -o good.exr a.vdb
silent vol-render -t tf.json --size 4x4 -o GOOD.EXR a.vdb
silent vol-render -t tf.json --size 4x4 -o no-ending a.vdb
silent vol-render -t tf.json --size 4x4 -o new.kind a.vdb
silent vol-render -q -t tf.json --size 4x4 -o quiet.png a.vdb
silent vol-info --plot p.png a.exr
finish
