makevdb >a.vdb
vol-info a.vdb a.vdb
