# What comes in goes out: grids, metadata, history; and light grids in place of older ones.
. "$TESTS/lib.sh"
echo '{"pellucid": "transfer-function/1", "scatter": [[0, 0], [1, 0.5]]}' >tf.json
echo '{"pellucid": "transfer-function/1", "absorb": [[0, 0, [0.2, 0.5, 1]], [1, 0.5, [0.2, 0.5, 1]]]}' >coloured.json
must vol-gen field sphere --size 12 --param edge=0.3 --set scene=seven -o v.vdb
solve() { light-solve -q -t tf.json "$@"; }
must solve --light sun:1,2,3 --light point:0,4,0 -o lit.vdb v.vdb
must vol-info --json lit.vdb -o lit.json
for word in '"light.0.direct"' '"light.1.direct"' '"density"' '"seven"' 'vol-gen field sphere' 'sun:1,2,3' 'light:volume' 'light:tf'; do
    check "it says $word" grep -q -F "$word" lit.json
done
exits 0 'through a pipe' sh -c 'light-solve -t tf.json --light sun:1,2,3 --light point:0,4,0 <v.vdb >piped.vdb'
check 'the same bytes' cmp lit.vdb piped.vdb
exits 0 'lit again, by other lights' solve --light sun:0,0,1 -o again.vdb lit.vdb
must solve --light sun:0,0,1 -o fresh.vdb v.vdb
check 'as if it were the first time' vol-diff again.vdb fresh.vdb
must vol-info again.vdb -o again.txt
check_not 'nothing is left of the other light' grep -q 'light.1.direct' again.txt
must light-solve -q -t coloured.json --light sun:1,2,3 -o coloured.vdb v.vdb
must vol-info coloured.vdb -o coloured.txt
check 'coloured light is vec3s' grep -q 'Tree_vec3s' coloured.txt
check_not 'light without colour is not' grep -q 'Tree_vec3s' again.txt
exits 0 'no history' solve --no-history --light sun:0,0,1 -o none.vdb v.vdb
exits 0 'it is rendered still' vol-render -q -t tf.json --size 4x4 -o a.exr v.vdb
finish
