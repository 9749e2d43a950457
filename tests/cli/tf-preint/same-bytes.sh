. "$TESTS/lib.sh"
tf=$EXAMPLES/tf/engine.json
must tf-preint --no-history --size 40 --octaves 2 -j1 -o a.exr "$tf"
check 'any number of threads' sh -c 'tf-preint --no-history --size 40 --octaves 2 -j5 -o b.exr "$1" && cmp a.exr b.exr' - "$tf"
check 'any cpu level' sh -c 'tf-preint --no-history --size 40 --octaves 2 --cpu scalar -o b.exr "$1" && cmp a.exr b.exr' - "$tf"
check 'pipes' sh -c 'tf-preint --no-history --size 40 --octaves 2 <"$1" | cmp a.exr -' - "$tf"
must tf-preint --size 40 --octaves 2 -o again.exr a.exr
check 'tables of tables hold the same numbers' vol-diff a.exr again.exr
finish
