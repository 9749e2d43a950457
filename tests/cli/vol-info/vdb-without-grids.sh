# A VDB of no grids is whole: there is nothing in it.  Who needs a grid says that there is none.
{ head -c 57 "$EXAMPLES/data/head.vdb"; printf '\0\0\0\0\0\0\0\0'; } >none.vdb
vol-info none.vdb >text || exit 10
vol-info --json none.vdb >json || exit 11
vol-render -q -t "$EXAMPLES/tf/ct-head.json" none.vdb 2>err
[ $? -eq 3 ] || exit 12
grep -q 'holds no grids' err || { cat err >&2; exit 13; }
