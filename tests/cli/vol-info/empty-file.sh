vol-info </dev/null
