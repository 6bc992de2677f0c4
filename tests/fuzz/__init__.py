"""Attacks as tests and as longer studies: `python -m tests.fuzz requests|frames`, `campaign`."""
