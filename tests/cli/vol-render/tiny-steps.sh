# A step so small that no ray would ever end is refused, whatever the estimator; what is empty or of one value costs no steps.
. "$TESTS/lib.sh"
printf '%s\n' '{"pellucid": "transfer-function/1", "scatter": [[0, 0, [1, 0.5, 0.2]], [1, 0.006, [0.2, 0.7, 1]]]}' >tf.json
must makevdb --dims 17,17,17 --field waves >a.vdb
must makevdb --dims 17,17,17 --voxel 1e-12 --field waves >small.vdb
must makevdb --empty --sparse --tile -4096,0,0,4096,0.5 --tile 102400000,0,0,4096,0.2 >apart.vdb
small() { timeout 20 vol-render -q -t tf.json --size 2x2 -o out.exr "$@"; }
for estimator in direct full integrals; do
    exits 2 "$estimator: 1e-16v" small --estimator $estimator --step 1e-16v a.vdb
    says "vol-render: error: --step 1e-16v: a ray through the whole volume would take 2.77e+17 steps, more than 1e+08: *2.8e-07v*" \
        'says how many'
    exits 2 "$estimator: 1e-20w" small --estimator $estimator --step 1e-20w small.vdb
    says "*--step 1e-20w: a ray through the whole volume would take 2.77e+09 steps, more than 1e+08: *2.8e-19w*" 'says how many'
    exits 2 "$estimator: the smallest number" small --estimator $estimator --step 5e-324v a.vdb
    says '*give 2.8e-07v or more*' 'says which would do'
    exits 0 "$estimator: 1e-15w in a small volume" small --estimator $estimator --step 1e-15w small.vdb
    exits 0 "$estimator: far apart" small --estimator $estimator --step 0.5v apart.vdb
    exits 2 "$estimator: far apart, too small" small --estimator $estimator --step 1e-9v apart.vdb
done
exits 0 'the estimator exact takes no steps' small --step 1e-16v a.vdb
finish
