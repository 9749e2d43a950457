# Grids in a camera's frustum, as other programs keep them, stand beside others: listed, compared, and in nobody's way.
. "$TESTS/lib.sh"
must makevdb --field const:1 --also --name cam --field const:2 --frustum >a.vdb
must makevdb --field const:1 --also --name cam --field const:3 --frustum >b.vdb
must makevdb --field const:1 --also --name cam --field const:2 >affine.vdb
echo '{"pellucid": "transfer-function/1", "scatter": [[0, 0.5], [1, 0.5]]}' >tf.json

exits 0 'listed' vol-info a.vdb
check 'the affine one' grep -qx 'grid density' stdout
check 'the frustum' grep -qx 'grid cam' stdout
check 'what its transform is' grep -q 'NonlinearFrustumMap' stdout
check 'its values' grep -q 'max: 2' stdout
exits 0 'as JSON' vol-info --json a.vdb
check 'it is JSON' json stdout
exits 0 'a histogram' vol-info --plot p.png a.vdb
exits 0 'the other grid is rendered' vol-render -t tf.json --size 4x4 -o a.exr a.vdb
exits 3 'a frustum is not' vol-render -t tf.json --size 4x4 --grid cam -o b.exr a.vdb
says "vol-render: error: *'cam'*transform is not affine*" 'it says why'
exits 0 'the same as itself' vol-diff a.vdb a.vdb
exits 1 'other values differ' vol-diff a.vdb b.vdb
exits 1 'another transform differs' vol-diff a.vdb affine.vdb
finish
