vol-gen field constant --size 1 -o a.vdb && vol-info a.vdb >text
