echo hello >a.txt
vol-diff a.txt a.txt
