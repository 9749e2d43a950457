exr-join -o j.exr - - </dev/null
