. "$TESTS/lib.sh"
echo '{"pellucid": "transfer-function/1", "particle_step": 0.01, "scatter": [[-1, 0.5], [1, 0.2]], "phase": {"hg": 0.5}}' >tf.json
must vol-gen field marschner-lobb --size 24 -o a.vdb
check 'a band and a plot' tf-preint --size 64 --volume a.vdb --plot p.png --stats s.json -o t.exr tf.json
check 'the plot is a PNG' sh -c 'head -c 4 p.png | grep -q PNG'
check 'entries were left out' grep -q '"entries": [1-9][0-9]*' s.json
check_not 'of the skipped ones there are some' sh -c 'grep -A 1 skipped s.json | grep -q "\"entries\": 0"'
check 'what is left out is -1, less than any opacity' sh -c 'vol-info --json t.exr | grep -q "\"min\": -1.0"'
check 'the whole without a volume has no -1' sh -c 'tf-preint --size 64 tf.json | vol-info --json >i.json; ! grep -q "\"min\": -1.0" i.json'
finish
