# Pictures of the same world are the same picture.
. "$TESTS/lib.sh"
tf() { # PARTICLE_STEP SCALAR_FACTOR
    awk -v step="$1" -v f="$2" 'BEGIN {
        printf "{\"pellucid\": \"transfer-function/1\", \"particle_step\": %.17g, \"scalar_step\": %.17g,\n", step, 0.1 * f
        printf " \"scatter\": [[%.17g, 0, [1, 0.8, 0.6]], [%.17g, 0.5, [0.2, 0.5, 0.9]]],\n", 0.2 * f, 0.8 * f
        printf " \"surface\": [[%.17g, 0, [0.8, 0.8, 0.7]], [%.17g, 0.3, [0.8, 0.6, 0.7]]],\n", 0.3 * f, 0.9 * f
        printf " \"isosurfaces\": [{\"value\": %.17g, \"opacity\": 0.4, \"color\": [0.7, 0.2, 0.2]}]}\n", 0.65 * f }'
}
tf 0.2 1 >tf.json
view='--size 40x30 --light sun:-1,-1,-2'
camera='--eye 2,1.5,4 --look-at 0.5,0.5,0.5'
same() { # NAME A B: in float the order of operations differs with the voxels, not the picture
    check "$1" vol-diff --max 1e-4 --rms 2e-6 "$2" "$3"
}

# A linear field is the same in any voxels that fill the same box: here [0,1]^3.
field='--field linear:0.5,0.3,0.4,-0.1'
must makevdb --dims 9,9,9 --voxel 0.125 $field >cube.vdb
must vol-render -t tf.json $view $camera --precise -o want.exr cube.vdb
must makevdb --dims 5,9,17 --map 0.25,0,0,0,0.125,0,0,0,0.0625,0,0,0 $field >anisotropic.vdb
must makevdb --dims 9,9,9 --map -0.125,0,0,0,0.125,0,0,0,0.125,1,0,0 $field >mirrored.vdb
must makevdb --dims 9,9,9 --map 0,0.125,0,0,0,0.125,0.125,0,0,0,0,0 $field >turned.vdb
must makevdb --dims 9,9,9 --origin -5,100,-1000 --map 0.125,0,0,0,0.125,0,0,0,0.125,0.625,-12.5,125 $field >moved.vdb
for v in anisotropic mirrored turned moved; do
    must vol-render -t tf.json $view $camera --precise -o $v.exr $v.vdb
    same "$v voxels" want.exr $v.exr
done

# Sheared voxels fill a slanted box; cut the same prism out of both.
clips='--clip 1,0,0,0.3 --clip -1,0,0,-0.7'
must makevdb --dims 9,9,9 --map 0.125,0,0,0.025,0.125,0,0,0,0.125,-0.1,0,0 $field >sheared.vdb
must vol-render -t tf.json $view $camera --precise $clips -o want.exr cube.vdb
must vol-render -t tf.json $view $camera --precise $clips -o sheared.exr sheared.vdb
same 'sheared voxels' want.exr sheared.exr

# A curved field: the same samples with mirrored and permuted indices interpolate to the same field.
must makevdb --dims 17,17,17 --voxel 0.0625 --field waves >waves.vdb
must makevdb --dims 17,17,17 --map 0,0,-0.0625,0,0.0625,0,-0.0625,0,0,1,0,1 --field waves >permuted.vdb
must vol-render -t tf.json $view $camera --precise -o want.exr waves.vdb
must vol-render -t tf.json $view $camera --precise -o permuted.exr permuted.vdb
same 'the same samples in other order' want.exr permuted.exr

# World twice the size: everything per length is half as strong; with the step of the transfer function twice as long,
# lengths drop out.
must makevdb --dims 17,17,17 --voxel 0.125 --field noise:5 >big.vdb
must makevdb --dims 17,17,17 --voxel 0.0625 --field noise:5 >small.vdb
tf 0.4 1 >long.json
must vol-render -t tf.json $view --eye 2,1.5,4 --look-at 0.5,0.5,0.5 -o small.exr small.vdb
must vol-render -t long.json $view --eye 4,3,8 --look-at 1,1,1 -o big.exr big.vdb
same 'length against step' small.exr big.exr
must vol-render -t tf.json --particle-step 0.4 $view --eye 4,3,8 --look-at 1,1,1 -o flag.exr big.vdb
check '--particle-step is particle_step' vol-diff flag.exr big.exr

# Values in other units, with the transfer function in the same.
must makevdb --dims 9,9,9 --voxel 0.125 --field linear:32,19.2,25.6,-6.4 >scaled.vdb
tf 0.2 64 >scaled.json
must vol-render -t tf.json $view $camera --precise -o want.exr cube.vdb
must vol-render -t scaled.json $view $camera --precise -o scaled.exr scaled.vdb
same 'units of the field' want.exr scaled.exr

# What is stored how: whole numbers are exact in every type.
must makevdb --dims 3,3,3 --field linear:1,2,3,0 >float.vdb
tf 0.2 10 >ten.json
must vol-render -t ten.json $view --eye 9,7,12 --look-at 1,1,1 -o float.exr float.vdb
for type in double half int32; do
    must makevdb --type $type --dims 3,3,3 --field linear:1,2,3,0 >$type.vdb
    must vol-render -t ten.json $view --eye 9,7,12 --look-at 1,1,1 -o $type.exr $type.vdb
    check "$type voxels" vol-diff float.exr $type.exr
done

# Gradients come from neighbouring bricks in place, or where these are in another precision from copies.
for type in float double; do
    must makevdb --type $type --dims 33,33,33 --voxel 0.03125 --field bowl:0.25,0.5,0.375 >bowl.vdb
    must vol-render -t tf.json $view $camera --precise -o bowl-$type.exr bowl.vdb
done
check 'gradients, in place or from copies' vol-diff bowl-float.exr bowl-double.exr

# Models that coincide.
sed 's/"particle_step"/"model": "unshaded", "particle_step"/' tf.json >unshaded.json
sed 's/"particle_step"/"shading": {"ambient": 1, "diffuse": 0, "specular": 0}, "particle_step"/' tf.json >ambient.json
must vol-render -t unshaded.json --size 40x30 $camera -o unshaded.exr waves.vdb
must vol-render -t ambient.json --size 40x30 $camera -o ambient.exr waves.vdb
same 'unshaded is ambient light alone' unshaded.exr ambient.exr

# The background goes behind: RGB = RGB0 + (1 - A) background.
must makevdb --dims 9,9,9 --voxel 0.125 --field const:0 >clear.vdb
must vol-render -t tf.json --size 8x6 $camera --background 0.5,0.25,1 -o background.exr clear.vdb
must makeexr 8x6 R=0.5 G=0.25 B=1 A=0 >want.exr
check 'a clear volume shows the background, alpha 0' vol-diff background.exr want.exr

finish
