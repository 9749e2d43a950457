# --stats: JSON that says how long, how much memory, what was done and what was skipped.
. "$TESTS/lib.sh"
makevdb --sparse --dims 64,64,64 --field bowl:0,0,0 >a.vdb
echo '{"pellucid": "transfer-function/1", "scatter": [[0, 0.9], [100, 0.9], [100, 0], [20000, 0]]}' >tf.json
makeexr 4x4 R=1 >a.exr

exits 0 'vol-render' vol-render -t tf.json --size 64x64 --stats s.json -o with.exr a.vdb
check 'is JSON' json s.json
for key in seconds peak_memory_bytes skipped; do
    check "has $key" json s.json $key
done
check 'seconds in all' json s.json seconds total
exits 0 'without' vol-render -t tf.json --size 64x64 -o without.exr a.vdb
check 'stats do not change a byte of the output' cmp with.exr without.exr

exits 0 'vol-gen' vol-gen field sphere --size 32 --stats g.json -o g.vdb
check 'vol-gen: is JSON' json g.json seconds total
exits 0 'vol-info' vol-info --stats i.json a.vdb
check 'vol-info: is JSON' json i.json seconds total
exits 0 'vol-diff' vol-diff --stats d.json a.exr a.exr
check 'vol-diff: is JSON' json d.json seconds total
exits 1 'vol-diff, different' vol-diff --stats e.json a.exr with.exr
check 'a failed run tells too' json e.json seconds total
finish
