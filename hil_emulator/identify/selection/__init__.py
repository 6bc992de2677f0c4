"""Which effect is missing: fit, scan, candidate_refits, gate, and what no effect explains."""
