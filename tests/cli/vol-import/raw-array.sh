head -c 24 /dev/zero >a.raw
vol-import --dims 2,3,4 --type u8 --array foo -o a.vdb a.raw
