# A black picture would give no reason.
echo '{"pellucid": "transfer-function/1", "scatter": [[0, 0.5], [1, 0.5]]}' >tf.json
makevdb --empty >a.vdb
vol-render -t tf.json --size 4x4 -o a.exr a.vdb
code=$?
test ! -e a.exr || exit 9
exit $code
