# Binary is never written to a terminal nor waited for from one, unless --force says so.
. "$TESTS/lib.sh"
makevdb >a.vdb
makeexr 4x4 R=1 >a.exr
echo '{"pellucid": "transfer-function/1", "scatter": [[0, 0.5], [1, 0.5]]}' >tf.json

refused() { # NAME COMMAND...
    exits 2 "$1: refused" "$@"
    says "$1: error: *terminal*" "$1 says why"
    check_not "$1 writes nothing" test -s stdout
}
refused vol-gen --fake-tty out field constant --size 4
refused vol-render --fake-tty out -t tf.json --size 8x8 a.vdb
refused exr-join --fake-tty out a.exr
exits 0 'vol-gen --force' vol-gen --fake-tty out --force field constant --size 4
check 'vol-gen --force writes' test -s stdout
exits 0 'text may go to a terminal' vol-info --fake-tty out a.vdb
exits 0 '-o FILE is not a terminal' vol-gen --fake-tty out field constant --size 4 -o b.vdb

waits() { # NAME COMMAND...
    exits 2 "$1: does not wait for a terminal" "$@"
    says "$1: error: *terminal*" "$1 says why it does not wait"
}
waits vol-info --fake-tty in
waits vol-render --fake-tty in -t tf.json -o c.exr
waits vol-diff --fake-tty in - a.exr
check_not 'nothing was rendered' test -e c.exr

# Progress: not unless stderr is a terminal or it is asked for.
exits 0 'no progress' vol-render -t tf.json --size 64x64 -o c.exr a.vdb
check_not 'none was shown' test -s stderr
exits 0 '--progress always' vol-render -t tf.json --size 64x64 --progress always -o c.exr a.vdb
finish
