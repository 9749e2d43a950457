makeexr 8x8 R=nan G=nan B=nan A=nan >a.exr
makeexr 8x8 R=0.5 G=0.5 B=0.5 A=0.5 >b.exr
vol-diff --max 1000 --rms 1000 --rel 1000 a.exr b.exr
