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

# The contents of inputs count, their names do not; what is taken of them counts.
quiet() { vol-render -q --no-history --size 28x20 "$@"; }
cp tf.json other.json && cp a.vdb other.vdb && must makeexr 28x20 R=0.1 G=0.2 B=0.3 >plate.exr && cp plate.exr other.exr
must render -o seen.exr a.vdb && cp seen.exr seen-too.exr
must quiet -t tf.json --background plate.exr --camera seen.exr -o want.exr a.vdb
check 'another name of the transfer function' sh -c \
    'vol-render -q --no-history --size 28x20 -t other.json --background plate.exr --camera seen.exr a.vdb | cmp - want.exr'
check 'it through a pipe' sh -c \
    'vol-render -q --no-history --size 28x20 -t - --background plate.exr --camera seen.exr a.vdb <tf.json | cmp - want.exr'
check 'of the background' sh -c \
    'vol-render -q --no-history --size 28x20 -t tf.json --background other.exr --camera seen.exr a.vdb | cmp - want.exr'
check 'it through a pipe' sh -c \
    'vol-render -q --no-history --size 28x20 -t tf.json --background - --camera seen.exr a.vdb <plate.exr | cmp - want.exr'
check 'of the camera' sh -c \
    'vol-render -q --no-history --size 28x20 -t tf.json --background plate.exr --camera seen-too.exr other.vdb | cmp - want.exr'
hash_of() { vol-info --metadata "$1" | grep argsHash; }
differs() { # NAME FILE FILE: their argsHash
    check "$1" test "$(hash_of "$2")" != "$(hash_of "$3")"
}
must vol-render -q -t tf.json --size 70x50 --eye 3,1,2 -o other-view.exr a.vdb
must quiet -t tf.json --background plate.exr --camera other-view.exr -o no.exr a.vdb
differs 'another camera' want.exr no.exr
must quiet -t plain.json --background plate.exr --camera seen.exr -o no.exr a.vdb
differs 'another transfer function' want.exr no.exr
must quiet -t tf.json --background 0.1,0.2,0.3 -o c1.exr a.vdb
must quiet -t tf.json --background 0.1,0.2,0.4 -o c2.exr a.vdb
differs 'another colour' c1.exr c2.exr
printf '%s\n' '[{"Name": "x", "ColorSpace": "RGB", "RGBPoints": [0, 0, 0, 0, 1, 1, 1, 1], "Points": [0, 0, 0.5, 0, 1, 1, 0.5, 0]},' \
    ' {"Name": "y", "ColorSpace": "RGB", "RGBPoints": [0, 0, 0, 0, 1, 1, 1, 1], "Points": [0, 0, 0.5, 0, 1, 1, 0.5, 0]}]' >maps.json
cp maps.json maps-too.json
must quiet -t maps.json#x -o m1.exr a.vdb
must quiet -t maps-too.json#x -o m2.exr a.vdb
must quiet -t maps.json#y -o m3.exr a.vdb
check 'a map in a file of another name' cmp m1.exr m2.exr
differs 'another map of the file' m1.exr m3.exr
preint() { tf-preint -q --no-history --size 8 "$@"; }
must preint --volume a.vdb -o p1.exr maps.json#x
must preint --volume other.vdb -o p2.exr maps-too.json#x
must preint --volume a.vdb -o p3.exr maps.json#y
check 'tf-preint: other names' cmp p1.exr p2.exr
check 'tf-preint: through a pipe' sh -c 'tf-preint -q --no-history --size 8 --volume - maps.json#x <a.vdb | cmp - p1.exr'
differs 'tf-preint: another map of the file' p1.exr p3.exr
must quiet -t p1.exr --estimator full -o t1.exr a.vdb
check 'tables of another name' sh -c \
    'vol-render -q --no-history --size 28x20 -t p2.exr --estimator full a.vdb | cmp - t1.exr'
must quiet -t tf.json --crop 28x10+0+0 -o top.exr a.vdb
must quiet -t other.json --crop 28x10+0+10 -o bottom.exr a.vdb
check 'crops made from copies are joined' exr-join -o joined.exr top.exr bottom.exr
if [ -x "$OUT/bin/vol-import" ]; then
    for i in 1 2 3; do printf '%s%s%s%s' $i 2 3 4 | tee s$i.raw >t$((i + 6)).raw; done
    must vol-import --no-history --dims 2,2 --type u8 --slices 1:3 -o s.vdb s%d.raw
    check 'vol-import: slices of other names' sh -c \
        'vol-import --no-history --dims 2,2 --type u8 --slices 7:9 t%d.raw | cmp - s.vdb'
fi
finish
