# What is refused, and how it is said.
. "$TESTS/lib.sh"
echo '{"pellucid": "transfer-function/1", "scatter": [[0, 0.5], [1, 0.5]]}' >tf.json
must vol-gen field sphere --size 8 -o v.vdb
refused() { # what code pattern arguments..
    what=$1 code=$2 pattern=$3
    shift 3
    exits "$code" "$what" light-solve -o out.vdb "$@"
    says "$pattern" "$what: says so"
    check_not "$what: no output" test -e out.vdb
}
refused 'no light' 2 'light-solve: error: no light: give --light SPEC*' -t tf.json v.vdb
refused 'no transfer function' 2 'light-solve: error: no transfer function: give -t FILE*' --light sun:1,0,0 v.vdb
refused 'a sun without direction' 2 "light-solve: error: light 'sun:0,0,0': its direction has no length*" \
    -t tf.json --light sun:0,0,0 v.vdb
refused 'a spot without direction' 2 '*its direction has no length*' -t tf.json --light spot:1,1,1,0,0,0,20 v.vdb
refused 'an unknown light' 2 "*unknown kind 'lamp'*" -t tf.json --light lamp:1,0,0 v.vdb
refused 'an unknown method' 2 '*--method*' -t tf.json --method magic --light sun:1,0,0 v.vdb
refused 'one voxel' 2 '*--resolution wants at least 2 voxels*' -t tf.json --resolution 1 --light sun:1,0,0 v.vdb
refused 'too many voxels' 2 '*--resolution wants at most 65536 voxels*' -t tf.json --resolution 65537 --light sun:1,0,0 v.vdb
refused 'negative absorption' 2 '*--absorption wants a number of at least 0*' -t tf.json --absorption -1 --light sun:1,0,0 v.vdb
refused 'a clip plane without normal' 2 '*its normal has no length*' -t tf.json --clip 0,0,0,1 --light sun:1,0,0 v.vdb
refused 'no such grid' 3 '*nothing*' -t tf.json --grid nothing --light sun:1,0,0 v.vdb
refused 'a volume as transfer function' 3 '*' -t v.vdb --light sun:1,0,0 v.vdb
refused 'a transfer function as volume' 3 '*' -t tf.json --light sun:1,0,0 tf.json
finish
