# One allocation fails, whoever makes it: exit 5 and no output, or the very same output.  The loader's own end is exit
# 127, of libraries that it is about to bind.
[ "${SANITIZED:-0}" = 0 ] || exit 77
. "$TESTS/lib.sh"
shim=$OUT/tests/shims/fail_malloc.so

must vol-gen field torus --size 12 --compression zip -o torus.vdb
must vol-gen field torus --size 12 -o blosc.vdb
# The comma behind the long number is where jansson asks for more room, and asserts that it gets it.
printf '%s\n' '{"pellucid": "transfer-function/1", "scatter": [[0, 0], [1, 0.50000000000000000000000000000, [1, 0.5, 0]]],' \
    ' "surface": [[0.2, 0], [0.4, 0.5], [0.6, 0]], "isosurfaces": [{"value": 0.5, "opacity": 0.5}]}' >tf.json
must vol-render -t tf.json --size 4x4 -o a.exr torus.vdb
{ printf 'NRRD0004\ntype: uchar\ndimension: 3\nsizes: 8 8 8\nencoding: gzip\n\n'; head -c 512 /dev/zero | gzip -c; } >a.nrrd

# NAME, EVERY how many, then the command; its output is `out`
refused() {
    name=$1 step=$2
    shift 2
    rm -f out stats
    LD_PRELOAD=$shim FAIL_MALLOC_COUNT=$PWD/count "$@" -o want 2>why || { check "$name: runs" false; return; }
    made=$(cat count) n=1 bad='' fives=0
    while [ "$n" -le "$made" ]; do
        rm -f out
        LD_PRELOAD=$shim FAIL_MALLOC=$n "$@" -o out >stdout 2>why
        code=$?
        if [ $code = 5 ] && [ ! -e out ] && ! grep -q damaged why; then
            fives=$((fives + 1))
        elif [ $code = 0 ] && cmp -s out want; then
            :
        elif [ $code != 127 ] || [ -e out ]; then
            bad="$bad allocation $n of $made: exit $code $(head -c 100 why);"
        fi
        n=$((n + step))
    done
    check "$name: exit 5 or the same output ($(printf %.400s "$bad"))" test -z "$bad"
    check "$name: most are refused" test $fives -gt $((made / step / 4))
}
refused 'exr-join' 1 exr-join -j1 a.exr
refused 'tf-preint' 1 tf-preint -j1 --size 9 tf.json
refused 'vol-info, a volume' 1 vol-info --json torus.vdb
refused 'vol-info, a picture' 1 vol-info --json a.exr
refused 'vol-info, as text' 1 vol-info torus.vdb
refused 'vol-info, Blosc' 2 vol-info --json blosc.vdb
refused 'vol-render, Blosc' 3 vol-render -j2 -t tf.json --size 4x4 blosc.vdb
refused 'vol-render' 3 vol-render -j1 -t tf.json --size 4x4 --aov Z,normal torus.vdb
refused 'vol-gen, zip' 1 vol-gen -j1 field torus --size 12 --compression zip
refused 'vol-gen, Blosc' 5 vol-gen -j1 field torus --size 12
refused 'vol-import, packed' 3 vol-import -j1 --compression none a.nrrd

# a run's stats have every number, or there are none
rm -f want
LD_PRELOAD=$shim FAIL_MALLOC_COUNT=$PWD/count exr-join -j1 --stats s.json -o want a.exr
bad=''
made=$(cat count) n=1
while [ "$n" -le "$made" ]; do
    rm -f out s2.json
    LD_PRELOAD=$shim FAIL_MALLOC=$n exr-join -j1 --stats s2.json -o out a.exr 2>why
    code=$?
    if [ $code = 0 ]; then
        [ "$(tr -d '0-9.e-' <s2.json)" = "$(tr -d '0-9.e-' <s.json)" ] || bad="$bad $n"
    elif [ $code != 5 ] || [ -e out ]; then
        bad="$bad $n: $code"
    fi
    n=$((n + 1))
done
check "stats are whole or not there ($bad)" test -z "$bad"

# an address space that is too small: said, with exit 5
for kilobytes in 20000 30000 40000 60000 80000 100000 150000; do
    for job in 'vol-gen -j1 field torus --size 64' 'vol-render -j1 -t tf.json --size 256x256 torus.vdb' \
        'vol-info --plot p.png torus.vdb' 'exr-join -j1 a.exr' 'tf-preint -j1 tf.json'; do
        rm -f out p.png
        # shellcheck disable=SC2086
        (ulimit -v $kilobytes; exec $job -o out) >stdout 2>why
        code=$?
        { [ $code = 0 ] && [ -s out ]; } || { [ $code = 5 ] && [ ! -e out ]; } || [ $code = 127 ] ||
            check "$job with $kilobytes kB ends with 0 or 5 (exit $code: $(head -c 200 why))" false
    done
done
finish
