# Light that is reused is the light that would be solved: the same bytes, in whatever order, and only where all is equal.
. "$TESTS/lib.sh"
echo '{"pellucid": "transfer-function/1", "scatter": [[0, 0], [1, 0.5, [1, 0, 0]]]}' >tf.json
echo '{"pellucid": "transfer-function/1", "scatter": [[0, 0], [1, 0.5, [0, 1, 0]]], "emit": [[0, 0], [1, 1]]}' >colours.json
echo '{"pellucid": "transfer-function/1", "scatter": [[0, 0], [1, 0.6, [1, 0, 0]]]}' >denser.json
echo '{"pellucid": "transfer-function/1", "absorb": [[0, 0], [1, 0.5, [1, 0, 0.5]]]}' >coloured.json
must vol-gen field sphere --size 20 --param edge=0.4 -o v.vdb
must vol-gen field sphere --size 20 --param edge=0.5 -o w.vdb
A=sun:1,-2,0.3 B=point:0,3,0 C=spot:0,3,0,0,-1,0,30
must light-solve -q -t tf.json --light $A --light $B --light $C -o lit.vdb v.vdb

# what is to be copied, then volume and options: the output is that of solving anew, and so many lights were copied
reused() {
    wanted=$1
    shift
    must light-solve -q -f "$@" -o fresh.vdb
    exits 0 "$*" light-solve -q -f "$@" --reuse lit.vdb --stats stats.json -o copied.vdb
    check "$*: the same bytes" cmp fresh.vdb copied.vdb
    check "$*: $wanted copied" grep -q "\"solved_lights\": $wanted," stats.json
}
reused 3 -t tf.json --light $A --light $B --light $C v.vdb
reused 2 -t tf.json --light $C --light sun:0,1,0 --light $A v.vdb
reused 1 -t colours.json --light sun:0,1,0 --light $B v.vdb
reused 0 -t denser.json --light $B v.vdb
reused 0 -t tf.json --light $B w.vdb
reused 0 -t tf.json --light $B --clip 1,0,0,0 v.vdb
reused 0 -t tf.json --light $B --resolution 9 v.vdb
reused 0 -t tf.json --light $B --absorption 2 v.vdb
must light-solve -q -t coloured.json --light $A --clip 1,0,0,0 --resolution 12 -f -o lit.vdb v.vdb
reused 1 -t coloured.json --light $A --light $B --clip 1,0,0,0 --resolution 12 v.vdb
exits 3 'a cut file' sh -c 'head -c 900 lit.vdb >cut.vdb; light-solve -t tf.json --light sun:1,0,0 --reuse cut.vdb -o no.vdb v.vdb'
exits 3 'another kind of file' light-solve -t tf.json --light sun:1,0,0 --reuse tf.json -o no.vdb v.vdb
says '*tf.json*' 'names it'
exits 4 'no such file' light-solve -t tf.json --light sun:1,0,0 --reuse missing.vdb -o no.vdb v.vdb
finish
