"""Find what a model lacks: where it and a measurement disagree, and which effect explains it."""
