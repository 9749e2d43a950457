makevdb --name smoke >a.vdb
vol-info --json a.vdb >a.json
json a.json && grep -q smoke a.json
