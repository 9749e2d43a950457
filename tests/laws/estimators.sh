# The four estimators (Y 4.1, 4.2.1, 4.2.2 and cell by cell) are estimates of one picture.  Surfaces are as transparent from
# one side as from another.  The layers add up to the picture.
. "$TESTS/lib.sh"
nodes='[[0, 0, [1, 0.8, 0.6]], [50, 1, [0.2, 0.5, 0.9]], [60, 0, [0.9, 0.2, 0.1]], [100, 0.3, [0.3, 0.9, 0.4]]]'
tf() { printf '{"pellucid": "transfer-function/1", %s}\n' "$1"; }
tf "\"particle_step\": 0.5, \"scatter\": $nodes" >scatter.json
tf "\"scalar_step\": 20, \"surface\": $nodes" >surface.json
view='--size 24x18 --eye 2,1.5,4 --look-at 0.5,0.5,0.5 --precise'
must vol-gen field wave --size 17 --param value=50 --param offset=50 --param kx=0.3 --param ky=0.2 --param kz=0.25 \
    --extent 0,0,0,1,1,1 -o wave.vdb

rms() { # A B: the largest root mean square difference of a channel
    vol-diff "$1" "$2" | sed -n 's/.* rms \([0-9.e+-]*\),.*/\1/p' | sort -g | tail -n 1
}
small() { # NAME BOUND VALUE
    if awk -v e="$3" -v b="$2" 'BEGIN { exit !(e != "" && e <= b) }'; then passed "$1"; else echo "$3, allowed $2" >why; failed "$1" why; fi
}
ratio() { # NAME LOW HIGH E1 E2
    if awk -v a="$4" -v b="$5" -v low="$2" -v high="$3" 'BEGIN { exit !(b > 0 && a / b > low && a / b < high) }'
    then passed "$1"; else echo "errors $4 $5" >why; failed "$1" why; fi
}
error() { # TF ESTIMATOR STEP: of what the estimator makes of wave.vdb against exact.exr
    must vol-render -t "$1" $view --estimator "$2" --step "$3" -o estimate.exr wave.vdb
    rms estimate.exr exact.exr
}

# --- spikes: opacity 1 at 50 ---
for kind in scatter surface; do
    must vol-render -t $kind.json $view -o exact.exr wave.vdb
    must vol-render -t $kind.json ${view% --precise} -o float.exr wave.vdb
    small "$kind: exact in float" 2e-6 "$(rms float.exr exact.exr)"
    # Pre-integrated segments know the spike; what errs is the field between samples, of order 2.
    e1=$(error $kind.json integrals 1v) e2=$(error $kind.json integrals 0.5v) e4=$(error $kind.json integrals 0.25v)
    ratio "$kind: integrals, 1 voxel to 1/2" 3.4 4.6 "$e1" "$e2"
    ratio "$kind: integrals, 1/2 voxel to 1/4" 3.4 4.6 "$e2" "$e4"
    small "$kind: integrals at 1/4 voxel" 1e-4 "$e4"
    small "$kind: full at 1/4 voxel" 1e-4 "$(error $kind.json full 0.25v)"
    # Point samples see the spike only when they are dense.
    coarse=$(error $kind.json direct 1v) fine=$(error $kind.json direct 0.015625v)
    small "$kind: direct at 1/64 voxel" 1e-3 "$fine"
    ratio "$kind: direct, 1 voxel to 1/64" 10 1000 "$coarse" "$fine"

    # From tables: the finer, the nearer.
    for size in 64 256 1024; do
        must tf-preint --size $size --step 0.015625 -o table.exr $kind.json
        eval "t$size=\$(error table.exr full 0.25v)"
    done
    # shellcheck disable=SC2154
    {
        small "$kind: full from a table of 1024" 1e-4 "$t1024"
        small "$kind: a table of 256 is no worse than one of 64" "$t64" "$t256"
        small "$kind: a table of 1024 is no worse than one of 256" "$t256" "$t1024"
    }
done

