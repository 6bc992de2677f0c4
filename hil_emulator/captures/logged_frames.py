"""Frames of a bus logger's MDF file, from the columns that it was read into."""

from collections.abc import Iterator

import numpy as np

from hil_emulator.bus.frame_log import Captured
from hil_emulator.frame import Frame
from hil_emulator.identify.measured.bus_logging import (
    CHANNEL,
    DATA,
    EXTENDED,
    IDENTIFIER,
    LENGTH,
    REMOTE,
)
from hil_emulator.identify.measured.formats.table import LogColumn, LogTable

_ID_BITS = 0x1FFFFFFF
_IDE = 0x80000000


def of_table(table: LogTable) -> list[Captured]:
    """Return the frames of all groups of a file."""
    groups: list[dict[str, LogColumn]] = []
    for column in table.columns:
        if not groups or column.name in groups[-1]:
            groups.append({})
        groups[-1][column.name] = column
    return [frame for group in groups if IDENTIFIER in group for frame in _frames(group)]


def _frames(group: dict[str, LogColumn]) -> Iterator[Captured]:
    ids = group[IDENTIFIER]
    count = len(ids.values)
    zeros = np.zeros(count)

    def of(name: str) -> np.ndarray:
        return group[name].values if name in group else zeros

    width = sum(f"{DATA}{i}" in group for i in range(64))
    data = np.zeros((count, width), np.uint8)
    for i in range(width):
        data[:, i] = group[f"{DATA}{i}"].values
    lengths = of(LENGTH) if LENGTH in group else zeros + width
    channels = group[CHANNEL].values if CHANNEL in group else None
    for k, (identifier, extended, length, remote) in enumerate(
        zip(ids.values, of(EXTENDED), lengths, of(REMOTE), strict=True)
    ):
        whole = int(identifier)
        frame = Frame(
            whole & _ID_BITS, data[k, : int(length)].tobytes(), bool(remote),
            bool(extended) or bool(whole & _IDE),
        )  # fmt: skip
        time = 0.0 if ids.time is None else float(ids.time[k])
        yield Captured(round(time * 1e9), frame, "" if channels is None else f"{channels[k]:g}")
