echo '{"pellucid": "transfer-function/1", "scatter": [[0, 0.5], [1, 0.5]]}' >tf.json
makevdb >a.vdb
mkdir bin && cp "$OUT/bin/vol-render" bin/
PELLUCID_ADAPTERS=$PWD/nowhere bin/vol-render -t tf.json --size 4x4 -o a.exr a.vdb
