vol-gen field sphere --size 8 --no-history -o a.vdb
! vol-info a.vdb | grep -q "field sphere"
