makeexr 8x8 R=1 | vol-diff - -
