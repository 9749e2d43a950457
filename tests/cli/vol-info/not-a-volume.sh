echo hello >a.txt
vol-info a.txt
