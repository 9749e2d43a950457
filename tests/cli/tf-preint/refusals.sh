. "$TESTS/lib.sh"
echo '{"pellucid": "transfer-function/1", "scatter": [[0, 0.5], [1, 0.2]]}' >tf.json
echo '{"pellucid": "transfer-function/1", "particle_step": 1e-30, "emit": [[0, 1e18], [1, 1]]}' >bright.json
makevdb >a.vdb
must tf-preint --size 8 -o t.exr tf.json
exits 2 'one node' tf-preint --size 1 tf.json
exits 2 'more nodes than the full table can have' tf-preint --size 5000 tf.json
says '*2 to 4096 for the full table*' 'the bound is named'
check 'without it there can be more' tf-preint --size 5000 --part tf,integrals -o many.exr tf.json
exits 2 'a range that is empty' tf-preint --range 1,1 tf.json
exits 2 'a range of one number' tf-preint --range 1 tf.json
exits 2 'no step' tf-preint --step 0 tf.json
exits 2 'an unknown part' tf-preint --part tf,all tf.json
exits 2 'no octaves' tf-preint --octaves 0 tf.json
exits 2 'a plot to stdout' tf-preint --plot - tf.json
exits 3 'emission beyond floats' tf-preint -o x.exr bright.json
says '*too large to tabulate*' 'why is said'
exits 3 'a volume in place of a transfer function' tf-preint -o x.exr a.vdb
exits 3 'a transfer function in place of a volume' tf-preint --volume tf.json -o x.exr tf.json
exits 3 'an image in place of a transfer function' sh -c 'makeexr 8x8 R=0.5 >i.exr; tf-preint -o x.exr i.exr'
says '*no transfer function in the header*' 'what is missing is said'
exits 3 'tables cut short' sh -c 'head -c 3000 t.exr >cut.exr; tf-preint -o x.exr cut.exr'
check_not 'no output of what was refused' test -e x.exr
finish
