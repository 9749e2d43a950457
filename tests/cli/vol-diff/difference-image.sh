# the difference image is written although the answer is no, and tells where
makeexr 8x8 R=0.5 >a.exr
makeexr --poke 3,4,R=0.75 8x8 R=0.5 >b.exr
makeexr --poke 3,4,R=0.25 8x8 R=0 >want.exr
vol-diff -o d.exr a.exr b.exr
code=$?
vol-diff want.exr d.exr || exit 9
exit $code
