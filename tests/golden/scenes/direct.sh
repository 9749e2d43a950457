# The marching estimator on a sparse grid of half floats.
makevdb --sparse --type half --dims 20,20,20 --voxel 0.17 --field waves >waves.vdb
cat >tf.json <<'END'
{ "pellucid": "transfer-function/1", "particle_step": 0.8,
  "scatter": [[0.3, 0, [1, 0.9, 0.7]], [0.8, 0.7, [0.5, 0.6, 0.9]]] }
END
vol-render -t tf.json --no-history --estimator direct --step 0.5v --size 48x36 --eye 6.4,4.8,9.6 --look-at 1.6,1.6,1.6 \
    --fov 30 --aov Z,steps -o out.exr waves.vdb
