# Pictures that no memory holds: refused before anything is read, with the option that asked for them.
. "$TESTS/lib.sh"
exits 5 'a size' vol-render -t missing.json --size 1000000x1000000 -o a.exr missing.vdb
says '*: error: --size 1000000x1000000 (--crop renders parts): about 16* TB of memory are needed, * are available' 'a size: the message'
exits 5 'a crop' vol-render -t missing.json --size 1048576x1048576 --crop 1000000x1000000+5+5 -o a.exr missing.vdb
says '*: error: --crop 1000000x1000000 (*): about * of memory are needed*' 'a crop: the message'
exits 2 'more across than any picture has' vol-render -t missing.json --size 1048577x4 -o a.exr missing.vdb
says '*: error: --size 1048577x4: more than 1048576 pixels across*' 'more across: the message'
echo '{"pellucid": "transfer-function/1", "scatter": [[0, 0.5], [1, 0.5]]}' >tf.json
makevdb >a.vdb
exits 0 'a small crop of a huge picture' vol-render -t tf.json --size 1000000x1000000 --crop 4x4+500000+500000 -o a.exr a.vdb
exits 0 'a pixel of it' vol-render -t tf.json --size 1000000x1000000 --probe 500000,500000 a.vdb
finish
