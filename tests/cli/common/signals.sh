# Signals end a program as signals do, and leave nothing behind.
. "$TESTS/lib.sh"

closed=$( (vol-gen field noise --size 64 --compression none; echo $? >code) 2>said | head -c 1 | wc -c)
check 'a closed pipe' test "$closed" = 1
check 'ends the writer with SIGPIPE' test "$(cat code)" = 141
check_not 'silently' test -s said

# A job that takes far longer than we wait.
long='vol-gen field noise --size 700 -o out.vdb'
for pair in TERM:143 HUP:129; do
    $long 2>said &
    job=$!
    sleep 0.4
    kill -s "${pair%:*}" $job
    wait $job 2>/dev/null
    code=$?
    check "SIG${pair%:*} ends it with ${pair#*:}" test $code = "${pair#*:}"
    check_not "SIG${pair%:*} leaves no output" test -e out.vdb
    check "SIG${pair%:*} leaves no temporary" test -z "$(ls -A | grep '^\.')"
done
timeout --preserve-status -s INT 0.4 $long 2>said
check 'SIGINT ends it with 130' test $? = 130
check_not 'SIGINT leaves no output' test -e out.vdb

# In the middle of writing: a temporary is there, then the signal, then it is gone.  Few tries see the moment.
mkdir w
vol-gen field noise --size 160 --compression none -o whole.vdb
caught=0
for try in 1 2 3 4 5 6 7 8 9 10; do
    vol-gen field noise --size 160 --compression none -o w/out.vdb 2>said &
    job=$!
    while kill -0 $job 2>/dev/null; do
        if [ -n "$(ls -A w)" ]; then
            kill -s TERM $job 2>/dev/null
            break
        fi
    done
    wait $job 2>/dev/null
    code=$?
    if [ $code = 143 ]; then
        caught=1
        check 'killed while writing: nothing is left' test -z "$(ls -A w)"
        break
    fi
    cmp -s w/out.vdb whole.vdb || { failed 'a file that is there is whole'; break; }
    rm -f w/out.vdb
done
[ $caught = 1 ] || skipped 'killed while writing' 'always too late'
finish
