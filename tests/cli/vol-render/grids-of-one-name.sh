# Two grids of one name: the first is taken, which is said; NAME[1] is the second.  Unnamed grids are ''.
. "$TESTS/lib.sh"
echo '{"pellucid": "transfer-function/1", "interpolate": "extinction", "scatter": [[0, 0], [1, 0.5]]}' >tf.json
must makevdb --field const:1 >one.vdb
must makevdb --field const:0.5 >half.vdb
must makevdb --field const:1 --also --field const:0.5 >both.vdb
must makevdb --name '' --field const:1 --also --field const:0.5 >unnamed.vdb
for n in one half; do must vol-render -t tf.json --size 4x4 -o "$n.exr" "$n.vdb"; done
check_not 'they can be told apart' vol-diff one.exr half.exr

render() { vol-render -t tf.json --size 4x4 -o a.exr "$@"; }
exits 0 'two of one name' render both.vdb
says "vol-render: warning: there are 2 grids named 'density'*density?1?*" 'a warning names the second'
check 'the first is taken' vol-diff a.exr one.exr
exits 0 'the same by name' render --grid density both.vdb
says "*warning: there are 2 grids*" 'warned of as well'
exits 0 'the second' render --grid 'density[1]' both.vdb
check 'the second: nothing to warn of' test ! -s stderr
check 'the second is taken' vol-diff a.exr half.exr
exits 0 'the first by number' render --grid 'density[0]' both.vdb
check 'the first by number is taken' vol-diff a.exr one.exr
exits 3 'no third' render --grid 'density[2]' both.vdb
says "vol-render: error: no grid 'density?2?'*density (float), density?1? (float)*" 'no third: what there is'
exits 0 'unnamed' render --grid '' unnamed.vdb
check 'unnamed: the first' vol-diff a.exr one.exr
exits 0 'unnamed, as listed' render --grid "''[1]" unnamed.vdb
check 'unnamed: the second' vol-diff a.exr half.exr
exits 3 'unnamed: one must be chosen' render unnamed.vdb
says "*it holds '' (float), ''?1? (float)*" 'unnamed: listed so'

exits 0 'vol-info' vol-info both.vdb
check 'vol-info: the first' grep -qx 'grid density' stdout
check 'vol-info: the second' grep -qx 'grid density\[1\]' stdout
exits 0 'vol-info, unnamed' vol-info unnamed.vdb
check 'vol-info: unnamed' grep -qx "grid ''" stdout
must makevdb --type vec3s --field const:1 --also --type float --field const:0.5 >mixed.vdb
exits 0 'a vector and a number of one name' render mixed.vdb
says "*'density?1?' is taken*" 'says which'
check 'the one that can be rendered is taken' vol-diff a.exr half.exr
exits 0 'tables of the second' tf-preint --size 8 --part tf --plot p.png --volume both.vdb --grid 'density[1]' -o t.exr tf.json
finish
