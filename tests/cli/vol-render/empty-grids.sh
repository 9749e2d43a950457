# Nothing active is nothing to see, not an error: first frames of simulations.  A transparent picture, with a warning.
. "$TESTS/lib.sh"
echo '{"pellucid": "transfer-function/1", "scatter": [[-1, 0.5], [1, 0.5]], "surface": [[-1, 0.5], [1, 1]],
    "isosurfaces": [{"value": 0, "opacity": 1}], "emit": [[0, 1]]}' >tf.json
makeexr 4x4 R=0 G=0 B=0 A=0 >none.exr
makeexr 4x4 R=0.25 G=0.5 B=0.75 A=0 >blue.exr

must makevdb --empty >empty.vdb
must makevdb --empty --background 0.5 >dense-around.vdb
must makevdb --empty --type int32 --voxel 0.01 >whole.vdb
must vol-gen field sphere --size 8 --sparse 1000 -o thin.vdb
for volume in empty dense-around whole thin; do
    for estimator in exact full integrals direct; do
        exits 0 "$volume, $estimator" vol-render -t tf.json --size 4x4 --estimator "$estimator" -o a.exr "$volume.vdb"
        says "vol-render: warning: grid 'density' is empty*" "$volume, $estimator: says so"
        check "$volume, $estimator: one line" test "$(wc -l <stderr)" = 1
        check "$volume, $estimator: transparent" vol-diff a.exr none.exr
    done
done
exits 0 'all else works' vol-render -q -t tf.json --precise --size 4x4 --background 0.25,0.5,0.75 --aov Z,normal,steps \
    --samples 2 --eye 1,2,3 --light sun:1,0,0 --clip 0,0,1,0 -o a.exr empty.vdb
exits 0 'before a background' vol-render -q -t tf.json --size 4x4 --background 0.25,0.5,0.75 -o a.exr empty.vdb
check 'the background is seen' vol-diff a.exr blue.exr
exits 0 'a probe' vol-render -t tf.json --size 4x4 --probe 1,1 -v empty.vdb
check 'a probe is JSON' json stdout

# Values that are fractions of the data's range have nothing to be stretched over.
echo '[{"Name": "m", "ColorSpace": "RGB", "RGBPoints": [0, 0, 0, 0, 1, 1, 1, 1]}]' >map.json
exits 0 'another program'\''s colours' vol-render -t map.json --size 4x4 -o a.exr empty.vdb
check 'another program'\''s colours: transparent' vol-diff a.exr none.exr
exits 0 'tables for it' tf-preint --size 8 --volume empty.vdb -o tables.exr tf.json
exits 0 'a description of it' vol-info empty.vdb
exits 0 'the same as itself' vol-diff empty.vdb empty.vdb
finish
