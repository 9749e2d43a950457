# Numbers too close to each other for a table: said in the units of the field, whatever those are that it is rendered in.
awk 'BEGIN {
    printf "NRRD0004\ntype: double\ndimension: 3\nsizes: 4 4 4\nencoding: ascii\n\n"
    for (i = 0; i < 64; i++) printf "%.17g\n", 1e15 + i * 0.125 }' >a.nrrd
vol-import -q -o a.vdb a.nrrd || exit 9
echo '{"pellucid": "transfer-function/1", "scatter": [[1e15, 0], [1000000000000008, 0.5]]}' >tf.json
vol-render -q --estimator full -t tf.json --size 4x4 -o a.exr a.vdb
