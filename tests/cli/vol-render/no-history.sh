echo '{"pellucid": "transfer-function/1", "scatter": [[0, 0.5], [1, 0.5]]}' >tf.json
makevdb >secret.vdb
vol-render -t tf.json --size 4x4 --no-history -o a.exr secret.vdb || exit
vol-info a.exr >text
! grep -q -E 'secret|tf.json' text
