# Somebody writes to a file while it is read: what was checked is what is used, and a file that is cut is an error.
[ "${SANITIZED:-0}" = 0 ] || exit 77
. "$TESTS/lib.sh"
shim=$OUT/tests/shims/changing_file.so

must vol-gen field noise --size 40 -o good.vdb
must vol-gen field noise --size 40 --compression zip --double -o zip.vdb
printf '%s\n' '{"pellucid": "transfer-function/1", "scatter": [[-1, 0.1], [1, 0.5, [1, 0.5, 0]]]}' >good.json
must vol-render -t good.json --size 40x40 -o good.exr good.vdb
must tf-preint --size 33 -o tables.exr good.json
must vol-info --plot good.png -o text good.vdb
head -c 65536 /dev/zero | tr '\000' 'a' >good.raw
{ printf 'NRRD0004\ntype: uchar\ndimension: 3\nsizes: 64 32 32\nencoding: gzip\n\n'; gzip -c good.raw; } >good.nrrd

# NAME, the file, then the command with @ for the copy that changes; its output is `out`
changed() {
    name=$1 file=$2
    shift 2
    for how in none cut cut-late scribble grow; do
        cp "$file" copy.in
        rm -f out
        LD_PRELOAD=$shim CHANGING_FILE=$PWD/copy.in CHANGING_HOW=$how "$@" -o out 2>stderr
        code=$?
        case $how in
        none) cp out want; check "$name" test $code = 0 ;;
        cut)
            check "$name: cut before it is read, exit 4" test $code = 4 -a ! -e out
            says "*: error: *'copy.in'*was cut*" "$name: cut, and says so" ;;
        *) check "$name: $how, the output of the file as it was read" cmp out want ;;
        esac
    done
}
changed 'vol-render, the volume' good.vdb vol-render -t good.json --size 20x20 copy.in
changed 'vol-render, zip and double' zip.vdb vol-render -t good.json --precise --size 20x20 copy.in
changed 'vol-render, the transfer function' good.json vol-render -t copy.in --size 20x20 good.vdb
changed 'vol-render, tables' tables.exr vol-render -t copy.in --estimator full --size 20x20 good.vdb
changed 'vol-render, a background' good.png vol-render -t good.json --background copy.in --size \
    "$(vol-info --json good.exr >/dev/null; od -An -tu1 -j16 -N8 good.png | awk '{ print $3 * 256 + $4 "x" $7 * 256 + $8 }')" good.vdb
changed 'vol-info, a volume' good.vdb vol-info --json copy.in
changed 'vol-info, a picture' good.exr vol-info --json copy.in
changed 'tf-preint, its volume' good.vdb tf-preint --size 33 --volume copy.in good.json
changed 'exr-join' good.exr exr-join copy.in
changed 'vol-import, raw' good.raw vol-import --dims 64,32,32 --type u8 copy.in
changed 'vol-import, packed' good.nrrd vol-import copy.in
finish
