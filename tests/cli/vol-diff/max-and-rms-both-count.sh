makeexr 8x8 R=0.5 >a.exr
makeexr --poke 3,4,R=0.58 8x8 R=0.5 >b.exr
vol-diff --max 0.05 --rms 0.0101 a.exr b.exr
