echo '{"pellucid": "transfer-function/1", "scatter": [[0, 0.5], [1, 0.5]]}' >tf.json
makevdb >a.vdb
unset PELLUCID_ADAPTERS
cd / && vol-render -t "$OLDPWD/tf.json" --size 4x4 -o "$OLDPWD/a.exr" "$OLDPWD/a.vdb"
