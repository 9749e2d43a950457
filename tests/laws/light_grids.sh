# Volumes with light grids beside them: what scatters is lit by them, in closed form and as without them where they are 1;
# surfaces by what comes through the cells before them; other lattices, layers of light, numbers and orders; bad ones.
. "$TESTS/lib.sh"

PATH=$OUT/tests/tools:$PATH
view='--size 1x1 --eye 0.5,0.5,9 --look-at 0.5,0.5,0 --ortho 0.1'

cat >slab.json <<'END'
{"pellucid": "transfer-function/1", "scatter": [[0, 0.4, [0.8, 0.4, 0.2]], [1, 0.4, [0.8, 0.4, 0.2]]]}
END

# near CHANNEL WANT RELATIVE FILE: of the one pixel that --probe wrote
near() {
    awk -v channel="$1" -v want="$2" -v rel="$3" '
        { gsub(/[",]/, "") } $1 == channel ":" { got = $2; found = 1 }
        END { d = got - want; d = d < 0 ? -d : d; if (!found || d > rel * want) { print channel, got, "is not", want; exit 1 } }' "$4"
}

# ---- In closed form ----

# A slab of depth 3 m, m = -log 0.6, seen along the light.  T = a - b t from where it is seen: the source's integral is
# a (1 - E) - b ((1 - E) / m - 3 E), E = exp(-3 m).
must makevdb --name density --field const:0.5 --dims 2,2,4 --also --name light.0.direct --light sun:0,0,-1:1,0.5,0.25 \
    --field linear:0,0,0.25,0.2 >slab.vdb
want=$(awk 'BEGIN { m = -log(0.6); E = exp(-3 * m); print 0.95 * (1 - E) - 0.25 * ((1 - E) / m - 3 * E) }')
for estimator in exact full integrals direct; do
    # shellcheck disable=SC2086
    must vol-render -q -t slab.json $view --estimator "$estimator" --step 0.01v --probe 0,0 slab.vdb 2>err >got.json
    check "$estimator: a slab under light that falls evenly" near R "$(awk "BEGIN { print 0.8 * $want }")" 5e-6 got.json
    check "$estimator: its colour" near B "$(awk "BEGIN { print 0.05 * $want }")" 5e-6 got.json
done

# The same light in a lattice of its own, turned and finer along z; a point light, whose own fall-off is not in its grid;
# indirect light, which is added as it is; the total, in place of both.
must makevdb --name density --field const:0.5 --dims 2,2,4 --also --name light.0.direct --light sun:0,0,-1:1,0.5,0.25 \
    --dims 2,3,7 --map 0,1,0,0.5,0,0,0,0,0.5,0,0,0 --field linear:0,0,0.25,0.2 >other.vdb
# shellcheck disable=SC2086
must vol-render -q -t slab.json $view --probe 0,0 other.vdb >got.json
check 'light in another lattice' near R "$(awk "BEGIN { print 0.8 * $want }")" 2e-6 got.json
must makevdb --name density --field const:0.5 --dims 2,2,4 --also --name light.3.indirect --type vec3s --light none \
    --field linear:0,0,0.25,0.2 >indirect.vdb
# shellcheck disable=SC2086
must vol-render -q -t slab.json $view --probe 0,0 indirect.vdb >got.json
check 'indirect light alone' near G "$(awk "BEGIN { print 0.4 * $want }")" 2e-6 got.json
must makevdb --name density --field const:0.5 --dims 2,2,4 --also --name light.total --type vec3s --light sun:0,0,-1:3,2,1 \
    --field linear:0,0,0.25,0.2 >total.vdb
# shellcheck disable=SC2086
must vol-render -q -t slab.json $view --probe 0,0 total.vdb >got.json
check 'the total is all there is' near R "$(awk "BEGIN { print 0.8 * $want }")" 2e-6 got.json
sed 's/"scatter"/"phase": {"hg": 0.5}, "scatter"/' slab.json >hg.json
# shellcheck disable=SC2086
must vol-render -q -t hg.json $view --probe 0,0 slab.vdb >got.json
check 'light from behind the viewer is scattered back by 2/9' near R "$(awk "BEGIN { print 0.8 * $want * 2 / 9 }")" 2e-6 \
    got.json
# shellcheck disable=SC2086
must vol-render -q -t hg.json $view --probe 0,0 total.vdb >got.json
check 'a total knows no directions' near R "$(awk "BEGIN { print 0.8 * $want }")" 2e-6 got.json

# ---- As without them, where they are 1 ----

cat >look.json <<'END'
{"pellucid": "transfer-function/1", "particle_step": 3, "scatter": [[0, 0.1, [1, 0.2, 0.1]], [0.6, 0.5, [0.2, 0.9, 0.4]], [1, 0, [1, 1, 1]]]}
END
cat >soft.json <<'END'
{"pellucid": "transfer-function/1", "particle_step": 3, "scalar_step": 1, "scatter": [[0, 0.1], [1, 0.3]],
 "surface": [[0, 0.3, [1, 0.5, 0.2]], [1, 0.4, [0.2, 0.5, 1]]], "emit": [[0, 0], [1, 0.1]]}
END
sed 's/"particle_step"/"model": "unshaded", "particle_step"/' soft.json >even.json
sed 's/"surface".*0.4.*]],/"surfaceness": [[0, 0.1], [1, 0.9]],/; s/"particle_step"/"model": "classic", "particle_step"/; s/"scalar_step": 1, //' \
    soft.json >classic.json
sun=sun:1,-2,-1
must makevdb --name density --field noise:5 --dims 12,13,14 >plain.vdb
must makevdb --name density --field noise:5 --dims 12,13,14 --also --name light.0.direct --light "$sun" --field const:1 >lit.vdb
for estimator in exact full integrals direct; do
    for look in look soft even classic; do
        light=
        case $look in soft | classic) light="--light $sun" ;; esac
        # shellcheck disable=SC2086
        must vol-render -q -f -t "$look.json" $light --estimator "$estimator" --size 40x30 -o plain.exr plain.vdb
        must vol-render -q -f -t "$look.json" --estimator "$estimator" --size 40x30 -o lit.exr lit.vdb
        check "$estimator, $look: all light is there" vol-diff --max 2e-6 plain.exr lit.exr
        must vol-render -q -f -t "$look.json" --estimator "$estimator" --size 40x30 --precise -o double.exr lit.vdb
        check "$estimator, $look: float is within 1e-5 of double" vol-diff --max 1e-5 double.exr lit.exr
    done
done

# ---- On surfaces ----

# A ball of one isosurface in half the light: no more of it is lost in the cells that it runs through.
cat >ball.json <<'END'
{"pellucid": "transfer-function/1", "isosurfaces": [{"value": 60, "opacity": 1, "color": [0.9, 0.5, 0.1]}],
 "shading": {"ambient": 0, "diffuse": 1, "specular": 0.3, "shininess": 20}}
END
must makevdb --name density --field bowl:10,10,10 --dims 21,21,21 >plain.vdb
for model in hybrid unshaded; do
    sed "s/\"isosurfaces\"/\"model\": \"$model\", \"isosurfaces\"/" ball.json >look.json
    must makevdb --name density --field bowl:10,10,10 --dims 21,21,21 --also --name light.0.direct --light "sun:0,0,-1:2,2,2" \
        --field const:0.5 >lit.vdb
    light='--light sun:0,0,-1'
    [ "$model" = hybrid ] || light=
    for estimator in exact full direct; do
        # shellcheck disable=SC2086
        must vol-render -q -f -t look.json $light --estimator "$estimator" --step 0.25v --size 64x64 -o plain.exr plain.vdb
        must vol-render -q -f -t look.json --estimator "$estimator" --step 0.25v --size 64x64 -o lit.exr lit.vdb
        check "$model, $estimator: a ball seen from where light comes from" vol-diff --max 1e-5 plain.exr lit.exr
    done
done

# Light from behind: the ball's own body is in its way, and nothing of it is lit; ambient light is what is sent.
sed 's/"ambient": 0/"ambient": 0.25/' ball.json >ambient.json
must makevdb --name density --field bowl:10,10,10 --dims 21,21,21 --also --name light.0.direct --light "sun:0,0,1:1,1,1" \
    --field const:1 >lit.vdb
must vol-render -q -f -t ambient.json --size 64x64 -o lit.exr lit.vdb
must vol-render -q -f -t ambient.json --light sun:0,0,1 --size 64x64 -o plain.exr plain.vdb
check 'a ball lit from behind' vol-diff --max 1e-5 plain.exr lit.exr

# A soft surface sends light from within its own layer: an opaque one (1 - e^-2M) / 2 of what an isosurface sends.
cat >layer.json <<'END'
{"pellucid": "transfer-function/1", "model": "unshaded", "scalar_step": 0.2, "surface": [[0.4, 0], [0.4, 0.98], [0.6, 0.98], [0.6, 0]]}
END
must makevdb --name density --field linear:0,0,-1,3.5 --dims 2,2,5 --also --name light.0.direct --light sun:0,0,-1 \
    --field const:1 >layer.vdb
# shellcheck disable=SC2086
must vol-render -q -t layer.json $view --probe 0,0 layer.vdb >got.json
check 'an opaque soft surface sends half' near R 0.4998 1e-6 got.json

# ---- The same bytes ----

must makevdb --name density --field waves --dims 40,30,20 --also --name light.0.direct --light sun:1,-1,-1 --field noise:3 \
    --dims 20,15,11 --voxel 2.2 --also --name light.1.direct --light point:-5,20,30:400,300,200 --field waves >two.vdb
for look in soft even classic; do
    must vol-render -q -f --no-history -t "$look.json" --size 50x40 -j 1 --cpu scalar -o one.exr two.vdb
    for way in '-j 2' '--cpu avx2' ''; do
        # shellcheck disable=SC2086
        must vol-render -q -f --no-history -t "$look.json" --size 50x40 $way -o two.exr two.vdb
        check "$look: the same bytes${way:+ with $way}" cmp one.exr two.exr
    done
    must vol-render -q -f --no-history -t "$look.json" --size 50x40 --crop 20x10+7+11 -o part.exr two.vdb
    must vol-render -q -f -t "$look.json" --size 50x40 --precise -o double.exr two.vdb
    check "$look: float is within 1e-5 of double" vol-diff --max 1e-5 one.exr double.exr
done

# ---- Layers ----

must makevdb --name density --field waves --dims 20,20,20 --also --name light.0.direct --light sun:1,-1,-1 --field noise:3 \
    --also --name light.2.0.direct --light sun:0,-1,0:0.5,0.5,1 --field waves --also --name light.2.1.direct \
    --light sun:0,-1,-1:0.2,0,0 --field noise:4 --also --name light.5.indirect --type vec3s --field noise:5 >parts.vdb
for estimator in exact full direct; do
    must vol-render -q -f -t soft.json --estimator "$estimator" --aov scatter,direct,indirect --size 30x30 --probe 14,17 \
        parts.vdb >got.json
    check "$estimator: direct and indirect light are what is scattered" awk '
        { gsub(/[",]/, "") } /direct|scatter/ { split($1, f, "."); part = f[1]; c = substr($1, length($1) - 1, 1)
            if (part == "scatter") all[c] = $2; else { sum[c] += $2; if ($2 > 0) parts++ } }
        END { if (parts != 3 * 3) { print parts " parts"; exit 1 }
            for (c in all) { d = all[c] - sum[c]; n++; if (d * d > 1e-12 * all[c] * all[c]) { print c, all[c], sum[c]; exit 1 } }
            exit n != 3 }' got.json
done
must vol-render -q -f -t soft.json --aov direct --size 8x8 -o parts.exr parts.vdb
must vol-info parts.exr >channels
check 'a layer of each light' grep -q 'direct\.2\.G' channels
check_not 'and of no other' grep -q 'indirect\|direct\.1' channels
exits 2 'layers of light without light grids: refused' vol-render -q -t soft.json --aov direct --size 8x8 plain.vdb
says '*light grids*' 'layers of light without light grids: why'
exits 2 'layers of a total: refused' vol-render -q -t slab.json --aov indirect --size 8x8 total.vdb
says '*total*' 'layers of a total: why'

# ---- Bad ones ----

refuse() { # CODE PATTERN NAME OPTION...: of makevdb, for the second grid
    code=$1 pattern=$2 name=$3
    shift 3
    must makevdb --name density --field const:0.5 --dims 4,4,4 --also --light sun:1,0,0 "$@" >bad.vdb
    exits "$code" "$name: refused" vol-render -q -t slab.json --size 4x4 bad.vdb
    says "$pattern" "$name: why"
}
refuse 3 "*'light.0.direct'*which light*" 'no light' --name light.0.direct --light ''
refuse 3 "*'light.0.direct'*sun:1,0*" 'a bad light' --name light.0.direct --light sun:1,0
refuse 3 "*'light.0.direct'*NaN*" 'light that is NaN' --name light.0.direct --field nan
refuse 3 '*do not cover*' 'a grid that is too small' --name light.0.direct --dims 3,4,4
refuse 3 '*light.total*light.2.direct*' 'a total beside a part' --name light.2.direct --also --name light.total
refuse 3 "*two grids 'light.0.direct'*" 'a name twice' --name light.0.direct --also --name light.0.direct
exits 2 'lights beside light grids: refused' vol-render -q -t slab.json --light sun:0,0,1 --size 4x4 slab.vdb
says '*--light*light grids*' 'lights beside light grids: why'

# What nothing falls on is not read.
must makevdb --name density --field const:0.5 --dims 4,4,4 --also --light '' --name light.0.direct >bad.vdb
echo '{"pellucid": "transfer-function/1", "emit": [[0, 1], [1, 1]]}' >glow.json
check 'emission needs no light' vol-render -q -f -t glow.json --size 4x4 -o glow.exr bad.vdb

finish
