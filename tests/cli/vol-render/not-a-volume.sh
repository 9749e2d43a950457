echo '{"pellucid": "transfer-function/1", "scatter": [[0, 0.5], [1, 0.5]]}' >tf.json
vol-render -t tf.json -o a.exr tf.json
