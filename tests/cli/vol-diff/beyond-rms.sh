makeexr 8x8 R=0.5 >a.exr
makeexr --poke 3,4,R=0.58 8x8 R=0.5 >b.exr
vol-diff --rms 0.0099 a.exr b.exr
