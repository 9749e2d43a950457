# Damaged and truncated input: exit 3, one line that says where, no output.
. "$TESTS/lib.sh"
echo '{"pellucid": "transfer-function/1", "scatter": [[0, 0.5], [1, 0.5]]}' >tf.json

# N places spread over SIZE bytes, and the last byte.
spread() { awk -v n="$1" -v size="$2" 'BEGIN { for (i = 1; i < n; i++) print int(size * i / n); print size - 1 }'; }

# FILE, the places to cut it at, then programs: each refuses what is before each place.
cut_short() {
    whole=$1 cuts=$2 cut_file=cut.${1#*.} bad=0 tried=0
    size=$(wc -c <"$whole")
    shift 2
    for cut in $cuts; do
        [ "$cut" -lt "$size" ] || continue
        head -c "$cut" "$whole" >"$cut_file"
        for program in "$@"; do
            tried=$((tried + 1))
            $program "$cut_file" >stdout 2>stderr
            code=$?
            if [ $code != 3 ] || ! grep -q "^[a-z]*-[a-z]*: error: .*$cut_file" stderr || [ -e out.exr ] ||
                [ -s stdout ]; then
                bad=$((bad + 1))
                echo "$program, cut at $cut of $size: exit $code: $(head -n 1 stderr)" >>"cuts.$whole"
                rm -f out.exr
            fi
        done
    done
    check "$tried runs on $whole cut short" test $bad = 0 -a $tried -gt 0
    [ $bad = 0 ] || sed 's/^/# /' "cuts.$whole"
}

# Cuts: a handful at the start, where every byte means something, then spread over the file.
must makevdb --dims 20,20,20 --field noise:1 --text key=value --also --name second --field waves >a.vdb
size=$(wc -c <a.vdb)
cut_short a.vdb "0 1 3 4 7 8 12 15 16 20 21 40 56 57 58 60 61 64 65 72 90 100 120 150 200 300 $(spread 40 "$size")" \
    'vol-render -t tf.json --size 4x4 -o out.exr' vol-info
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
    bad-bbox-empty*) # a sound grid of nothing
        exits 0 "vol-render $name" vol-render "$file" -t tf.json --size 4x4
        says "vol-render: warning: *is empty*" "says why: vol-render $name"
        continue
        ;;
    esac
    for program in vol-render vol-info vol-diff; do
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
cut_short a.exr "0 1 3 4 7 8 9 20 50 100 150 200 250 300 $(spread 20 "$(wc -c <a.exr)")" \
    'vol-diff a.exr' vol-info 'exr-join -o out.exr'
finish
