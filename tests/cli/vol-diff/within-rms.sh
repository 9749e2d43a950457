# one pixel of 64 is off by 0.08: rms 0.01
makeexr 8x8 R=0.5 >a.exr
makeexr --poke 3,4,R=0.58 8x8 R=0.5 >b.exr
vol-diff --rms 0.0101 a.exr b.exr
