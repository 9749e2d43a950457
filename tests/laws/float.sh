# In float, the exact estimator's pictures are within 1e-5 of those in double, silhouettes in rough fields and all: rays that
# need double take it, and few do.
. "$TESTS/lib.sh"

# White noise in steps of 1/255.
awk 'BEGIN {
    print "NRRD0004\ntype: float\ndimension: 3\nsizes: 48 48 48\nencoding: ascii\n"
    for (i = 0; i < 110592; i++) { x = (x * 16807) % 2147483647 + (i == 0); print int(x / 2147483647 * 256) / 255 }
}' >noise.nrrd
must vol-import -q -f --no-history -o noise.vdb noise.nrrd

cat >isosurface.json <<'J'
{"pellucid": "transfer-function/1", "isosurfaces": [{"value": 0.5, "opacity": 1, "color": [0.95, 0.62, 0.22]}]}
J
cat >mixed.json <<'J'
{"pellucid": "transfer-function/1", "particle_step": 1,
 "scatter": [[0.2, 0], [0.6, 0.9, [0.2, 0.5, 1]], [0.6, 0.1, [1, 0.5, 0.2]]],
 "isosurfaces": [{"value": 0.7, "opacity": 0.5}, {"value": 0.9, "opacity": 0.9}]}
J
cat >classic.json <<'J'
{"pellucid": "transfer-function/1", "model": "classic", "particle_step": 1, "scatter": [[0.7, 0], [0.8, 0.9, [1, 0.5, 0.2]]]}
J

few_in_double() {
    awk -F '[:,]' '/"rays_in_double"/ { n = $2; found = 1 } END { print n; exit !(found && n < 0.03 * 384 * 384) }' stats.json
}
for tf in isosurface mixed classic; do
    must vol-render -q -f --no-history -t $tf.json --size 384x384 --stats stats.json -o float.exr noise.vdb
    must vol-render -q -f --no-history -t $tf.json --size 384x384 --precise -o double.exr noise.vdb
    check "$tf: within 1e-5 of double" vol-diff --max 1e-5 float.exr double.exr
    check "$tf: few rays in double" few_in_double
done

finish
