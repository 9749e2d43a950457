# No threads to be had: exit 5 and no output, or the same output; never an abort.
[ "${SANITIZED:-0}" = 0 ] || exit 77
. "$TESTS/lib.sh"
shim=$OUT/tests/shims/few_threads.so

must vol-gen field torus --size 40 -o torus.vdb
printf '%s\n' '{"pellucid": "transfer-function/1", "scatter": [[-1, 0.1], [1, 0.5, [1, 0.5, 0]]]}' >tf.json
must vol-render -t tf.json --size 40x40 -o a.exr torus.vdb

# NAME, then the command; its output is `out`
starved() {
    name=$1
    shift
    must "$@" -o want
    bad='' refused=0
    for most in 0 1 2 3 4 5 6 7 8 9 10 11 12 20; do
        rm -f out
        LD_PRELOAD=$shim FEW_THREADS=$most "$@" -o out 2>why
        code=$?
        if [ $code = 5 ] && [ ! -e out ] && grep -q ': error: .*thread' why; then refused=$((refused + 1)); continue; fi
        [ $code = 0 ] && cmp -s out want || bad="$bad $most threads: exit $code;"
    done
    check "$name: refused or as ever ($bad)" test -z "$bad"
    check "$name: refused when there are none" test $refused -gt 0
}
starved 'vol-gen' vol-gen -j1 field torus --size 40
starved 'vol-gen, threads of its own' vol-gen -j3 field torus --size 40
starved 'vol-render' vol-render -j3 -t tf.json --size 40x40 torus.vdb
starved 'tf-preint' tf-preint -j3 --size 65 tf.json
starved 'exr-join' exr-join -j3 a.exr
starved 'vol-info, a plot' vol-info -j1 --plot plot.png torus.vdb
finish
