"""Log files of frames that other tools write: known by their endings before any is opened."""

SUFFIXES = (".blf", ".asc", ".log")
"""Vector's binary and text logs, and that of candump."""
