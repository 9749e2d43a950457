makeexr 8x6 R=1 normal.X=0 >a.exr
vol-info --json a.exr >a.json
json a.json && grep -q normal.X a.json
