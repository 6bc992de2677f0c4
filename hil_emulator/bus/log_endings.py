"""Log files of frames that other tools write: known by their endings before any is opened."""

NAMES = {".blf": "Vector's binary log", ".asc": "Vector's text log", ".log": "log of candump"}
"""Formats by the endings of their files."""

SUFFIXES = tuple(NAMES)
"""The endings."""
