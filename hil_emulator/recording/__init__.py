"""Recordings: written beside the loop, read after whatever ended it, replayed and drawn."""

SUFFIX = ".rec"
"""Ending of a journal."""
