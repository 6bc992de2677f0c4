"""Which effect is missing: fit, scan, contest, gate, and what no effect explains."""
