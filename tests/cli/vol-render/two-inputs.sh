echo '{"pellucid": "transfer-function/1", "scatter": [[0, 0.5], [1, 0.5]]}' >tf.json
makevdb >a.vdb
vol-render -t tf.json -o a.exr a.vdb a.vdb
