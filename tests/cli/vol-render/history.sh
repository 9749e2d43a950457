makevdb --text vol:history='first | line' >in.vdb
echo '{"pellucid": "transfer-function/1", "scatter": [[0, 0.5], [1, 0.5]]}' >tf.json
vol-render -t tf.json --size 4x4 -o a.exr in.vdb || exit
vol-info a.exr >text
grep -q 'first | line' text && grep -q 'vol-render.*--size 4x4' text
