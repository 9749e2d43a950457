# Indirect light by cone, all light by pde: what they write, what they refuse.
. "$TESTS/lib.sh"
cat >tf.json <<'END'
{"pellucid": "transfer-function/1", "scatter": [[0, 0.3], [1, 0.5]], "transport": [[0, [0.9, 0.8, 0.6]], [1, [0.9, 0.8, 0.6]]]}
END
must vol-gen field sphere --size 12 --param edge=0.3 -o v.vdb
solve() { light-solve -q -f -t tf.json "$@"; }
has() { vol-info "$1" >info.txt && grep -q -F "$2" info.txt; }
for what in 'sun:1,2,3' 'point:0,9,0' 'spot:0,9,0,0,-1,0,30'; do
    for how in '' --as-printed; do
        # shellcheck disable=SC2086
        exits 0 "cone, $what $how" solve --method cone --light sun:0,1,0 --light "$what:1,0.5,2" $how -o cone.vdb v.vdb
        for grid in light.0.direct light.0.indirect light.1.direct light.1.indirect; do
            check "cone, $what $how: $grid" has cone.vdb "$grid"
        done
        # shellcheck disable=SC2086
        exits 0 "pde, $what $how" solve --method pde --scattering 1,2,4 --light sun:0,1,0 --light "$what" $how -o pde.vdb v.vdb
        check "pde, $what $how: light.total" has pde.vdb light.total
        check_not "pde, $what $how: nothing else" has pde.vdb light.0
        # shellcheck disable=SC2086
        must solve --method pde --scattering 1,2,4 --light sun:0,1,0 --light "$what" $how -j2 --cpu scalar -o other.vdb v.vdb
        check "pde, $what $how: the same bytes" cmp pde.vdb other.vdb
        exits 0 "pde, $what $how: it is rendered" vol-render -q -f -t tf.json --size 8x8 -o a.exr pde.vdb
    done
    exits 0 "pde, $what: a preview" solve --method pde --scattering 1,2,4 --preview --light "$what" -o pde.vdb v.vdb
    exits 0 "cone, $what: on its own lattice" solve --method cone --resolution 7 --light "$what" -o cone.vdb v.vdb
    exits 0 "cone, $what: it is rendered" vol-render -q -f -t tf.json --size 8x8 -o a.exr cone.vdb
done
must solve --light sun:0,1,0 --absorption 2 -o shadow.vdb v.vdb
must solve --method cone --light sun:0,1,0 -o cone.vdb v.vdb
must solve --method cone --light sun:0,1,0 -j2 --cpu scalar -o other.vdb v.vdb
check 'cone: the same bytes' cmp cone.vdb other.vdb

must solve --method cone --light sun:0,1,0 --reuse cone.vdb -o other.vdb v.vdb
check 'cone: what is reused is the same' vol-diff cone.vdb other.vdb
must solve --method cone --cone-angle 31 --light sun:0,1,0 --reuse cone.vdb -o other.vdb v.vdb
check_not 'cone: another angle is another light' vol-diff cone.vdb other.vdb

# Without diffusion pde is the shadows.  All channels of white light are alike.
must solve --method pde --absorption 2 --light sun:0,1,0 -o pde.vdb v.vdb
must vol-render -q -f -t tf.json --size 16x16 -o shadow.exr shadow.vdb
must vol-render -q -f -t tf.json --size 16x16 -o pde.exr pde.vdb
check 'pde without diffusion: the same picture' vol-diff --max 1e-6 shadow.exr pde.exr
must solve --method pde --absorption 2 --scattering 1e6,1e6,1e6 --light sun:0,1,0 -o pde.vdb v.vdb
must vol-render -q -f -t tf.json --size 16x16 -o pde.exr pde.vdb
check_not 'pde with much diffusion: another one' vol-diff --max 1e-3 shadow.exr pde.exr

# Light crosses blanks and stops at occluders, and spreads through neither: what is all inside is as without a mask.
volume='--name density --dims 9,9,9 --field const:0.5 --box'
# shellcheck disable=SC2086
{
must makevdb $volume >plain.vdb
must makevdb $volume --also --name mask --type int32 --field const:1 >all.vdb
must makevdb $volume --also --name mask --type int32 --field const:1 --poke 4,4,4,2 >occluder.vdb
}
for m in plain all occluder; do
    exits 0 "pde, $m" solve --method pde --scattering 5,5,5 --light sun:0,0,-1 --no-history -o $m.lit.vdb $m.vdb
    must vol-render -q -f -t tf.json --size 9x9 --no-history -o $m.exr $m.lit.vdb
    exits 0 "pde as printed, $m" solve --method pde --scattering 5,5,5 --light sun:0,0,-1 --as-printed -o printed.vdb $m.vdb
done
check 'pde, all inside: the same picture' vol-diff --max 1e-5 plain.exr all.exr
check_not 'pde, an occluder: another one' vol-diff --max 1e-3 plain.exr occluder.exr
vol-info occluder.lit.vdb >info.txt
check 'pde, an occluder: dark within' sh -c "sed -n '/^grid light.total/,\$p' info.txt | grep -q 'min: 0'"

refused() { # what code pattern arguments..
    what=$1 code=$2 pattern=$3
    shift 3
    exits "$code" "$what" light-solve -t tf.json -o out.vdb "$@" v.vdb
    says "$pattern" "$what: says so"
    check_not "$what: no output" test -e out.vdb
}
refused 'absorption with cone' 2 '*--absorption is for shadow and pde*' --method cone --absorption 2 --light sun:1,0,0
refused 'a cone of 180 degrees' 2 '*--cone-angle wants*' --method cone --cone-angle 180 --light sun:1,0,0
refused 'a negative length' 2 '*--blur-length*' --method cone --blur-length=-1v --light sun:1,0,0
refused 'negative scattering' 2 '*--scattering wants*' --method pde --scattering=-1,0,0 --light sun:1,0,0
exits 2 'pde in a sheared volume' light-solve -t tf.json --method pde --light sun:1,0,0 -o out.vdb \
    "$TESTS/micro/13b-transform-sheared.vdb"
says '*axes are not orthogonal*' 'pde in a sheared volume: says so'
refused 'a light within' 2 "*light 'point:0,0,0': a light of --method cone lies outside the domain*" \
    --method cone --light point:0,0,0
refused 'a light too near' 2 '*sees the domain under at most 90 degrees*' --method cone --light point:0,1.5,0
finish
