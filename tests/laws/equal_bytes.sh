# The same input gives the same bytes, whatever does not belong to the input.
. "$TESTS/lib.sh"

cat >tf.json <<'END'
{ "pellucid": "transfer-function/1", "particle_step": 0.2, "scalar_step": 0.1,
  "scatter": [[0.2, 0, [1, 0.8, 0.6]], [0.6, 0.1, [0.9, 0.7, 0.5]], [0.8, 0.6, [0.2, 0.5, 0.9]]],
  "absorb": [[0.4, 0, [0.9, 0.5, 0.2]], [1, 0.2, [0.9, 0.5, 0.2]]],
  "emit": [[0.7, 0], [1, 0.2, [1, 0.3, 0.1]]],
  "surface": [[0.5, 0, [0.8, 0.8, 0.7]], [0.55, 0.4, [0.8, 0.8, 0.7]], [0.6, 0, [0.8, 0.8, 0.7]]],
  "isosurfaces": [{"value": 0.65, "opacity": 0.4, "color": [0.7, 0.2, 0.2]}] }
END
grep -v "surface\":" tf.json >plain.json
view='--size 70x50 --eye 2,1.5,4 --look-at 0.5,0.5,0.5 --light sun:-1,-1,-2 --light sun:1,0,-1:0.2,0.3,0.4'
must vol-gen field marschner-lobb --size 33 -o a.vdb
must makevdb --dims 33,33,33 --voxel 0.04 --field waves >waves.vdb
render() { # shellcheck disable=SC2086
    vol-render -t tf.json $view "$@"
}

for volume in a waves; do
    must render -j1 -o one.exr $volume.vdb
    check "$volume: two threads" sh -c "vol-render -t tf.json $view -j2 $volume.vdb | cmp - one.exr"
    check "$volume: seven threads" sh -c "vol-render -t tf.json $view -j7 $volume.vdb | cmp - one.exr"
    check "$volume: no vector instructions" sh -c "vol-render -t tf.json $view --cpu scalar $volume.vdb | cmp - one.exr"
    check "$volume: through a pipe" sh -c "cat $volume.vdb | vol-render -t tf.json $view | cat | cmp - one.exr"
    check "$volume: verbose" sh -c "vol-render -t tf.json $view -v -v $volume.vdb 2>said | cmp - one.exr"
    check "$volume: with statistics and progress" sh -c \
        "vol-render -t tf.json $view --stats s.json --progress always $volume.vdb 2>said | cmp - one.exr"
    check "$volume: another time zone, language and TMPDIR" sh -c \
        "TZ=Asia/Tokyo LC_ALL=de_DE.UTF-8 LANG=de_DE.UTF-8 TMPDIR=/nowhere HOME=/nowhere USER=nobody
         vol-render -t tf.json $view $volume.vdb | cmp - one.exr"
    check "$volume: again, a second later" sh -c "sleep 1.1; vol-render -t tf.json $view $volume.vdb | cmp - one.exr"
    mkdir elsewhere
    cp tf.json $volume.vdb elsewhere/
    check "$volume: from another folder" sh -c "cd elsewhere && vol-render -t tf.json $view $volume.vdb | cmp - ../one.exr"
    rm -r elsewhere
    must render --precise -j1 --cpu scalar -o precise.exr $volume.vdb
    check "$volume: --precise, two threads" sh -c "vol-render -t tf.json $view --precise -j2 $volume.vdb | cmp - precise.exr"
    # Shading along a soft surface is a quadrature, with more points in double; all else is exact but for rounding.
    check "$volume: float and double agree" vol-diff --rms 5e-7 --max 2e-5 one.exr precise.exr
    must vol-render -t plain.json $view -o plain.exr $volume.vdb
    must vol-render -t plain.json $view --precise -o plain-precise.exr $volume.vdb
    check "$volume: float and double agree closely" vol-diff --max 2e-6 --rms 1e-6 plain.exr plain-precise.exr
done

# Pipes of our own programs equal files.
must vol-gen field marschner-lobb --size 33 >b.vdb
check 'vol-gen: stdout and file' cmp a.vdb b.vdb
must render -o file.exr a.vdb
check 'vol-gen | vol-render' sh -c "vol-gen field marschner-lobb --size 33 | vol-render -t tf.json $view | cmp - file.exr"
if [ -x "$OUT/bin/vol-import" ]; then
    awk 'BEGIN { for (i = 0; i < 4096; i++) printf "%c", 33 + (i * 7 + int(i / 16) * 5) % 90 }' >raw
    import='vol-import --dims 16,16,16 --type u8 --spacing 0.1,0.1,0.15'
    must $import -o i.vdb raw
    cat >bytes.json <<'END'
{ "pellucid": "transfer-function/1", "scatter": [[30, 0, [1, 0.8, 0.6]], [120, 0.9, [0.2, 0.5, 0.9]]],
  "isosurfaces": [{"value": 80, "opacity": 0.5}] }
END
    must vol-render -t bytes.json --size 40x30 -o i.exr i.vdb
    check 'vol-import | vol-render' sh -c "$import raw | vol-render -t bytes.json --size 40x30 | cmp - i.exr"
    check 'vol-import < raw | vol-render' sh -c "$import <raw | vol-render -t bytes.json --size 40x30 | cmp - i.exr"
else
    skipped 'vol-import | vol-render' 'vol-import is not built'
fi
finish
