# What every program does alike.
. "$TESTS/lib.sh"

makevdb >a.vdb
for path in "$OUT"/bin/*; do
    p=${path##*/}

    # help and version: on stdout, exit 0, nothing on stderr
    for flag in --help -h --version -V; do
        exits 0 "$p $flag" "$p" $flag
        check "$p $flag says something on stdout" test -s stdout
        check_not "$p $flag says nothing on stderr" test -s stderr
    done
    "$p" --help >stdout
    check "$p --help begins with its usage" grep -q "^usage: $p" stdout
    "$p" --version >stdout
    check "$p --version names program and version" grep -q -E "^$p .*[0-9]+\.[0-9]+\.[0-9]+" stdout
    exits 4 "$p --help to a full disk" sh -c "$p --help >/dev/full"

    # command lines that make no sense: exit 2, one line that begins `prog: error: '
    exits 2 "$p: an unknown option" "$p" --treads 2
    says "$p: error: *--treads*--threads*" "$p suggests the option that was meant"
    check "$p: one error, one line" test "$(grep -c error: stderr)" = 1
    exits 2 "$p: an option without its value" "$p" --threads
    exits 2 "$p: half a number" "$p" --threads 2x
    exits 2 "$p: a negative number of threads" "$p" --threads -1
    exits 2 "$p: no prefixes of options" "$p" --thread 2
    exits 2 "$p: no long options with one dash" "$p" -threads 2
    exits 2 "$p: a choice that is none" "$p" --progress sometimes
    exits 2 "$p: a cpu that is none" "$p" --cpu sse9
    exits 2 "$p: --set without a value" "$p" --set key
    for later in --time-limit=5m --checkpoint=c --resume=c --shard=1/2 --deep --memory-limit=1G; do
        exits 2 "$p $later" "$p" $later
        says "$p: error: *not in this version*" "$p $later is of a later version"
    done

    # @FILE
    exits 2 "$p: an @FILE that is not there" "$p" @nothing.args
    printf '# a comment\n--quiet\n\n--treads 2\n' >bad.args
    exits 2 "$p: an unknown option in an @FILE" "$p" @bad.args
    says "*bad.args:4:*--treads*" "$p names file and line"
    printf '@bad.args\n' >nested.args
    exits 2 "$p: an @FILE in an @FILE" "$p" @nested.args
    printf -- "--set 'with blanks=yes it has' # why not\n--seed 17\n" >good.args
    exits 0 "$p: words of an @FILE" "$p" @good.args --print-options
    check "$p keeps quoted words whole" grep -q 'yes it has' stdout
    check "$p takes plain words" grep -q -x -e '--seed 17' stdout

    # --print-options is read back
    "$p" -j 3 --seed 5 --cpu scalar --set 'k=v w' --print-options >once.args
    exits 0 "$p reads what --print-options wrote" "$p" @once.args --print-options
    check "$p prints the same options again" cmp once.args stdout

    # a file that is not there
    case $p in
    vol-gen) ;;
    exr-join|vol-diff) exits 4 "$p: no such file" "$p" missing.exr missing.exr ;;
    vol-render) echo '{"pellucid": "transfer-function/1"}' >tf.json
                exits 4 "$p: no such file" "$p" -t tf.json missing.vdb
                exits 4 "$p: no such transfer function" "$p" -t missing.json a.vdb ;;
    light-solve) echo '{"pellucid": "transfer-function/1"}' >tf.json
                 exits 4 "$p: no such file" "$p" -t tf.json --light sun:0,0,1 missing.vdb ;;
    *) exits 4 "$p: no such file" "$p" missing.vdb ;;
    esac
done
finish
