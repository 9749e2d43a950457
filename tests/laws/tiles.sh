# A tile stands for its voxels: whatever its size, the picture is the one of a volume in which each of them is written out.
. "$TESTS/lib.sh"

look() { printf '{"pellucid": "transfer-function/1", "particle_step": 10, "scalar_step": 1, %s}\n' "$2" >"$1.json"; }
scatter='"scatter": [[0, 0, [1, 0.8, 0.6]], [0.2, 0.05, [1, 0.8, 0.6]], [0.6, 0.2, [0.9, 0.7, 0.5]], [0.8, 0.5, [0.2, 0.5, 0.9]]]'
look coloured "$scatter, \"absorb\": [[0.4, 0, [0.9, 0.5, 0.2]], [1, 0.2, [0.9, 0.5, 0.2]]],
    \"emit\": [[0.3, 0], [0.7, 0.01], [1, 0.2, [1, 0.3, 0.1]]]"
look surfaces "$scatter, \"surface\": [[0.1, 0, [0.8, 0.8, 0.7]], [0.35, 0.4, [0.8, 0.8, 0.7]], [0.6, 0.1, [0.8, 0.8, 0.7]]],
    \"isosurfaces\": [{\"value\": 0.45, \"opacity\": 0.4, \"color\": [0.7, 0.2, 0.2]}, {\"value\": 0.5, \"opacity\": 0.5}]"
look classic "$scatter, \"model\": \"classic\""
look jumps '"scatter": [[0.3, 0], [0.3, 0.3], [0.5, 0.3], [0.5, 0.1], [0.7, 0.1], [0.7, 0]], "emit": [[0.5, 0], [0.5, 0.01], [0.9, 0.01]]'

# NAME MAKEVDB-OPTION...: NAME.vdb with tiles, NAME-voxels.vdb without any.
volume() {
    volume=$1
    shift
    must makevdb "$@" >"$volume.vdb"
    must makevdb --unfold "$@" >"$volume-voxels.vdb"
}
compare() { # VOL-DIFF-OPTIONS VOL-RENDER-OPTION...
    bounds=$1
    shift
    must vol-render $view "$@" -o tiles.exr "$volume.vdb"
    must vol-render $view "$@" -o voxels.exr "$volume-voxels.vdb"
    # shellcheck disable=SC2086
    vol-diff $bounds tiles.exr voxels.exr >said || { echo "$*:"; cat said; } >>differs
}
# VOLUME LOOK VOL-RENDER-OPTION...: every estimator in float and in double, to rounding.
agrees() {
    volume=$1 look=$2
    shift 2
    view="-q --size 30x27 --aov Z,surface,scatter,emit,normal -t $look.json"
    : >differs
    for estimator in exact full integrals direct; do
        compare '--max 1e-6 --rel 2e-6' --estimator $estimator "$@"
    done
    for estimator in exact full direct; do
        compare '--max 1e-9 --rel 1.2e-7' --estimator $estimator --precise "$@"
    done
    if [ -s differs ]; then failed "$volume, $look $*" differs; else passed "$volume, $look $*"; fi
}

# Leaves, and tiles of 8 and of 128 voxels beside them, beside one another and alone.
tiles='--tile 128,0,0,128,0.5 --tile 0,0,-128,128,0.3 --tile -128,-128,-128,128,0.7 --tile 56,-32,64,8,0.9
    --tile 56,-32,80,8,0.2 --tile -48,-32,72,8,0.2 --tile -128,-128,0,128,0.5 --tile -128,-256,0,128,0.5'
leaves='--dims 96,64,128 --origin -40,-30,64 --voxel 0.5 --field waves --sparse --background 0.1'
volume mixed $leaves $tiles
volume holes $leaves $tiles --tile 128,128,0,128,nan --tile 0,-128,0,128,nan --tile 48,-32,80,8,inf
volume doubles --type double $leaves $tiles
volume box $leaves $tiles --tile 0,128,0,128,0.4,0 --box
volume level-set --class 'level set' --dims 40,40,40 --voxel 0.5 --origin 4,4,4 --field waves --background 0.1 --sparse \
    --tile -128,0,0,128,0.9,0 --tile 0,0,128,128,0.6,0
volume slab --dims 256,256,1 --origin 0,0,64 --box --empty --voxel 0.5 --tile 0,0,0,128,0.5 --tile 128,128,0,128,0.3 --tile 0,128,64,8,0.9

near='--eye 200,150,250 --look-at 10,0,0'
along='--eye 16,16,300 --look-at 16,16,0 --ortho 144' # many rays in the faces of bricks and of tiles
for look in coloured surfaces; do
    agrees mixed $look $near
    agrees mixed $look $along
    agrees holes $look $near
done
agrees mixed classic $near --step 0.11w
agrees mixed jumps $near --step 3.3w
agrees mixed surfaces --eye 30,20,10 --look-at 10,0,0 --fov 90 --clip 1,0.3,-0.2,-10 # from within
agrees mixed surfaces $near --light point:60,40,80
agrees mixed classic $near --light spot:60,40,80,-1,-1,-1,90:1,0.5,0.2 --light sun:1,-1,-2
agrees doubles coloured $near
agrees box surfaces $near
agrees level-set surfaces $near
agrees slab classic $near

# The largest tiles, as they are and cut into tiles of 128 voxels.
volume large --dims 40,40,40 --origin 4080,4070,4090 --field waves --sparse --tile 0,0,0,4096,0.5 --tile 4096,0,4096,4096,0.3 \
    --tile -4096,0,0,4096,0.5 --tile 0,4096,0,4096,0.7,0 --tile 8192,8192,8192,8,0.9 --tile 4096,4096,8192,128,0.8
far='--eye 20000,15000,25000 --look-at 3000,3000,3000 --particle-step 500'
agrees large coloured $far
agrees large surfaces $far
agrees large jumps $far

# Bytes do not depend on how they come about.
for estimator in exact full direct; do
    scene="-q --no-history --size 70x50 --estimator $estimator -t surfaces.json $near --aov Z,steps"
    must vol-render $scene -j1 -o one.exr mixed.vdb
    check "$estimator: without vector instructions" sh -c "vol-render $scene -j2 --cpu scalar mixed.vdb | cmp - one.exr"
    check "$estimator: nothing is left out" sh -c "vol-render $scene --no-skip mixed.vdb | cmp - one.exr"
    must vol-render $scene --crop 33x50+0+0 -o left.exr mixed.vdb
    must vol-render $scene --crop 37x50+33+0 -o right.exr mixed.vdb
    check "$estimator: in two parts" sh -c 'exr-join left.exr right.exr | vol-diff - one.exr'
done

# A box in which no voxel is active is one of its background.
must makevdb --box --dims 9,9,9 --background 0.5 --empty >none.vdb
must makevdb --box --dims 9,9,9 --field const:0.5 >all.vdb
must vol-render -q --size 20x20 -t coloured.json -o none.exr none.vdb
must vol-render -q --size 20x20 -t coloured.json -o all.exr all.vdb
check 'a box without active voxels' vol-diff none.exr all.exr
finish
