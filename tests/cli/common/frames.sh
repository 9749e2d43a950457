# --frame fills %04d and #### in the names of files.
. "$TESTS/lib.sh"
makevdb >in.0007.vdb
echo '{"pellucid": "transfer-function/1", "scatter": [[0, 0.5], [1, 0.5]]}' >tf.json

exits 0 'printf form' vol-gen field constant --size 4 --frame 7 -o 'a.%04d.vdb'
check 'a.0007.vdb' test -s a.0007.vdb
exits 0 'hashes, one per digit' vol-gen field constant --size 4 --frame 7 -o 'b.###.vdb'
check 'b.007.vdb' test -s b.007.vdb
exits 0 'a frame of more digits' vol-gen field constant --size 4 --frame 12345 -o 'c.####.vdb'
check 'c.12345.vdb' test -s c.12345.vdb
exits 0 'operands and --stats too' vol-render -t tf.json --size 4x4 --frame 7 --stats 's.%02d.json' -o 'd.####.exr' 'in.####.vdb'
check 'd.0007.exr' test -s d.0007.exr
check 's.07.json' json s.07.json
exits 2 'one hash is ambiguous' vol-gen field constant --size 4 --frame 7 -o 'e.#.vdb'
says 'vol-gen: error: *#*' 'and says so'
exits 0 'without --frame names are names' vol-gen field constant --size 4 -o 'f.%04d.vdb'
check 'f.%04d.vdb' test -s 'f.%04d.vdb'
exits 2 'a frame is a whole number' vol-gen field constant --size 4 --frame 7.5 -o 'g.%04d.vdb'
finish
