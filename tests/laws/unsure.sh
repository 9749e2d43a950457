# Where float cannot tell, rays are traced in double: short gradients next to long ones, isosurfaces very near one another.
. "$TESTS/lib.sh"

# A ball whose corners fade into the background: ends of segments lie where gradients all but vanish.
must vol-gen -q -f --no-history field sphere --param edge=0.5 --size 33 --sparse 0.01 -o ball.vdb
cat >classic.json <<'END'
{"pellucid": "transfer-function/1", "model": "classic", "interpolate": "extinction", "scatter": [[0, 0.2], [1, 0.9]],
 "surfaceness": [[0, 1], [1, 1]]}
END
cat >hybrid.json <<'END'
{"pellucid": "transfer-function/1", "model": "hybrid", "interpolate": "extinction", "scatter": [[0, 0.5], [1, 1]],
 "surface": [[0, 0.5], [1, 1]], "isosurfaces": [{"value": 0.02, "opacity": 0.5}]}
END
for look in classic hybrid; do
    for light in '' '--light sun:1,2,3' '--light point:0.2,0.1,0.3'; do
        for e in full integrals direct; do
            # shellcheck disable=SC2086
            see() { vol-render -q -f --no-history -t $look.json --size 48x48 --estimator $e --step 1v $light "$@" ball.vdb; }
            must see -o a.exr
            must see --precise -o b.exr
            check "$look, $e $light: float as double" vol-diff --max 1e-5 b.exr a.exr
        done
    done
done

# Isosurfaces of different values that are one float.
cat >near.json <<'END'
{"pellucid": "transfer-function/1", "model": "unshaded", "isosurfaces":
 [{"value": 0.5, "color": [1, 0, 0], "opacity": 0.5}, {"value": 0.50000001, "color": [0, 1, 0], "opacity": 0.5},
  {"value": 0.50000001, "color": [1, 1, 0], "opacity": 0.3}, {"value": 0.50000002, "color": [0, 0, 1], "opacity": 0.5}]}
END
must vol-gen -q -f --no-history field noise --size 16 -o noise.vdb
for e in exact full integrals direct; do
    must vol-render -q -f --no-history -t near.json --size 48x48 --estimator $e -o a.exr noise.vdb
    must vol-render -q -f --no-history -t near.json --size 48x48 --estimator $e --precise -o b.exr noise.vdb
    check "$e: isosurfaces in their order" vol-diff --max 1e-5 b.exr a.exr
done

finish
