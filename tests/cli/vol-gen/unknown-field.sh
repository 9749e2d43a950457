vol-gen field blancmange -o a.vdb
