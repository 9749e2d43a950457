# Where outputs go: each to a place of its own, all of them or none; modes and links stay.
. "$TESTS/lib.sh"
gen='vol-gen field sphere --size 8'
echo '{"pellucid": "transfer-function/1", "scatter": [[0, 0.5], [1, 0.5]]}' >tf.json
must $gen -o a.vdb
must vol-render -t tf.json --size 4x4 -o a.exr a.vdb

# two outputs, one place
exits 2 'image and stats in one file' $gen -o x --stats x
says "vol-gen: error: cannot write 'x': *same place*" 'and says so'
exits 2 'by another name' $gen -o x --stats "$PWD/./x"
ln -s x link
exits 2 'through a link, its file not there yet' $gen -o link --stats x
exits 2 'stdout twice' sh -c "$gen --stats - >x"
exits 2 'stdout, and the file behind it' sh -c "$gen --stats x >x"
exits 2 'stdout, and a descriptor of it' sh -c "$gen --stats /dev/fd/1 >x"
check 'nothing was written' test ! -s x
rm -f x
exits 2 'tables and plot' tf-preint --size 9 --plot t -o t tf.json
exits 2 'plot and stats' tf-preint --size 9 --plot t --stats t -o u tf.json
exits 2 'description and plot' vol-info --plot p -o p a.vdb
exits 2 'description and plot through stdout' sh -c 'vol-info --plot p a.vdb >p'
exits 2 'report and difference' sh -c 'vol-diff -o p a.exr a.exr >p'
exits 2 'report and stats' sh -c 'vol-diff --stats p a.exr a.exr >p'
exits 0 'without the report its place is free' sh -c 'vol-diff -q --stats - a.exr a.exr >p'
exits 0 'into /dev/null there go many' $gen -o /dev/null --stats /dev/null
check_not 'no tables, no plot' test -e t -o -e u

# all or none
exits 4 'stats on a full disk' $gen -o b.vdb --stats /dev/full
check_not 'leave no volume' test -e b.vdb
exits 4 'nor a picture' vol-render -t tf.json --size 4x4 --stats /dev/full -o b.exr a.vdb
check_not 'of any kind' test -e b.exr
exits 4 'nor one in a pipe' sh -c "$gen --stats /dev/full >b.vdb"
check 'not a byte of it' test ! -s b.vdb
exits 4 'a description that cannot be written' sh -c 'vol-info --plot p.png a.vdb >/dev/full'
check_not 'leaves no plot' test -e p.png
exits 4 'tables that cannot be written' tf-preint --size 9 --plot p.png -o /dev/full tf.json
check_not 'leave no plot' test -e p.png
exits 4 'a volume that cannot be written' $gen -o /dev/full --stats s.json
check 'still has stats, of failure' test "$(json s.json status)" = 4
check 'no temporaries' test -z "$(ls -A | grep '^\.')"

# modes
mode() { ls -l "$1" | cut -c 1-10; }
$gen -o m.vdb
for mode in 600 444 664; do
    chmod $mode m.vdb
    before=$(mode m.vdb)
    exits 0 "over a file of mode $mode" vol-gen field ramp --size 8 -o m.vdb
    check 'it keeps its mode' test "$(mode m.vdb)" = "$before"
done

# links
ln -s sub/far.vdb near
exits 4 'a link into no folder' $gen -o near
mkdir sub
ln -s near nearer
exits 0 'a dangling link, and one to it' $gen -o nearer
check 'are links still' test -L near -a -L nearer
check 'the file is where they point' cmp sub/far.vdb a.vdb
ln -s round round
exits 4 'a link to itself' $gen -o round

# descriptors, as a shell hands them out
exits 0 'an open descriptor' sh -c "$gen -o /dev/fd/5 5>five.vdb"
check 'is written to' cmp five.vdb a.vdb
exits 0 'one whose file has no name any more' sh -c "exec 5>gone; rm gone; $gen -o /dev/fd/5"
check 'gets no other' test -z "$(ls | grep gone)"
exits 4 'one that is not open' $gen -o /dev/fd/77
exits 0 'a plot leaves no trace in the tables' tf-preint --size 9 --plot p.png -o t1.exr tf.json
exits 0 'they are the same without' tf-preint --size 9 -o t2.exr tf.json
check 'to the byte' cmp t1.exr t2.exr

# stacks
if [ "$SANITIZED" = 1 ]; then
    skipped 'a small stack' 'sanitizers need a large one'
else
    exits 0 'a small stack' sh -c 'ulimit -s 64; exec vol-render -t tf.json --size 4x4 --estimator full --precise -o s.exr a.vdb'
    exits 0 'an even smaller one' sh -c 'ulimit -s 32; exec vol-render -t tf.json --size 4x4 -o s.exr a.vdb'
    check 'and the same picture' cmp s.exr a.exr
fi
finish
