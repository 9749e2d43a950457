# Out of memory: exit 5, a message, no output.
. "$TESTS/lib.sh"
if [ "$SANITIZED" = 1 ]; then
    echo '1..0 # sanitizers need the address space'
    exit 0
fi
makevdb >a.vdb
makeexr 4x4 R=1 >a.exr
echo '{"pellucid": "transfer-function/1", "scatter": [[0, 0.5], [1, 0.5]]}' >tf.json

limited() { # KILOBYTES COMMAND...
    ( ulimit -v "$1"; shift; exec "$@" )
}
exits 5 'vol-render, an image of 26 GB' limited 2000000 vol-render -t tf.json --size 40000x40000 -o big.exr a.vdb
says 'vol-render: error: *memory*' 'says so'
check_not 'writes nothing' test -e big.exr
exits 5 'vol-gen, a volume of 32 GB' limited 1000000 vol-gen field noise --size 2000 -j1 -o big.vdb
says 'vol-gen: error: *memory*' 'vol-gen says so'
check 'nothing is left' test -z "$(ls -A | grep -E '^\.|^big')"
exits 5 'no memory for so many threads' limited 1500000 vol-render -t tf.json --size 2048x2048 -j 1000 -o big.exr a.vdb
finish
