"""Which effects are missing: greedy selection by score, joint refit and acceptance test."""
