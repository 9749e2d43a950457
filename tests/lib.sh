# Sourced by shell tests that print TAP:
#
#     . "$TESTS/lib.sh"
#     check 'two runs give the same bytes' cmp a.exr b.exr
#     exits 3 'a cut file is refused' vol-render -t tf.json cut.vdb
#     finish
#
# `check NAME COMMAND...` passes if COMMAND succeeds; `exits CODE NAME COMMAND...` if it exits with CODE (what it wrote
# to stderr is then in the file `stderr`, stdout in `stdout`); `says PATTERN NAME` matches that stderr.
tap_count=0
tap_bad=0

passed() { tap_count=$((tap_count + 1)); echo "ok $tap_count - $1"; }
failed() { # NAME [file to quote]
    tap_count=$((tap_count + 1))
    tap_bad=$((tap_bad + 1))
    echo "not ok $tap_count - $1"
    shift
    for quoted in "$@"; do
        [ ! -s "$quoted" ] || head -n 8 "$quoted" | tr -d '\000' | cut -c 1-300 | sed 's/^/# /'
    done
}
skipped() { tap_count=$((tap_count + 1)); echo "ok $tap_count - $1 # SKIP $2"; }

check() {
    check_name=$1
    shift
    if "$@" >check.out 2>&1; then passed "$check_name"; else failed "$check_name" check.out; fi
}
check_not() {
    check_name=$1
    shift
    if "$@" >check.out 2>&1; then failed "$check_name" check.out; else passed "$check_name"; fi
}
exits() {
    exits_code=$1 exits_name=$2
    shift 2
    got=0
    "$@" >stdout 2>stderr || got=$?
    if [ "$got" = "$exits_code" ]; then passed "$exits_name"; else
        echo "exit code $got, expected $exits_code: $*" >why
        failed "$exits_name" why stderr
    fi
}
says() {
    said=$(cat stderr)
    # shellcheck disable=SC2254
    case $said in
    $1) passed "$2" ;;
    *) failed "$2" stderr ;;
    esac
}
# A command that must not fail for the test to make sense.
must() {
    "$@" || { echo "not ok $((tap_count + 1)) - set-up: $*"; echo "1..$((tap_count + 1))"; exit 1; }
}
finish() { echo "1..$tap_count"; [ "$tap_bad" = 0 ]; exit; }
