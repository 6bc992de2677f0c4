"""Experiments: a library, the choice of the next one, and hidden effects for practice."""
