# Coloured absorption and emission before a background; orthographic, 2 x 2 samples, a clip plane.
makevdb --dims 17,17,17 --voxel 0.2 --field waves >waves.vdb
cat >tf.json <<'END'
{ "pellucid": "transfer-function/1", "particle_step": 1.5,
  "absorb": [[0.3, 0, [0.9, 0.3, 0.1]], [0.7, 0.8, [0.2, 0.7, 0.4]], [1, 0.2, [0.1, 0.2, 0.9]]],
  "emit": [[0.8, 0], [1, 0.5, [1, 0.4, 0.1]]] }
END
vol-render -t tf.json --no-history --size 48x36 --ortho 5 --eye 6.4,4.8,9.6 --look-at 1.6,1.6,1.6 --samples 2 \
    --clip 1,1,0,2 --background 0.6,0.7,0.8 -o out.exr waves.vdb
