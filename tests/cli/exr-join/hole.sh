makeexr --window 0,0,3,7 8x8 R=0.5 >a.exr
makeexr --window 4,0,7,6 8x8 R=0.5 >b.exr
exr-join -o j.exr a.exr b.exr
code=$?
test ! -e j.exr || exit 9
exit $code
