# Allocations of small jobs made to fail, every third once: exit 5, no output, nothing left behind.  Needs a build with the hook in
# it (the sanitizer builds have it).
[ "${SANITIZED:-0}" = 1 ] || exit 77
. "$TESTS/lib.sh"
ASAN_OPTIONS=exitcode=99:detect_leaks=0 # hundreds of runs: leaks are looked for elsewhere

vol-gen field torus --size 12 -o torus.vdb || exit
printf '%s\n' '{"pellucid": "transfer-function/1", "scatter": [[0, 0], [1, 0.5, [1, 0.5, 0]]],' \
    ' "surface": [[0.2, 0], [0.4, 0.5], [0.6, 0]], "isosurfaces": [{"value": 0.5, "opacity": 0.5}]}' >tf.json
vol-render -t tf.json --size 4x4 -o a.exr torus.vdb || exit

# $1: name of the job; then the command, whose output is `out`
fail_each() {
    job=$1 n=1
    shift
    while [ "$n" -lt 1500 ]; do
        rm -f out
        VOL_FAULT=malloc:$n "$@" 2>why
        code=$?
        [ "$code" = 0 ] && break
        if [ "$code" != 5 ] || [ -e out ] || [ -n "$(find . -name '.*.vol-*')" ]; then
            check "$job: allocation $n fails with exit 5 and no output (exit $code: $(head -c 200 why))" false
            return
        fi
        n=$((n + 3))
    done
    check "$job: each third of $((n - 1)) allocations failed once" test "$n" -gt 5 -a "$n" -lt 1500
}

fail_each vol-gen vol-gen field sphere --size 9 -o out
fail_each vol-render vol-render -j1 -t tf.json --size 4x4 --aov Z,normal -o out torus.vdb
fail_each "vol-render, full" vol-render -j1 -t tf.json --size 4x4 --estimator full -o out torus.vdb
fail_each tf-preint tf-preint -j1 --size 9 -o out tf.json
fail_each exr-join exr-join -o out a.exr
fail_each vol-info vol-info --json -o out a.exr
finish
