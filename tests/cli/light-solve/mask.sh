# A mask beside the volume: occluders and blanks.
. "$TESTS/lib.sh"
echo '{"pellucid": "transfer-function/1", "scatter": [[0, 0.5], [1, 0.5]]}' >tf.json
volume='--dims 9,9,9 --field const:0.5 --box'
# shellcheck disable=SC2086
{
must makevdb --name density $volume >plain.vdb
must makevdb --name density $volume --also --name mask --type int32 --field const:1 --poke 4,4,4,2 >occluder.vdb
must makevdb --name density $volume --also --name mask --type int32 --field const:1 >all.vdb
must makevdb --name density $volume --also --name mask --type int32 --field const:0 >blank.vdb
must makevdb --name density $volume --also --name mask --type int32 --voxel 2 --field const:1 >elsewhere.vdb
}
for v in plain occluder all blank; do
    exits 0 "$v" light-solve -t tf.json --light sun:0,0,-1 --no-history -o $v.lit.vdb $v.vdb
    vol-info $v.lit.vdb >$v.txt
    sed -n '/^grid light.0.direct/,$p' $v.txt | grep -E '^ +(min|max|values|active_voxels):' >$v.range
done
check 'what is all inside is as without a mask' cmp plain.range all.range
check 'dark behind an occluder' grep -q 'min: 0$' occluder.range
check_not 'no darkness without' grep -q 'min: 0$' plain.range
check 'nothing to be lit where all is blank' grep -q 'active_voxels: 0' blank.txt
check 'the mask goes on' grep -q '^grid mask' occluder.txt
exits 3 'a mask elsewhere' light-solve -t tf.json --light sun:0,0,-1 -o no.vdb elsewhere.vdb
says "*the voxels of grid 'mask' are not those of the volume*" 'says so'
must light-solve -q -t tf.json --light sun:0,0,-1 -f -o fresh.vdb occluder.vdb
must light-solve -q -t tf.json --light sun:0,0,-1 --reuse plain.lit.vdb -f -o copied.vdb occluder.vdb
check 'light without the mask is not reused' cmp fresh.vdb copied.vdb
finish
