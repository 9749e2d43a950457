# Where every cell touches a voxel that is NaN or infinite there is nothing to see, and a warning says why: for pictures, parts
# of pictures and probes.
. "$TESTS/lib.sh"
echo '{"pellucid": "transfer-function/1", "scatter": [[0, 0.9], [1, 0.9]]}' >tf.json
render() { vol-render -t tf.json --size 4x4 "$@"; }
is_explained() { # NAME
    exits 0 "$1: a picture" render -o "$1.exr" "$1.vdb"
    says "*$2*" "$1: says why"
    exits 0 "$1: a crop" render --crop 2x2+0+0 -o "$1.exr" "$1.vdb"
    says "*$2*" "$1, cropped: says why"
    exits 0 "$1: a probe" render --probe 1,1 "$1.vdb"
    says "*$2*" "$1, probed: says why"
}
must makevdb --dims 1,1,1 --sparse --field nan >voxel.vdb
must makevdb --dims 1,1,1 --sparse --field const:0.5 --background nan >alone.vdb
must makevdb --dims 16,1,16 --sparse --field const:0.5 --background inf >sheet.vdb
must makevdb --dims 2,2,2 --sparse --field const:0.5 --background nan --poke 0,0,0,nan >corner.vdb
must makevdb --dims 2,2,2 --field const:0.5 --poke 1,1,1,nan >box.vdb
must makevdb --empty --sparse --background nan --tile 0,0,0,8,nan --tile 8,0,0,8,nan --tile 128,0,0,128,nan >tiles.vdb
must makevdb --dims 8,8,8 --field nan >dense.vdb
for volume in voxel alone sheet corner box; do
    is_explained "$volume" 'every cell of the grid has a corner that is NaN or infinite: nothing to see'
done
for volume in tiles dense; do
    is_explained "$volume" 'no finite voxel in the grid: nothing to see'
done
for volume in alone sheet tiles; do
    exits 0 "$volume" render --probe 1,1 "$volume.vdb"
    says "*'density': its background is *; the cells around its outermost voxels are left empty*" "$volume: of its background"
done

# As soon as one cell is whole there may be something to see.
must makevdb --dims 2,2,2 --sparse --field const:0.5 --background nan >cell.vdb
must makevdb --empty --sparse --background nan --tile 0,0,0,8,0.5 >tile.vdb
must makevdb --empty --sparse --background nan --tile 0,0,0,128,0.5 >large.vdb
must makevdb --dims 16,16,16 --sparse --background nan --field const:0.5 >block.vdb
must makevdb --dims 2,2,2 --sparse --field const:0.5 --poke 1,1,1,nan >hole.vdb
must makevdb --empty --sparse --background 0.5 --tile 0,0,0,8,nan --tile 800,0,0,8,nan >between.vdb
for volume in cell tile large block hole between; do
    exits 0 "$volume" render --probe 1,1 "$volume.vdb"
    check_not "$volume: something" grep 'nothing to see' stderr
done
finish
