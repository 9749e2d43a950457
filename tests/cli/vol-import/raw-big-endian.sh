printf "\000\001\000\002\000\003\000\004\000\005\000\006\000\007\000\010" >a.raw
vol-import --dims 2,2,2 --type u16 --endian big -o a.vdb a.raw
makevdb --field linear:1,2,4,1 >want.vdb
vol-diff a.vdb want.vdb
