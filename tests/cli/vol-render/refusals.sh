# Options that make no sense: exit 2, an error that names the program, no output.
. "$TESTS/lib.sh"
echo '{"pellucid": "transfer-function/1", "scatter": [[0, 0.5], [1, 0.5]]}' >tf.json
makevdb >a.vdb

while read -r words; do
    # shellcheck disable=SC2086
    exits 2 "$words" vol-render -t tf.json --size 4x4 $words -o out.exr a.vdb
    says 'vol-render: error: *' "$words: says why"
    check "$words: one line" test "$(wc -l <stderr)" -le 2
    check_not "$words: no output" test -e out.exr
done <<END
--size 0x4
--size 4x0
--size -4x4
--size 4
--size 4x4x4
--size 3000000000x3000000000
--eye 0,0
--eye 0,0,0,0
--eye 0,0,nan
--eye 0,0,inf
--eye 1,2,3 --look-at 1,2,3
--up 0,0,0
--eye 0,5,0 --look-at 0,0,0 --up 0,1,0
--fov 0
--fov 180
--fov -5
--ortho 0
--ortho -1
--samples 0
--samples -1
--samples 1.5
--crop 4x4
--crop 0x4+0+0
--crop 4x4+2+2
--clip 1,0,0
--clip 0,0,0,1
--light sun:0,0,0
--light sun:1,2
--light sun:1,0,0:1,1
--light moon:1,0,0
--light point:1,2
--estimator best
--estimator direct --step 1
--estimator direct --step 1x
--estimator direct --step 0v
--estimator direct --step -1w
--aov nothing
--particle-step 0
--particle-step -1
--scalar-step 0
--probe 4,0
--probe 0,-1
--probe 1
--depth quarter
--background white
--background -1,0,0
--background 0,0,-1e-300
--background 1,1
--background #ffffff
--background 0.5
--background 1e39,0,0
END
finish
