# Light that falls on a rough field from next to it, from inside it and through a spot's cone, highlights broad and sharp: the
# exact estimator's pictures are the same in float and in double, and what fine steps converge to.
. "$TESTS/lib.sh"

awk 'BEGIN {
    print "NRRD0004\ntype: float\ndimension: 3\nsizes: 10 10 10\nencoding: ascii\n"
    for (i = 0; i < 1000; i++) { x = (x * 16807) % 2147483647 + (i == 0) * 12345; print x / 2147483647 }
}' >noise.nrrd
must vol-import -q -f --no-history -o noise.vdb noise.nrrd

function_of() {
    printf '{"pellucid": "transfer-function/1", "model": "%s", "particle_step": 3,
 "shading": {"ambient": 0.1, "diffuse": 0.5, "specular": 0.8, "shininess": %s},
 "%s": [[0, 0.3, [1, 1, 1]], [1, 0.6, [1, 0.5, 0.2]]]}' "$1" "$2" "$3" >look.json
}

compare() { # what model shininess list light bound
    function_of "$2" "$3" "$4"
    must vol-render -q -f --no-history -t look.json --light "$5" --size 16x16 -o float.exr noise.vdb
    must vol-render -q -f --no-history -t look.json --light "$5" --size 16x16 --precise -o double.exr noise.vdb
    must vol-render -q -f --no-history -t look.json --light "$5" --size 16x16 --precise --estimator direct --step 0.001v \
        -o steps.exr noise.vdb
    check "$1: float is within 1e-5 of double" vol-diff --max 1e-5 float.exr double.exr
    check "$1: $6 from what steps of 0.001 voxels find" vol-diff --max "$6" double.exr steps.exr
}

compare "point beside, broad" classic 1 scatter point:-1,5,5:40,40,40 2e-3
compare "point inside, broad" classic 1 scatter point:5.2,5.3,5.1:9,9,9 2e-3
compare "point beside, sharp" classic 1000 scatter point:-1,5,5:40,40,40 2e-3
compare "spot" classic 10 scatter spot:-1,5,5,1,0,0,60:40,40,40 2e-3
compare "sun, sharp" classic 1000 scatter sun:1,1,0 2e-3
compare "spot, half a degree from afar" classic 10 scatter spot:5,5,2000,0,0,-1,0.2:4e6,4e6,4e6 1e-2
compare "surface, point inside" hybrid 10 surface point:5.2,5.3,5.1:9,9,9 5e-3
compare "surface, a root of the cosine" hybrid 0.3 surface sun:1,1,0 2e-2

finish
