# NaN has no spelling in JSON
makevdb --field nan >a.vdb
vol-info --json a.vdb >a.json
json a.json
