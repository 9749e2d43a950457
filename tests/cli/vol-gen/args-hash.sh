# Another recipe, another hash; with or without the history.
for field in sphere torus; do
    vol-gen field $field --size 8 -o $field.vdb
    vol-gen field $field --size 8 --no-history -o $field-quiet.vdb
    for file in $field $field-quiet; do vol-info $file.vdb | grep argsHash >$file.hash || exit 9; done
    cmp $field.hash $field-quiet.hash || exit 8
done
! cmp -s sphere.hash torus.hash
