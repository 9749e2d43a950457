# The classic model, surfaceness by gradient.
makevdb --dims 17,17,17 --voxel 0.2 --field waves >waves.vdb
cat >tf.json <<'END'
{ "pellucid": "transfer-function/1", "model": "classic", "particle_step": 0.8,
  "scatter": [[0.4, 0, [1, 0.9, 0.7]], [0.6, 0.8, [0.8, 0.4, 0.3]], [0.9, 0.1, [0.3, 0.5, 0.9]]],
  "surfaceness": {"gradient": [0.1, 0.6]} }
END
vol-render -t tf.json --no-history --size 48x36 --eye 6.4,4.8,9.6 --look-at 1.6,1.6,1.6 --fov 30 -o out.exr waves.vdb
