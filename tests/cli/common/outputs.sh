# A file appears whole or not at all.
. "$TESTS/lib.sh"
makevdb --dims 8,8,8 --field noise:1 >a.vdb
echo '{"pellucid": "transfer-function/1", "scatter": [[0, 0.5], [1, 0.5]]}' >tf.json

exits 0 'a file' vol-gen field constant --size 8 -o x.vdb
exits 0 'stdout' vol-gen field constant --size 8
check 'the same bytes' cmp x.vdb stdout
exits 0 '/dev/stdout' sh -c 'vol-gen field constant --size 8 -o /dev/stdout >y.vdb'
check 'the same bytes through /dev/stdout' cmp x.vdb y.vdb
exits 0 '/dev/null' vol-gen field constant --size 8 -o /dev/null

# permissions as the umask has it, and replaced, not written into
(umask 027 && vol-gen field constant --size 8 -o mode.vdb)
check 'mode by the umask' test "$(ls -l mode.vdb | cut -c 1-10)" = -rw-r-----
ln x.vdb linked.vdb
exits 0 'an existing file' vol-gen field ramp --size 8 -o x.vdb
check 'the old content lives on where it was linked' cmp linked.vdb y.vdb
check_not 'and the new one is there' cmp x.vdb y.vdb

# -n
cp x.vdb before.vdb
exits 0 'no clobber' vol-gen field constant --size 8 -n -o x.vdb
check 'left alone' cmp x.vdb before.vdb
exits 0 'no clobber, a new file' vol-gen field constant --size 8 -n -o new.vdb
check 'written' cmp new.vdb y.vdb
exits 0 'no clobber, vol-render' vol-render -t tf.json -n -o x.vdb a.vdb
check 'left alone by vol-render' cmp x.vdb before.vdb
exits 0 'no clobber does not read its input' vol-render -t missing.json -n -o x.vdb missing.vdb

# disks that are full, folders that are not there
exits 4 'vol-gen to a full disk' sh -c 'vol-gen field constant --size 8 >/dev/full'
exits 4 'vol-gen -o /dev/full' vol-gen field constant --size 8 -o /dev/full
exits 4 'vol-render to a full disk' vol-render -t tf.json --size 8x8 -o /dev/full a.vdb
exits 4 'vol-info to a full disk' sh -c 'vol-info a.vdb >/dev/full'
exits 4 'vol-diff to a full disk' sh -c 'vol-diff a.vdb x.vdb >/dev/full'
exits 4 'no such folder' vol-gen field constant --size 8 -o nowhere/x.vdb
says "vol-gen: error: *nowhere*" 'and says which'
exits 4 'a folder as output' vol-gen field constant --size 8 -o .
exits 4 'stats to a full disk' vol-gen field constant --size 8 --stats /dev/full -o z.vdb

# a file that may not grow beyond 64 blocks: an error where the signal is ignored, death by it where not
exits 4 'a file size limit' sh -c 'trap "" XFSZ; ulimit -f 64; exec vol-gen field noise --size 64 -o big.vdb'
check_not 'leaves no file' test -e big.vdb
check 'and no temporary' test -z "$(ls -A | grep '^\.')"

# through a FIFO and back
mkfifo pipe
vol-gen field ramp --size 8 -o pipe &
exits 0 'FIFOs are written and read' vol-render -t tf.json --size 8x8 -o fifo.exr pipe
wait
exits 0 'the same from the file' vol-render -t tf.json --size 8x8 -o file.exr x.vdb
check 'the same picture' vol-diff fifo.exr file.exr
exits 0 'dashes end options' vol-gen --size 8 -o ./-x.vdb -- field constant
check 'a name that begins with a dash' test -s ./-x.vdb
finish
