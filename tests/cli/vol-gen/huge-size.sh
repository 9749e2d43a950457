vol-gen field constant --size 99999999999999999999 -o a.vdb
