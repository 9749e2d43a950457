# A picture of almost nothing has a reason, which is said; one that is as it was asked for has not.
. "$TESTS/lib.sh"
must makevdb --field linear:1,0,0,0 --dims 4,4,4 >small.vdb
must makevdb --field linear:100,0,0,0 --dims 34,4,4 >large.vdb
must makevdb --field linear:1,0,0,0 --poke 1,1,1,1e20 --dims 4,4,4 >huge.vdb
tf() { echo '{"pellucid": "transfer-function/1", '"$1"'}' >tf.json; }
render() { vol-render -t tf.json --size 8x8 -o a.exr "$@"; }
silent() { check "$1" test ! -s stderr; }

tf '"scatter": [[0, 0], [1, 0.5]]'
exits 0 'nodes from 0 to 1, values to 3300' render large.vdb
says "vol-render: warning: the data's values, 0 to 3300, lie far outside the transfer function's nodes, 0 to 1*" 'is said'
exits 0 'values of 1e20' render huge.vdb
says "*lie far outside*" 'is said, too'
tf '"scatter": [[0, 0], [0.5, 1], [1, 0]]'
exits 0 'a peak' render large.vdb
says "*lie far outside*" 'a peak: is said'
exits 0 'nodes from 0 to 1, values to 3' render small.vdb
silent 'values to 3: nothing is wrong'
tf '"scatter": [[1500, 0], [1501, 1], [1502, 0]]'
exits 0 'narrow nodes in a wide range' render --fov 4 --eye 60,1.5,20 --look-at 15,1.5,1.5 large.vdb
silent 'narrow nodes: nothing is wrong'
tf '"isosurfaces": [{"value": 1, "opacity": 1}]'
exits 0 'one isosurface' render --fov 4 --eye 60,1.5,20 --look-at 0,1.5,1.5 large.vdb
silent 'one isosurface: nothing is wrong'

tf '"particle_step": 1000, "scatter": [[0, 0.5], [3, 0.5]]'
exits 0 'hardly any opacity' render small.vdb
says "vol-render: warning: the picture is nearly empty*1000 world units*--particle-step*" 'names the step'
exits 0 'more of it' render --particle-step 1v small.vdb
silent 'more of it: nothing is wrong'
exits 0 'a crop' render --crop 4x4+0+0 small.vdb
silent 'of a part nothing can be said'
tf '"emit": [[0, 1]]'
exits 0 'light without opacity' render small.vdb
silent 'light without opacity: nothing is wrong'
tf '"scatter": [[0, 0.5], [3, 0.6]]'
exits 0 'looking elsewhere' render --eye 0,0,50 --look-at 60,0,0 small.vdb
says "vol-render: warning: the picture is empty*" 'no ray meets anything'
exits 0 'before a bright background' render --background 1,1,1 --eye 0,0,50 --look-at 60,0,0 small.vdb
says "*the picture is empty*" 'it is the volume that counts'

# One node is a constant wherever it stands.
for list in '"scatter": [[7, 0.5]]' '"scatter": [[-1e9, 0.5]]' '"scatter": [[7, 0.5]], "absorb": [[1e6, 0.5, [0, 0, 0]]]' \
    '"emit": [[7, 1]]' '"surface": [[7, 0.5]]' '"scatter": [[7, 0.5], [9, 0.5]]'; do
    tf "$list"
    exits 0 "$list" render small.vdb
    silent "$list: nothing is wrong"
done
finish
