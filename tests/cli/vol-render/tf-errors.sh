# Transfer functions that are wrong: exit 3, an error that names the file and the key (or the line), no output.
. "$TESTS/lib.sh"
makevdb >a.vdb

wrong() { # NAME, a word the message must hold, JSON without the outer braces and the marker
    printf '{"pellucid": "transfer-function/1",\n %s}\n' "$3" >tf.json
    exits 3 "$1" vol-render -t tf.json --size 4x4 -o out.exr a.vdb
    says "vol-render: error: *tf.json*$2*" "$1: says where"
    check_not "$1: no output" test -e out.exr
}
wrong 'opacity above 1'         scatter       '"scatter": [[0, 0.5], [1, 1.5]]'
wrong 'opacity below 0'         surface       '"surface": [[0, -0.5]]'
wrong 'density above 1'         absorb        '"absorb": [[0, 1.5, [0, 0, 0]]]'
wrong 'negative strength'       emit          '"emit": [[0, -1]]'
wrong 'negative colour'         scatter       '"scatter": [[0, 0.5, [-1, 0, 0]]]'
wrong 'isosurface opacity'      isosurfaces   '"isosurfaces": [{"value": 0.5, "opacity": 2}]'
wrong 'isosurface, no value'    isosurfaces   '"isosurfaces": [{"opacity": 0.5}]'
wrong 'isosurface, other key'   colour        '"isosurfaces": [{"value": 0.5, "opacity": 0.5, "colour": [1, 1, 1]}]'
wrong 'unsorted nodes'          scatter       '"scatter": [[1, 0.5], [0, 0.5]]'
wrong 'three nodes at one v'    emit          '"emit": [[1, 0.5], [1, 0.6], [1, 0.7]]'
wrong 'an unknown key'          scater        '"scater": [[1, 0.5]]'
wrong 'an unknown shading key'  shinyness     '"shading": {"shinyness": 3}'
wrong 'the same key twice'      ''            '"scatter": [[0, 0.5]], "scatter": [[0, 0.6]]'
wrong 'text for a number'       scatter       '"scatter": [[0, "much"]]'
wrong 'a colour of two'         scatter       '"scatter": [[0, 0.5, [1, 1]]]'
wrong 'a node of one'           scatter       '"scatter": [[0]]'
wrong 'a list that is none'     scatter       '"scatter": 0.5'
wrong 'particle_step 0'         particle_step '"particle_step": 0, "scatter": [[0, 0.5]]'
wrong 'scalar_step negative'    scalar_step   '"scalar_step": -1, "surface": [[0, 0.5]]'
wrong 'interpolate'             interpolate   '"interpolate": "colour", "scatter": [[0, 0.5]]'
wrong 'an unknown model'        model         '"model": "cubist", "scatter": [[0, 0.5]]'
wrong 'phase out of range'      phase         '"phase": {"hg": 1.5}, "scatter": [[0, 0.5]]'
wrong 'a number beyond double'  ''            '"scatter": [[0, 1e999]]'
wrong 'a syntax error, line 3'  3             '"scatter": [[0, 0.5],
  [1 0.5]]'

whole() { # NAME, the file
    printf '%s' "$2" >tf.json
    exits 3 "$1" vol-render -t tf.json --size 4x4 -o out.exr a.vdb
    says "vol-render: error: *tf.json*" "$1: says which"
}
whole 'of a later version' '{"pellucid": "transfer-function/9", "scatter": [[0, 0.5]]}'
whole 'no marker' '{"scatter": [[0, 0.5]]}'
whole 'an array' '[1, 2]'
whole 'cut short' '{"pellucid": "transfer-function/1", "scatter": [[0, 0.5]'
whole 'words after the end' '{"pellucid": "transfer-function/1"} {}'
whole 'empty' ''
whole 'nested 100000 deep' "{\"pellucid\": $(head -c 100000 /dev/zero | tr '\000' '[')"
whole 'not UTF-8' "$(printf '{"pellucid": "transfer-function/1", "\377": 1}')"
finish
