"""Error against run time, and what happens at the edge: make_report.write() measures and writes everything."""
