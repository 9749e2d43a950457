vol-gen field constant --param value=one -o a.vdb