# --- particles alone: what they scatter is shaded or not, layers are asked for or not ---
tf '"particle_step": 0.5, "scatter": [[0, 0, [1, 0.8, 0.6]], [50, 0.6, [0.2, 0.5, 0.9]], [100, 0.3, [0.3, 0.9, 0.4]]]' >plain.json
sed 's/"particle_step"/"model": "classic", &/' plain.json >classic.json
for kind in plain classic; do
    must vol-render -t $kind.json $view -o exact.exr wave.vdb
    small "$kind: full at 1/16 voxel" 2e-3 "$(error $kind.json full 0.0625v)"
    small "$kind: integrals at 1/16 voxel" 2e-3 "$(error $kind.json integrals 0.0625v)"
    small "$kind: direct at 1/16 voxel" 2e-3 "$(error $kind.json direct 0.0625v)"
done
# A layer brings in the kernel that has code for everything: the picture does not change.
red() { # OPTION...: of one pixel
    vol-render -t plain.json $view --step 0.25v --probe 12,9 "$@" wave.vdb | sed -n 's/.*"R": \([0-9.e+-]*\).*/\1/p'
}
for e in exact full integrals direct; do
    alone=$(red --estimator $e) layered=$(red --estimator $e --aov Z,normal)
    small "$e: the same with layers" 1e-6 "$(echo "$alone $layered" | awk '{ d = $1 - $2; print NF == 2 ? (d < 0 ? -d : d) : "" }')"
done

# --- a shaded soft surface seen from the side too: where its normal flips to face the viewer the light has a kink ---
# A piece must end there: points of a quadrature on both sides of the kink are off by 1e-6 to 1e-4, most in the normals.
tf "\"particle_step\": 1.5, \"scalar_step\": 0.1, \"surface\": [[0.45, 0], [0.5, 0.7, [0.9, 0.8, 0.6]], [0.55, 0]],
  \"scatter\": [[0.5, 0, [0.3, 0.4, 0.8]], [1, 0.6, [0.3, 0.6, 0.9]]]" >flips.json
must makevdb --dims 13,13,13 --voxel 0.0833 --field waves >flips.vdb
flips='-q --size 48x36 --eye 2,1.5,2.8 --look-at 0.5,0.5,0.5 --fov 30 --light sun:-1,-1,-1 --aov normal'
must vol-render -t flips.json $flips --precise -o exact.exr flips.vdb
must vol-render -t flips.json $flips -o float.exr flips.vdb
small 'normals that flip: exact in float' 2e-7 "$(rms float.exr exact.exr)"
check 'normals that flip: they are seen' sh -c "vol-info exact.exr | grep -A 7 'channel normal.Z' | grep 'max: 0\.[1-9]'"

# --- the same where the normal turns everywhere, under lights that it turns to and from, twice in a cell at times ---
tf "\"particle_step\": 0.1, \"scalar_step\": 0.1, \"surface\": [[0.2, 0], [0.4, 0.2, [1, 0.8, 0.6]], [0.7, 0.2, [0.9, 1, 1]]],
  \"shading\": {\"ambient\": 0.2, \"diffuse\": 1, \"specular\": 0.6, \"shininess\": 20}" >turns.json
must vol-gen field noise --size 24 --seed 5 --extent 0,0,0,1,1,1 -o turns.vdb
turns='-q --size 64x64 --eye 2,1.5,2.8 --look-at 0.5,0.5,0.5 --fov 26 --aov normal'
turning() { # NAME BOUND LIGHT...
    turning_name=$1 turning_bound=$2
    shift 2
    must vol-render -t turns.json $turns "$@" --precise -f -o exact.exr turns.vdb
    must vol-render -t turns.json $turns "$@" -f -o float.exr turns.vdb
    small "normals that turn: $turning_name" "$turning_bound" "$(rms float.exr exact.exr)"
}
turning 'the viewer has the light' 2e-7
turning 'a sun' 2e-7 --light sun:0.9,-0.9,0.2
turning 'two suns' 2e-7 --light sun:0.9,-0.9,0.2:1,0.97,0.92 --light sun:0.7,1,-0.5:0.15,0.2,0.28
turning 'a lamp beside it' 1e-6 --light point:0.2,1.2,1.5

