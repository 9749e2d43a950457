# Damaged and truncated input: exit 3, one line that says where, no output.
. "$TESTS/lib.sh"
echo '{"pellucid": "transfer-function/1", "scatter": [[0, 0.5], [1, 0.5]]}' >tf.json


# Cuts: a handful at the start, where every byte means something, then spread over the file.
must makevdb --dims 20,20,20 --field noise:1 --text key=value --also --name second --field waves >a.vdb
size=$(wc -c <a.vdb)
bad=0 tried=0
for cut in 0 1 3 4 7 8 12 15 16 20 21 40 56 57 58 60 61 64 65 72 90 100 120 150 200 300 $(awk -v n="$size" 'BEGIN { for (i = 1; i < 40; i++) print int(n * i / 40); print n - 1 }'); do
    [ "$cut" -lt "$size" ] || continue
    head -c "$cut" a.vdb >cut.vdb
    for program in 'vol-render -t tf.json --size 4x4 -o out.exr' 'vol-info'; do
        tried=$((tried + 1))
        $program cut.vdb >stdout 2>stderr
        code=$?
        if [ $code != 3 ] || ! grep -q '^vol-[a-z]*: error: .*cut.vdb' stderr || [ -e out.exr ] || [ -s stdout ]; then
            bad=$((bad + 1))
            echo "$program, cut at $cut of $size: exit $code: $(head -n 1 stderr)" >>why
            rm -f out.exr
        fi
    done
done
check "$tried runs on a VDB cut short" test $bad = 0
[ $bad = 0 ] || sed 's/^/# /' why
exits 3 'a cut pipe' sh -c 'head -c 2000 a.vdb | vol-render -t tf.json --size 4x4'
check_not 'no output from a cut pipe' test -s stdout

# A file with one byte changed: read or refused, but never a crash and never a partial output.
bad=0 tried=0
for at in $(awk -v n="$size" 'BEGIN { for (i = 0; i < 60; i++) print i * 7 % 400 + 4; for (i = 0; i < 40; i++) print int((i * 0.618034 % 1) * n) }'); do
    { head -c "$at" a.vdb; printf '\377'; tail -c +$((at + 2)) a.vdb; } >flipped.vdb
    tried=$((tried + 1))
    vol-render -t tf.json --size 4x4 -o out.exr flipped.vdb >stdout 2>stderr
    code=$?
    case $code in
    0) [ -s out.exr ] ;;
    3 | 5) [ ! -e out.exr ] ;;
    *) false ;;
    esac || { bad=$((bad + 1)); echo "byte $at: exit $code: $(head -n 1 stderr)" >>flips; }
    rm -f out.exr
done
check "$tried runs on a VDB with one byte changed" test $bad = 0
[ $bad = 0 ] || sed 's/^/# /' flips

# Files that once broke other readers.
for file in "$TESTS"/data/damaged/*.vdb; do
    name=${file##*/}
    case $name in
    bad-bbox-empty*) programs=vol-render ;; # an empty grid: nothing to render, but something to tell
    *) programs="vol-render vol-info vol-diff" ;;
    esac
    for program in $programs; do
        set -- $program "$file"
        case $program in
        vol-render) set -- "$@" -t tf.json --size 4x4 ;;
        vol-diff) set -- "$@" "$file" ;;
        esac
        exits 3 "$program $name" "$@"
        check_not "no output: $program $name" test -s stdout
        says "$program: error: *" "says why: $program $name"
    done
done

# Images.
must makeexr 37x29 R=0.5 G=0.25 B=1 A=0 normal.X=3 >a.exr
size=$(wc -c <a.exr)
bad=0 tried=0
for cut in 0 1 3 4 7 8 9 20 50 100 150 200 250 300 $(awk -v n="$size" 'BEGIN { for (i = 1; i < 20; i++) print int(n * i / 20); print n - 1 }'); do
    [ "$cut" -lt "$size" ] || continue
    head -c "$cut" a.exr >cut.exr
    for program in "vol-diff a.exr" vol-info "exr-join -o out.exr"; do
        tried=$((tried + 1))
        $program cut.exr >stdout 2>stderr
        code=$?
        if [ $code != 3 ] || ! grep -q ': error: .*cut.exr' stderr || [ -e out.exr ]; then
            bad=$((bad + 1))
            echo "$program, cut at $cut of $size: exit $code: $(head -n 1 stderr)" >>cuts
            rm -f out.exr
        fi
    done
done
check "$tried runs on an EXR cut short" test $bad = 0
[ $bad = 0 ] || sed 's/^/# /' cuts
finish
