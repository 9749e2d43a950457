vol-gen field sphere --size 8 --set "shot=a b" -o a.vdb
vol-info a.vdb | grep -q "a b"
