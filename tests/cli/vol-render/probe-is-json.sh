# On stdout, even where -o names an image: none is made.
echo '{"pellucid": "transfer-function/1", "scatter": [[0, 0.5], [1, 0.5]]}' >tf.json
makevdb >a.vdb
vol-render -t tf.json --size 4x4 --probe 2,1 --probe 0,3 -o a.exr a.vdb >p.json || exit
test ! -e a.exr || exit 9
test "$(json p.json pixels 0 x)" = 2 && test "$(json p.json pixels 0 y)" = 1 && test "$(json p.json pixels 1 y)" = 3 &&
json p.json pixels 1 channels A >a
