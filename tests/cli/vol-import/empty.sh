: >empty
vol-import -o a.vdb empty
code=$?
test ! -e a.vdb || exit 9
exit $code
