# A tile of 4096^3 voxels in the classic model is crossed in a few pieces, whatever lights it: no normal is known in it, and
# lights that stand somewhere change smoothly, but where they begin to shine.  The light is that of the closed form.
. "$TESTS/lib.sh"
must makevdb --empty --sparse --tile 0,0,0,4096,0.5 >tile.vdb
# All of a ray is one medium, lit by ambient light alone.
printf '{"pellucid": "transfer-function/1", "model": "classic", "particle_step": 4, "surfaceness": [[0, 0.75]],
    "shading": {"ambient": 1, "diffuse": 0, "specular": 0}, "scatter": [[0, 0.00390625, [0.5, 1, 0.25]]]}\n' >tf.json
printf '{"pellucid": "transfer-function/1", "model": "classic", "particle_step": 4,
    "scatter": [[0, 0.0001, [1, 0.5, 0.2]], [1, 0.002, [0.2, 0.7, 1]]]}\n' >thin.json
count() { sed -n "s/.*\"$1\": *\([0-9]*\).*/\1/p" stats.json | head -n 1; }

for light in sun:1,2,-1 point:1000,2000,6000 point:2010,2000,3000 spot:2300,2000,2000,-1,0.1,0,30; do
    for estimator in exact full integrals direct; do
        must vol-render -q -f -t thin.json --size 32x32 --estimator $estimator --light $light --stats stats.json -o out.exr tile.vdb
        check "$light, $estimator: a few stretches a ray" test "$(count entered)" -le 30000
        [ $estimator != exact ] || check "$light: a few cells" test "$(count cells)" -le 100000
    done
done

# In the middle of the picture the ray runs from z = 4096 to -1 at x = y = 2000.
want() { # LIGHT: what arrives as an awk expression of z, at most as bright as from half a voxel
    awk 'BEGIN {
        mu = -log(1 - 0.00390625) / 4; n = 819400; h = 4097 / n
        for (i = 0; i <= n; i++) {
            z = 4096 - i * h
            sum += (i == 0 || i == n ? 1 : i % 2 ? 4 : 2) * exp(-mu * i * h) * (0.25 + 0.75 * ('"$1"'))
        }
        printf "%.12g\n", sum * h / 3 * mu
    }'
}
near() { awk -v got="$1" -v want="$2" -v most="$3" 'BEGIN { d = got / want - 1; exit !(d < most && d > -most) }'; }
compare() { # NAME LIGHT WANT BOUND_IN_FLOAT BOUND_IN_DOUBLE
    for estimator in exact full integrals direct; do
        for precision in '' --precise; do
            must vol-render -q -t tf.json --size 1x1 --eye 2000,2000,6000 --look-at 2000,2000,0 --estimator $estimator \
                $precision --light "$2" --probe 0,0 tile.vdb >pixel.json
            got=$(tr ',' '\n' <pixel.json | sed -n 's/.*"G": *\([0-9.e+-]*\).*/\1/p')
            bound=$5
            [ -n "$precision" ] || bound=$4
            check "$1, $estimator $precision: $got is $3" near "$got" "$3" "$bound"
        done
    done
}
compare 'in front' point:2000,2000,5000:1e6,1e6,1e6 "$(want '1e6 / (5000 - z) ^ 2')" 1e-5 2e-8
compare 'beside' point:2300,2000,3000:1e4,1e4,1e4 "$(want '1e4 / (9e4 + (3000 - z) ^ 2)')" 1e-5 2e-9
compare 'behind' point:2000,2300,-3000:1e6,1e6,1e6 "$(want '1e6 / (9e4 + (-3000 - z) ^ 2)')" 1e-5 2e-9
compare 'near' point:2003,2000,3900:30,30,30 "$(want '30 / (9 + (3900 - z) ^ 2)')" 2e-4 2e-8
ball='d2 = 0.04 + (3900 - z) ^ 2'
compare 'nearer than half a voxel' point:2000.2,2000,3900:1,1,1 "$(want "($ball) < 0.25 ? 4 : 1 / d2")" 2e-3 2e-6
# A spot at x = 2300, z = 3000, towards the ray: dark beyond 15 degrees, full within 13.5.
s='(300 / sqrt(9e4 + (3000 - z) ^ 2) - 0.9659258262890683) / (0.9723699203976766 - 0.9659258262890683)'
profile="((s = $s) <= 0 ? 0 : s >= 1 ? 1 : s * s * (3 - 2 * s))"
compare 'a spot' spot:2300,2000,3000,-1,0,0,30:1e4,1e4,1e4 "$(want "$profile * 1e4 / (9e4 + (3000 - z) ^ 2)")" 1e-4 2e-6
finish