# --- the smooth part, from 60 to 100: point samples are of order 2 ---
tf '"particle_step": 0.5, "interpolate": "extinction", "scatter": [[60, 0.05, [0.9, 0.2, 0.1]], [100, 0.3, [0.3, 0.9, 0.4]]]' >smooth.json
must vol-gen field wave --size 17 --param value=18 --param offset=80 --param kx=0.3 --param ky=0.2 --param kz=0.25 \
    --extent 0,0,0,1,1,1 -o wave.vdb
must vol-render -t smooth.json $view -o exact.exr wave.vdb
e1=$(error smooth.json direct 1v) e2=$(error smooth.json direct 0.5v) e4=$(error smooth.json direct 0.25v)
ratio 'smooth: direct, 1 voxel to 1/2' 3.4 4.6 "$e1" "$e2"
ratio 'smooth: direct, 1/2 voxel to 1/4' 3.4 4.6 "$e2" "$e4"
for estimator in integrals full; do small "smooth: $estimator at 1/4 voxel" 1e-5 "$(error smooth.json $estimator 0.25v)"; done

# --- a slab whose value rises along z, seen at 0 and at 60 degrees: surfaces are as opaque, particles are not ---
must vol-gen field ramp --size 33 --extent -4,-4,-0.5,4,4,0.5 --param gz=100 --param offset=50 -o slab.vdb
tf "\"scalar_step\": 20, \"surface\": [[20, 0.1], [50, 0.5], [80, 0.2]]" >surface.json
tf '"isosurfaces": [{"value": 40.3, "opacity": 0.6}, {"value": 60.1, "opacity": 0.2}]' >delta.json
tf "\"particle_step\": 0.5, \"scatter\": [[20, 0.1], [50, 0.5], [80, 0.2]]" >scatter.json
opacity() { # TF EYE [OPTION...]: of the middle pixel
    opacity_tf=$1 opacity_eye=$2
    shift 2
    vol-render -t "$opacity_tf" --size 1x1 --ortho 0.1 --eye "$opacity_eye" --look-at 0,0,0 --up 0,1,0 --probe 0,0 "$@" slab.vdb |
        sed -n 's/.*"A": \([0-9.e-]*\).*/\1/p'
}
apart() { awk -v a="$1" -v b="$2" 'BEGIN { d = a - b; print (a == "" || b == "") ? "none" : d < 0 ? -d : d }'; }
oblique=3.4641016151377544,0,2
for estimator in exact full integrals; do
    for kind in surface delta; do
        small "$kind, $estimator: the same opacity at 0 and 60 degrees" 1e-6 \
            "$(apart "$(opacity $kind.json 0,0,4 --estimator $estimator --step 0.01w)" \
                "$(opacity $kind.json $oblique --estimator $estimator --step 0.01w)")"
    done
done
# 1 - (1 - a)^2: twice the way
want=$(opacity scatter.json 0,0,4 --precise | awk '{ printf "%.17g", 1 - (1 - $1) ^ 2 }')
small 'particles at 60 degrees: twice the way' 1e-6 "$(apart "$want" "$(opacity scatter.json $oblique --precise)")"

# --- surfaces and particles of every kind together: parts add up to RGB ---
tf "\"particle_step\": 0.5, \"scalar_step\": 20, \"scatter\": $nodes, \"surface\": [[10, 0], [30, 0.6, [0.9, 0.4, 0.2]], [45, 0]],
  \"absorb\": [[0, 0.2, [0.9, 0.5, 0.3]], [100, 0.1]], \"emit\": [[20, 0], [90, 0.8, [0.3, 0.6, 0.9]]],
  \"isosurfaces\": [{\"value\": 70, \"opacity\": 0.4, \"color\": [0.8, 0.8, 0.3]}]" >all.json
must vol-gen field wave --size 17 --param value=50 --param offset=50 --param kx=0.3 --param ky=0.2 --param kz=0.25 \
    --extent 0,0,0,1,1,1 -o wave.vdb
