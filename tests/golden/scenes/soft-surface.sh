# Soft surfaces and particles in one exponent, two suns, layers, sheared voxels.
makevdb --dims 13,13,13 --map 0.25,0,0,0.06,0.25,0,0,0.03,0.25,0,0,0 --field waves >waves.vdb
cat >tf.json <<'END'
{ "pellucid": "transfer-function/1", "particle_step": 1.5, "scalar_step": 0.1,
  "surface": [[0.45, 0, [0.9, 0.8, 0.6]], [0.5, 0.7, [0.9, 0.8, 0.6]], [0.55, 0, [0.9, 0.8, 0.6]]],
  "scatter": [[0.5, 0, [0.3, 0.4, 0.8]], [1, 0.6, [0.3, 0.6, 0.9]]] }
END
vol-render -t tf.json --no-history --size 48x36 --eye 6.4,4.8,9.6 --look-at 1.8,1.6,1.6 --fov 30 --light sun:-1,-1,-1 \
    --light sun:1,-0.2,-0.5:0.1,0.2,0.5 --aov surface,scatter,normal -o out.exr waves.vdb
