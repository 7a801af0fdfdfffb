"""`make bench`: how fast, in tables, plots and out/bench.json. A development tool, which is not shipped."""
