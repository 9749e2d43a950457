vol-gen field constant --size 0 -o a.vdb
