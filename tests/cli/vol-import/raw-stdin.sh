printf "\000\001\002\003\004\005\006\007" >a.raw
vol-import --dims 2,2,2 --type u8 a.raw >a.vdb
vol-import --dims 2,2,2 --type u8 <a.raw >b.vdb
cmp a.vdb b.vdb
