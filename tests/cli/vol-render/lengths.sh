# Lengths that opacities hold for: --particle-step in voxels or world units, and what other programs take for the volume
# (pellucid-files(5)).  A ray through L world units of one opacity a per step s: 1 - (1 - a)^(L / s).
. "$TESTS/lib.sh"

# The picture's one pixel looks along z through 7 voxels of 0.5 x 1 x 2 world units: between their centres 12.
must makevdb --field const:1 --dims 5,6,7 --map 0.5,0,0,0,1,0,0,0,2,0,0,0 >a.vdb
alpha() { vol-render -q --precise --ortho 1 --size 1x1 --probe 0,0 "$@" a.vdb >probe.json && json probe.json pixels 0 channels A; }
# $1 name, $2 step as awk has it, then vol-render's options; the opacity is 0.2 throughout
holds_for() {
    holds_name=$1 holds_step=$2
    shift 2
    got=$(alpha "$@") || got=none
    check "$holds_name" awk -v got="$got" "BEGIN { want = 1 - exp(log(0.8) * 12 / ($holds_step)); d = got - want
        exit !(got != \"none\" && d < 1e-12 && d > -1e-12) }"
}

echo '{"pellucid": "transfer-function/1", "particle_step": 3, "scatter": [[0, 0.2]]}' >own.json
holds_for 'the file'\''s step' 3 -t own.json
holds_for 'a bare number is world units' 5 -t own.json --particle-step 5
holds_for 'w: world units' 0.25 -t own.json --particle-step 0.25w
holds_for 'v: voxels, along the shortest edge' 0.5 -t own.json --particle-step 1v
holds_for 'parts of voxels' 1.75 -t own.json --particle-step 3.5v
for bad in 1x v w 0 0v -1 -1v nan ''; do
    exits 2 "--particle-step '$bad'" vol-render -t own.json --particle-step "$bad" -o b.exr a.vdb
done
exits 2 'it says what is wanted' vol-render -t own.json --particle-step 1x -o b.exr a.vdb
says "*bad value '1x' for '--particle-step': a length is needed*" 'names voxels and world units'

# ParaView: the diagonal over the cube root of the cells.
echo '[{"Name": "m", "ColorSpace": "RGB", "RGBPoints": [5, 0, 0, 0, 9, 1, 1, 1], "Points": [5, 0.2, 0.5, 0, 9, 0.2, 0.5, 0]}]' >pv.json
holds_for 'ParaView' 'sqrt(2*2 + 5*5 + 12*12) / exp(log(4*5*6) / 3)' -t pv.json
sed 's/"Name"/"ScalarOpacityUnitDistance": 4, "Name"/' pv.json >pv4.json
holds_for 'ParaView, with a distance of its own' 4 -t pv4.json
# 3D Slicer: a voxel.
echo '<MRML><VolumeProperty name="p" shade="0" scalarOpacity="4 0 0.2 9 0.2" colorTransfer="8 0 0 0 0 9 1 1 1"/></MRML>' >slicer.xml
holds_for '3D Slicer' 1 -t slicer.xml
# Inviwo: 1/150 of the volume; Voreen: 1/200.
echo '<InviwoTreeData><maskMin content="0"/><maskMax content="1"/><Points>
    <Point><pos content="0"/><rgba x="1" y="1" z="1" w="0.2"/></Point>
    <Point><pos content="1"/><rgba x="1" y="1" z="1" w="0.2"/></Point></Points></InviwoTreeData>' >inviwo.itf
holds_for 'Inviwo' 'exp(log(5*6*7) / 3) / 150' -t inviwo.itf
echo '<VoreenData><TransFuncIntensity><Keys>
    <key><intensity value="0"/><split value="false"/><colorL r="9" g="9" b="9" a="51"/></key>
    <key><intensity value="1"/><split value="false"/><colorL r="9" g="9" b="9" a="51"/></key>
    </Keys></TransFuncIntensity></VoreenData>' >voreen.tfi
holds_for 'Voreen' 'exp(log(5*6*7) / 3) / 200' -t voreen.tfi
for tf in pv.json slicer.xml inviwo.itf voreen.tfi; do
    holds_for "$tf: --particle-step stands above" 7 -t "$tf" --particle-step 7
    # Tables made for the volume hold the same.
    check "$tf: tables for the volume" tf-preint --size 16 --part tf --volume a.vdb -o tables.exr "$tf"
    check "$tf: the picture by tables" vol-render -q -t tables.exr --size 3x3 -o tables-picture.exr a.vdb
    check "$tf: the picture" vol-render -q -t "$tf" --size 3x3 -o picture.exr a.vdb
    check "$tf: the same" vol-diff --max 1e-6 tables-picture.exr picture.exr
done
exits 0 'a note says which' vol-render -v -t voreen.tfi --size 2x2 -o p.exr a.vdb
says "*note: *world units of this volume*" 'the length is in the note'
exits 0 'without a volume' tf-preint --size 16 --part tf -o tables.exr slicer.xml
says "tf-preint: warning: *depends on the volume (--volume)*" 'it is said that the length is a guess'

exits 0 'a step in voxels of the volume' tf-preint --size 16 --step 1v --volume a.vdb -o v.exr own.json
exits 0 'the same in world units' tf-preint --size 16 --step 0.5w --volume a.vdb -o w.exr own.json
check 'are the same tables' vol-diff v.exr w.exr
exits 2 'voxels of nothing' tf-preint --size 16 --step 1v -o v.exr own.json
says "tf-preint: error: --step in voxels*--volume*" 'the volume is asked for'
finish
