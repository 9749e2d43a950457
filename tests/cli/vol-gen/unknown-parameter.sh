vol-gen field sphere --param wobble=1 -o a.vdb
