printf "\000\001\002\003\004\005\006" | gzip >a.raw.gz
vol-import --dims 2,2,2 --type u8 -o a.vdb a.raw.gz
