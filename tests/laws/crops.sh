# Crops are the same pixels of the same picture; joined they are the picture.
. "$TESTS/lib.sh"
cat >tf.json <<'END'
{ "pellucid": "transfer-function/1", "particle_step": 0.2,
  "scatter": [[0.2, 0, [1, 0.8, 0.6]], [0.6, 0.1, [0.9, 0.7, 0.5]], [0.8, 0.6, [0.2, 0.5, 0.9]]],
  "isosurfaces": [{"value": 0.65, "opacity": 0.4, "color": [0.7, 0.2, 0.2]}] }
END
must makevdb --dims 33,33,33 --voxel 0.04 --field waves >a.vdb
view='--size 61x47 --eye 2,1.5,4 --look-at 0.5,0.5,0.5 --aov Z,normal,steps --samples 2 --background 0.1,0.2,0.3'
render() { # shellcheck disable=SC2086
    vol-render -t tf.json $view "$@" a.vdb
}
must render -o full.exr
must render --crop 61x47+0+0 -o whole.exr
check 'a crop of everything' cmp full.exr whole.exr
must render --crop 30x20+0+0 -o 1.exr
must render --crop 31x20+30+0 -o 2.exr
must render --crop 61x1+0+20 -o 3.exr
must render --crop 1x26+0+21 -o 4.exr
must render --crop 60x26+1+21 -j2 -o 5.exr
exits 0 'parts join' exr-join -o joined.exr 1.exr 2.exr 3.exr 4.exr 5.exr
check 'to the picture' vol-diff joined.exr full.exr
check 'byte for byte' cmp joined.exr full.exr
must exr-join -o other.exr 5.exr 3.exr 1.exr 4.exr 2.exr
check 'in any order' cmp joined.exr other.exr
check 'through a pipe' sh -c 'exr-join 1.exr 2.exr - 4.exr 5.exr <3.exr | cmp - full.exr'
exits 1 'a hole is told' exr-join -o hole.exr 1.exr 2.exr 3.exr 5.exr
check_not 'and nothing is written' test -e hole.exr
exits 3 'an overlap is refused' exr-join -o over.exr full.exr 1.exr
must vol-render -t tf.json --size 61x47 --crop 1x26+0+21 --aov Z,normal,steps --samples 2 -o stranger.exr a.vdb
exits 3 'a part of another picture is refused' exr-join -o strange.exr 1.exr 2.exr 3.exr stranger.exr 5.exr
finish
