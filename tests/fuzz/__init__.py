"""Attacks as tests and as longer studies: `python -m tests.fuzz files|requests|frames`."""