for estimator in exact full integrals direct; do
    vol-render -t all.json ${view% --precise} --precise --estimator $estimator --step 0.5v --aov surface,scatter,emit \
        --probe 12,9 --probe 6,7 --probe 17,11 wave.vdb >probe
    parts=$(tr -d ' ",' <probe | awk -F: '
        /^(R|G|B|(surface|scatter|emit)\.[RGB]):/ { c = substr($1, length($1)); if ($1 == c) { whole[c] = $2; n++ } else sum[c] += $2; m++ }
        m == 12 { for (c in sum) { d = sum[c] - whole[c]; if (d < 0) d = -d; if (d > worst) worst = d } split("", sum); m = 0; lit += whole["R"] }
        END { print (n == 9 && m == 0 && lit > 0.1) ? worst + 0 : "none" }')
    if [ "$parts" = none ]; then failed "$estimator: parts add up" probe; else small "$estimator: parts add up" 1e-12 "$parts"; fi
done

# --- labels: plateaus exactly where the colour jumps; emission that goes on where what attenuates has run out ---
must vol-gen field slabs --param start=-0.8 --param value1=1 --param length1=0.4 --param value2=2 --param length2=0.4 \
    --param value3=3 --param length3=0.4 --size 33 -o labels.vdb
tf '"particle_step": 0.5, "model": "unshaded", "scatter": [[0, 0], [1, 0], [1, 0.5, [1, 0, 0]], [2, 0.5, [1, 0, 0]],
  [2, 0.5, [0, 0, 1]], [3, 0.5, [0, 0, 1]]]' >labels.json
must vol-render -q -f -t labels.json --size 60x60 --eye 3,2,1 -o exact.exr labels.vdb
for estimator in full integrals direct; do
    must vol-render -q -f -t labels.json --size 60x60 --eye 3,2,1 --estimator $estimator --step 0.1v -o steps.exr labels.vdb
    check "$estimator: labels keep their colours" vol-diff --max 0.02 exact.exr steps.exr
done
must vol-gen field ramp --param gx=0 --param gy=0 --param gz=1 --size 33 -o ramp.vdb
tf '"particle_step": 1, "interpolate": "extinction", "emit": [[0.02, 0], [0.05, 10], [0.08, 10], [0.4, 0]],
  "scatter": [[0, 0, [0, 0, 0]], [0.05, 1, [0, 0, 0]], [0.1, 0, [0, 0, 0]]]' >runs-out.json
must vol-render -q -f -t runs-out.json --size 1x1 -o exact.exr ramp.vdb
for estimator in full integrals direct; do
    must vol-render -q -f -t runs-out.json --size 1x1 --estimator $estimator --step 0.1v -o steps.exr ramp.vdb
    check "$estimator: emission where attenuation has run out" vol-diff --max 0.01 exact.exr steps.exr
done

# --- plateaus at the top of a slope, or on a peak, narrower than a bin of the tables ---
must vol-gen field constant --param value=0.5 --size 9 -o flat.vdb
for nodes in '[0, 0], [0.49991, 0], [0.5, 1, [1, 0.5, 0.2]], [1, 1, [1, 0.5, 0.2]]' \
    '[0, 0], [0.4995, 0], [0.5, 1, [1, 0.5, 0.2]], [0.5005, 0], [1, 0]'; do
    for part in emit scatter; do
        [ $part = emit ] || nodes=$(echo "$nodes" | sed 's/, 1, /, 0.5, /g; s/\[1, 1\]/[1, 0.5]/')
        tf "\"particle_step\": 1, \"interpolate\": \"extinction\", \"$part\": [$nodes]" >top.json
        must vol-render -q -f -t top.json --size 8x8 -o exact.exr flat.vdb
        must vol-render -q -f -t top.json --size 8x8 --estimator full -o steps.exr flat.vdb
        check "full: $part at $nodes" vol-diff --max 1e-5 exact.exr steps.exr
    done
done
finish
