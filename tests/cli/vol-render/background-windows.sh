# A plate's windows say where its pixels lie and which of them are meant to be seen.
. "$TESTS/lib.sh"
echo '{"pellucid": "transfer-function/1", "scatter": [[0, 0.0]]}' >nothing.json
echo '{"pellucid": "transfer-function/1", "scatter": [[0, 0.0], [1, 0.9, [1, 0.5, 0.2]]]}' >tf.json
must makevdb --dims 17,17,17 --field waves >a.vdb
behind() { vol-render -q -t nothing.json "$@" a.vdb; } # BACKGROUND and SIZE as options

# R of one pixel with this background: shows NAME PLATE SIZE X,Y WANT
shows() {
    behind --background "$2" --size "$3" --probe "$4" >p.json 2>stderr
    check "$1" test "$(json p.json pixels 0 channels R)" = "$5"
}

must vol-render -q -t tf.json --size 32x24 -o picture.exr a.vdb
must behind --background picture.exr --size 32x24 -o plate.exr
must behind --background 0,0,0 --size 32x24 --crop 32x6+0+0 -o black.exr

# Our own crop behind the whole frame, and behind a frame of its size.
must behind --background picture.exr --size 32x24 --crop 10x8+12+6 -o crop.exr
must behind --background crop.exr --size 32x24 --crop 10x8+12+6 -o again.exr
check 'a crop comes where it was cut' vol-diff again.exr crop.exr
must behind --background crop.exr --size 32x24 --crop 32x6+0+0 -o above.exr
check 'around it is black' vol-diff above.exr black.exr
must behind --background plate.exr --size 32x24 --probe 15,9 >p.json
shows 'a crop fills a frame of its size' crop.exr 10x8 3,3 "$(json p.json pixels 0 channels R)"

# More pixels than are shown.
must makeexr --window -4,-2,19,13 --display 0,0,15,11 --poke 4,2,R=0.75 --poke 0,0,R=0.5 --poke 19,13,R=1 24x16 \
    R=0.25 G=0.25 B=0.25 >over.exr
shows 'overscan: the first pixel of the display window' over.exr 16x12 0,0 0.75
shows 'overscan: its last' over.exr 16x12 15,11 1.0
shows 'overscan: all of it where the picture is as large' over.exr 24x16 0,0 0.5
exits 3 'overscan: another size is refused' behind --background over.exr --size 20x16 -o no.exr
says "*background 'over.exr' shows 16x12 of its 24x16 pixels, the picture is 20x16: give --size 16x12, or 24x16 for all" \
    'overscan: the message has both sizes'

# Pixels beside the display window.
must makeexr --window -4,0,11,11 --display 0,0,15,11 --poke 4,0,R=0.75 --poke 0,0,R=nan 16x12 R=0.25 G=0.25 B=0.25 >shifted.exr
shows 'shifted: the display window counts' shifted.exr 16x12 0,0 0.75
shows 'shifted: its last column with pixels' shifted.exr 16x12 11,5 0.25
shows 'shifted: black beyond' shifted.exr 16x12 12,5 0.0
must makeexr --window 3,100,6,103 --display 1000,-2000,1015,-1989 4x4 R=1 G=1 B=1 >away.exr
shows 'away: black' away.exr 16x12 3,3 0.0
vol-render -t nothing.json --background away.exr --size 16x12 -o away-out.exr a.vdb 2>stderr
says "*warning: no pixel of background 'away.exr' lies within its display window: it is black*" 'away: a warning'
must makeexr --window 1000,-2000,1015,-1989 --display 1000,-2000,1015,-1989 --poke 2,1,R=0.5 16x12 R=1 G=1 B=1 >far.exr
shows 'far from the origin' far.exr 16x12 2,1 0.5

exits 3 'a pixel that is seen and no number is refused' sh -c \
    'makeexr --poke 1,1,R=nan 4x4 R=0 G=0 B=0 >nan.exr && vol-render -q -t nothing.json --background nan.exr --size 4x4 a.vdb'
exits 3 'depth is no picture' sh -c \
    'makeexr 4x4 Z=1 >z.exr && vol-render -q -t nothing.json --background z.exr --size 4x4 a.vdb'
says "*cannot use EXR 'z.exr': no channels R G B, nor luminance (Y), among Z" 'depth is no picture: says why'
finish
