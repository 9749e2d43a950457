# How far apart voxels may lie, and how far out: as pellucid-files(5) says.
. "$TESTS/lib.sh"
echo '{"pellucid": "transfer-function/1", "scatter": [[0, 0.5], [1, 0.5]]}' >tf.json
far() { must makevdb --empty --sparse --tile "$1,0,0,8,0.5" --tile "$2,0,0,8,0.5" >far.vdb; }
render() { vol-render -q -t tf.json --size 4x4 -o out.exr far.vdb; }

far -1073741824 1073741816 # 2^31 voxels from first to last
exits 3 '2^31 voxels' vol-info far.vdb
says '*so far apart are not supported*' 'says why'
exits 3 'vol-render: 2^31 voxels' render
far -1073741816 1073741816
exits 0 'fewer' vol-info far.vdb
exits 0 'vol-diff' vol-diff far.vdb far.vdb
exits 0 'vol-render' render

far 0 1073741824 # up to 2^30 + 7
exits 0 'beyond 2^30' vol-info far.vdb
exits 3 'vol-render: beyond 2^30' render
says '*indices beyond 2^30 are not served*' 'says why'
far -1073741832 0
exits 3 'vol-render: beyond -2^30' render
far -1073741824 0
exits 0 'vol-render: from -2^30 on' render
finish
