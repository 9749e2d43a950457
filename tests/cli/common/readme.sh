# The first command of the README runs as it stands, from the repository's root.
. "$TESTS/lib.sh"
must ln -s "$EXAMPLES" examples
awk '/^    / { print substr($0, 5); while (sub(/\\$/, "") && (getline next_line) > 0) print next_line; exit }' "$TESTS/../README.md" >command
check 'there is one' test -s command
exits 0 'it runs' sh -e command
check 'nothing to warn of' test ! -s stderr
check 'it makes a picture' test -s head.png
check 'of something' grep -q 'max: 0\.[5-9]' stdout
finish
