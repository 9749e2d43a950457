# Two steps: which one is taken is said, unless it was asked for or -q is given.
printf 'NDims = 4\nDimSize = 2 2 1 2\nElementType = MET_UCHAR\nElementDataFile = LOCAL\n12345678' >a.mha
vol-import -o a.vdb a.mha
vol-import -q a.mha >b.vdb
vol-import --time-step 0 a.mha >c.vdb
vol-diff a.vdb b.vdb
vol-diff a.vdb c.vdb
