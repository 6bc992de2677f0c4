"""Endings of log files of frames that other tools write."""

NAMES = {
    ".blf": "Vector's binary log", ".asc": "Vector's text log", ".log": "log of candump",
    ".pcapng": "Wireshark, tcpdump (SocketCAN)",
}  # fmt: skip
"""Formats by the endings of their files."""

SUFFIXES = tuple(NAMES)
"""The endings."""

READ_ONLY = {
    ".trc": "trace of PCAN, versions 1.0 to 2.1",
    ".csv": "frames of python-can, SavvyCAN and other tables with a row for each frame",
    ".db": "SQLite log of python-can",
    ".mf4": "raw frames of bus loggers",
    ".txt": "candump on the screen with times, log of BusMaster",
}
"""Usual endings of further capture formats; the content decides. Each may be packed in `.gz`."""
