"""Raw frames in MDF files of bus loggers: the columns that they become in a table."""

from hil_emulator.identify.measured.formats.table import LogTable

FRAMES = "CAN_DataFrame"
"""Structure of a frame (ASAM MDF Bus Logging)."""

IDENTIFIER, EXTENDED, LENGTH, CHANNEL, REMOTE, DATA = (
    f"{FRAMES}.{name}" for name in ("ID", "IDE", "DataLength", "BusChannel", "RTR", "DataBytes")
)
"""Members of the structure; the name of the data is followed by a number for each byte."""


def holds_frames(table: LogTable) -> bool:
    """Return whether a table holds raw frames, not signals."""
    return any(column.name == IDENTIFIER for column in table.columns)
