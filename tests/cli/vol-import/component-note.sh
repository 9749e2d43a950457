# Vectors of two formats: that their magnitude is taken is said, unless it was asked for or -q is given.
printf 'NDims = 3\nDimSize = 2 1 1\nElementType = MET_UCHAR\nElementNumberOfChannels = 3\nElementDataFile = LOCAL\n\1\2\2\2\3\6' >a.mha
printf '\1\2\2\2\3\6' >b.raw
printf 'ObjectFileName: b.raw\nResolution: 2 1 1\nSliceThickness: 1 1 1\nFormat: Vec3UINT8\n' >b.dat
vol-import -o a.vdb a.mha
vol-import -o b.vdb b.dat
vol-import -q a.mha >c.vdb
vol-import --component magnitude a.mha >d.vdb
vol-diff a.vdb b.vdb
vol-diff a.vdb c.vdb
vol-diff a.vdb d.vdb
