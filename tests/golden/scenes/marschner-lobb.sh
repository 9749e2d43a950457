# Opaque isosurface with a highlight, headlight, perspective: ripples show what normals are worth.
vol-gen field marschner-lobb --size 41 -o ml.vdb
cat >tf.json <<'END'
{ "pellucid": "transfer-function/1", "isosurfaces": [{"value": 0.5, "opacity": 1, "color": [0.8, 0.5, 0.3]}] }
END
vol-render -t tf.json --no-history --size 64x48 --samples 3 --fov 30 --eye 2.2,-3,2.4 --look-at 0,0,0 --up 0,0,1 -o out.exr ml.vdb
