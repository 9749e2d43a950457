# The command line travels in the file, without what cannot change the file.
vol-gen -j2 field sphere --size 8 --cpu scalar -o a.vdb
vol-info a.vdb | grep -q "vol-gen field sphere --size 8$"
