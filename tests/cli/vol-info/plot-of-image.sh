# --plot draws an image as it is seen: sRGB, cut to 0..1, NaN magenta.  Read back as a background that nothing hides.
makevdb >a.vdb
cat >clear.json <<'END'
{ "pellucid": "transfer-function/1", "scatter": [] }
END
# $1 R, $2 G, $3 B of the image; then what the PNG must hold, to half a step of 8 bits
shown() {
    makeexr 8x6 R="$1" G="$2" B="$3" >a.exr
    vol-info --plot a.png a.exr >a.txt
    vol-render -q -t clear.json --size 8x6 --background a.png --probe 3,2 a.vdb >a.json
    awk -v r="$4" -v g="$5" -v b="$6" '
        /"[RGB]":/ { gsub(/[",:]/, " "); value[$1] = $2; seen++ }
        function off(x, y) { return x - y > 0.004 || y - x > 0.004 }
        END { exit seen != 3 || off(value["R"], r) || off(value["G"], g) || off(value["B"], b) }' a.json ||
        { echo "$*"; cat a.json; exit 1; }
}
shown 0 0.5 1  0 0.5 1
shown 0.002 0.2 0.8  0.002 0.2 0.8
shown -3 7 0.05  0 1 0.05
shown nan 0.5 0.5  1 0 1
shown 0.5 0.5 nan  1 0 1
shown inf -inf 0  1 0 0
