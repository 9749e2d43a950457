makeexr 8x8 R=nan >a.exr
cp a.exr b.exr
vol-diff --max 1000 a.exr b.exr
