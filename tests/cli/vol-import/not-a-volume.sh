echo "hello, hello, hello" >a.txt
vol-import -o a.vdb a.txt
