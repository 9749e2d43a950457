# What tests/bench/run and tests/bench/peers share: where things are, and small sums.  Needs $0, and $1 = OUTDIR.
LC_ALL=C
export LC_ALL
OUT=$(cd "$1" && pwd) || exit 4
BENCH=$(cd "$(dirname "$0")" && pwd)
EXAMPLES=$BENCH/../../examples
PATH=$OUT/bin:$OUT/tests/bench:$OUT/tests/tools:$PATH
PELLUCID_ADAPTERS=$OUT/lib/pellucid
export PELLUCID_ADAPTERS
WORK=$(mktemp -d "${TMPDIR:-/tmp}/pellucid-bench-XXXXXX") || exit 4
trap 'rm -rf "$WORK"' EXIT
trap 'exit 130' INT TERM
cd "$WORK" || exit 4

# The camera and the transfer function of the picture that `dense` and other programs make: the eye 700 voxels from the
# middle of 256^3 voxels.
DENSE_EYE=475.3328,370.9830,684.0325 DENSE_AT=127.5,127.5,127.5 DENSE_FOV=32
DENSE_TF=$BENCH/tf/dense-unshaded.json

# The middle one of the numbers in column $2 (default 1) of file $1.
median() {
    awk -v column="${2:-1}" '{ print $column }' "$1" | sort -g | awk '{ v[NR] = $1 } END { print v[int((NR + 1) / 2)] }'
}

# calc FORMAT EXPRESSION: of numbers; a dash where one is missing or a divisor is 0.
calc() { awk "BEGIN { printf \"$1\", $2 }" 2>/dev/null </dev/null || printf '%s' -; }

# Largest rms difference of R, G, B, A, or of the channels $3, of two pictures; 0 where they are the same.
rms_between() {
    vol-diff --max 0 "$1" "$2" | sed -n "s/^channel '[${3:-RGBA}]'.* rms \([^,]*\),.*/\1/p" | sort -g | tail -n 1 |
        grep . || echo 0
}

# The field that `dense` and other programs render, as raw floats: $1 file
make_waves() { field waves 256 >"$1" || exit; }

environment() {
    model=$(sed -n 's/^model name[^:]*: //p' /proc/cpuinfo 2>/dev/null | head -n 1)
    printf '%s, %s processors, %s; pellucid %s' "${model:-$(uname -m)}" "$(getconf _NPROCESSORS_ONLN)" \
        "$(${CC:-cc} --version | head -n 1)" "$(vol-render --version | awk '{ print $NF; exit }')"
    sed 's/^\([^ ]*\) .*/; load before: \1/' /proc/loadavg 2>/dev/null || echo
}
