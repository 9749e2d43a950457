vol-import -o a.vdb nothing.nii
