# What needs more memory than there is says so before it takes any.
. "$TESTS/lib.sh"

exits 5 'a volume beyond any machine' vol-gen field noise --size 65536 -o big.vdb
says 'vol-gen: error: cannot hold 65536x65536x65536 voxels: about 1.* PB of memory are needed, * are available' 'with what it would need'
exits 5 'a sparse one of which a layer is too much' vol-gen field noise --size 1,65536,65536 --sparse 0 -o big.vdb
check_not 'nothing is written' test -e big.vdb

if [ "$SANITIZED" = 1 ]; then
    skipped 'limits' 'sanitizers need the address space'
    finish
fi
quick() { # COMMAND: within an address space of 400 MB; the highest memory it took is in `peak`
    (ulimit -v 400000; exec "$@" --stats s.json)
    quick_code=$?
    peak=$(json s.json peak_memory_bytes)
    return $quick_code
}
exits 5 'a volume beyond the address space' quick vol-gen -j1 field noise --size 480 -o big.vdb
says 'vol-gen: error: cannot hold 480x480x480 voxels: about 5?? MB of memory are needed, * are available' 'says so'
check 'before it takes it' test "$(json s.json peak_memory_bytes)" -lt 60000000
# nor does it fit where the libraries take what is left
exits 5 'a volume as large as the address space' sh -c 'ulimit -v 300000; exec vol-gen field ramp --size 400 --stats s.json -o big.vdb'
says 'vol-gen: error: cannot hold 400x400x400 voxels: about 3?? MB of memory are needed, * are available' 'says so'
check 'before it takes it' test "$(json s.json peak_memory_bytes)" -lt 60000000
exits 5 'a volume beyond what data may take' sh -c 'ulimit -d 250000; exec vol-gen field ramp --size 400 --stats s.json -o big.vdb'
says 'vol-gen: error: cannot hold 400x400x400 voxels: about 3?? MB of memory are needed, * are available' 'says so'
check 'before it takes it' test "$(json s.json peak_memory_bytes)" -lt 60000000
exits 0 'one that fits' quick vol-gen -j1 field ramp --size 200 -o fits.vdb

dd if=/dev/zero of=long.raw bs=1 count=0 seek=3000000000 2>dd.out # takes no room on the disk
exits 5 'a file beyond it' quick vol-import -j1 --dims 1000,1000,3000 --type u8 long.raw -o big.vdb
says "vol-import: error: cannot read 'long.raw': about 3.0 GB of memory are needed, * are available" 'says so'
rm long.raw
dd if=/dev/zero of=short.raw bs=1 count=0 seek=100000000 2>dd.out
exits 5 'a file that fits, its voxels do not' quick vol-import -j1 --dims 1000,1000,100 --type u8 short.raw -o big.vdb
says "vol-import: error: cannot import 'short.raw': about 700 MB of memory are needed, * are available" 'says so'
check_not 'nothing is written by any' test -e big.vdb
finish
