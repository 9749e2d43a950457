# Options that change nothing here: a warning, and the same picture.
. "$TESTS/lib.sh"
echo '{"pellucid": "transfer-function/1", "scatter": [[0, 0.5], [1, 0.5]]}' >tf.json
makevdb >a.vdb
exits 0 '--step with exact' vol-render -t tf.json --size 4x4 --step 0.5v -o a.exr a.vdb
says '*: warning: --step has no effect: the estimator exact takes no steps*' '--step with exact: the warning'
must vol-render -t tf.json --size 4x4 -o b.exr a.vdb
check '--step with exact: the same picture' vol-diff -q a.exr b.exr
for estimator in full integrals direct; do
    exits 0 "--step with $estimator" vol-render -t tf.json --size 4x4 --step 0.5v --estimator $estimator -o c.exr a.vdb
    check "--step with $estimator: no warning" test ! -s stderr
done
exits 0 '--crop with --probe' vol-render -t tf.json --size 4x4 --crop 1x1+0+0 --probe 1,1 a.vdb
says '*: warning: --crop has no effect: with --probe there is no image*' '--crop with --probe: the warning'
exits 0 '--depth with --probe' vol-render -t tf.json --size 4x4 --depth half --probe 1,1 a.vdb
says '*: warning: --depth has no effect*' '--depth with --probe: the warning'
echo '{"pellucid": "transfer-function/1", "isosurfaces": [{"value": 0.5, "opacity": 1}]}' >iso.json
exits 0 'steps of what is not there' vol-render -t iso.json --size 4x4 --particle-step 2 --scalar-step 2 -o i.exr a.vdb
says '*: warning: --particle-step has no effect: *no particles*: warning: --scalar-step has no effect: *no soft surfaces*' \
    'steps of what is not there: the warnings'
exits 0 '--particle-step with particles' vol-render -t tf.json --size 4x4 --particle-step 2 -o p.exr a.vdb
check '--particle-step with particles: no warning' test ! -s stderr
exits 0 'tables without the full one' tf-preint --size 8 --part tf --step 2 -o t.exr tf.json
says '*: warning: --step has no effect without the part full*' 'tables without the full one: the warning'
exits 0 'a grid of no volume' tf-preint --size 8 --grid density -o t.exr tf.json
says '*: warning: --grid has no effect without --volume*' 'a grid of no volume: the warning'
finish
