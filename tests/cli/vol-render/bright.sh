# No pixel is infinite: what is too bright for that is refused, in the file where a single number is, and where colours,
# lights and depths add up to it; what is just below is rendered.
. "$TESTS/lib.sh"
must makevdb --dims 5,5,5 --field linear:0.25,0,0,0 >a.vdb
look() { printf '{"pellucid": "transfer-function/1", %s}\n' "$1" >tf.json; }
render() { vol-render -q -f -t tf.json --size 6x6 "$@"; }
refused() { # CODE NAME SAYS ARGUMENT...
    code=$1 name=$2 why=$3
    shift 3
    exits "$code" "$name" render -o out.exr "$@"
    says "*$why*" "$name: says why"
}
for list in surface scatter emit; do
    look "\"$list\": [[0, 0.5, [1, 1e38, 0]], [1, 0.5]]"
    refused 3 "a colour in $list" "key '$list', node 1: green 1e+38 lies outside" a.vdb
done
look '"isosurfaces": [{"value": 0.5, "opacity": 1, "color": [1e19, 0, 0]}]'
refused 3 'a colour of an isosurface' 'red 1e+19 lies outside' a.vdb
look '"emit": [[0, 1e38]]'
refused 3 'a strength' 'strength 1e+38 lies outside' a.vdb
look '"scatter": [[0, 0.5]], "shading": {"diffuse": 1e30}'
refused 3 'shading' 'diffuse 1e+30 lies outside' a.vdb
look '"scatter": [[0, 0.5]]'
for light in sun:0,0,1:1e37,0,0 point:1e37,0,0 point:0,0,0:0,0,1e39; do
    refused 2 "$light" "light '$light': *1e36" --light $light a.vdb
done

# Together.
look '"surface": [[0, 0.5, [1e17, 0, 0]], [1, 0.5]]'
refused 2 'a colour and a light' 'make places as bright as *more than 1e+18' --light sun:0,0,1:1e3,0,0 a.vdb
refused 2 'several lights' 'as bright as' --light sun:0,0,1:8,0,0 --light sun:0,1,0:8,0,0 a.vdb
refused 2 'a near light' 'as bright as' --light point:2,2,2:9,0,0 a.vdb
exits 0 'the same farther away' render --light point:2,2,80:9,0,0 -o out.exr a.vdb
look '"model": "classic", "scatter": [[0, 0.5, [1e12, 0, 0]], [1, 0.5]], "shading": {"ambient": 1e3, "specular": 1e3}'
refused 2 'classic' 'as bright as' --light sun:0,0,1:1e4,0,0 a.vdb

# What is let through is finite: whatever the model, the estimator, the precision, the size of voxels.
finite() { # NAME ARGUMENT...
    name=$1
    shift
    for estimator in exact full integrals direct; do
        for precision in '' --precise; do
            must render --estimator $estimator $precision --aov surface,scatter,emit --background 3e38,0,1 "$@" -o out.exr
            vol-info out.exr >said
            check "$name, $estimator $precision" sh -c '! grep -q "\(inf\|nan\): [1-9]" said && grep -q "max: [1-9].*e+" said'
        done
    done
}
look '"particle_step": 1e-20, "emit": [[0, 1e18, [1e18, 0, 0]]]'
finite 'emission as strong as can be' a.vdb
refused 3 'the same before a background as bright as can be' 'emission of ' --background 3.4e38,0,0 a.vdb
for voxel in 1e-9 1 1e9; do
    must makevdb --dims 5,5,5 --field linear:0.25,0,0,0 --voxel $voxel >a.vdb
    must makevdb --dims 5,5,5 --field waves --voxel $voxel --sparse >b.vdb
    step="\"particle_step\": $voxel"
    look "$step, \"surface\": [[0, 1, [1e15, 0, 1]], [1, 1, [9e14, 1, 1]]], \"scatter\": [[0, 1, [1e15, 0, 1]], [1, 0.5]],
        \"isosurfaces\": [{\"value\": 0.3, \"opacity\": 0.5, \"color\": [1e15, 1, 1]}]"
    finite "hybrid, $voxel" --light sun:0,0,1:500,1,0 b.vdb
    finite "head light, $voxel" b.vdb
    look "$step, \"model\": \"classic\", \"scatter\": [[0, 1, [1e9, 0, 1]], [1, 0.5]], \"shading\": {\"ambient\": 1e3}"
    finite "classic, $voxel" --light sun:0,0,1:9e4,1,0 b.vdb
    look "$step, \"emit\": [[0, 1e9, [1e17, 0, 1]], [1, 1e8]], \"absorb\": [[0, 0.001]]"
    finite "emission, $voxel" b.vdb
done
finish
