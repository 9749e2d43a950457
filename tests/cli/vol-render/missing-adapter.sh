# A library that cannot be loaded is named; what needs none of it works all the same.
echo '{"pellucid": "transfer-function/1", "scatter": [[0, 0.5], [1, 0.5]]}' >tf.json
makevdb >a.vdb
mkdir bin && cp "$OUT/bin/vol-render" bin/
vol-render -q -t tf.json --size 4x4 -o a.exr a.vdb && vol-info --plot a.png a.exr >a.txt || exit 9
PELLUCID_ADAPTERS=$PWD/nowhere
export PELLUCID_ADAPTERS
bin/vol-render -q -t tf.json --size 4x4 -o b.exr a.vdb || exit 8
bin/vol-render -t tf.json --size 4x4 --background a.png -o c.exr a.vdb
