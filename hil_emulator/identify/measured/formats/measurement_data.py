"""ASAM MDF (versions 3 and 4): channels with units, each group with its time base."""

import html
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from hil_emulator import input_files
from hil_emulator.errors import UserError
from hil_emulator.identify.measured.bus_logging import DATA
from hil_emulator.identify.measured.formats.table import ASAMMDF, LogColumn, LogTable, label, module

OWN_MARK = '"hil-emulator"'
"""Text in the header of a file that the emulator has written."""

_BEGINNINGS = (b"MDF     ", b"UnFinMF ")
_SMALLEST = 168  # bytes of identification and header block of version 4


def read(file: Path, _: Sequence[str] = ()) -> LogTable:
    """Read every channel of one number per sample, under the names that the file gives them.

    Values are physical ones, after the conversions in the file; samples that the file marks as
    invalid are missing.

    Raises:
        UserError: if it is no such file, or asammdf is not installed.

    """
    asammdf = module(ASAMMDF, file)
    with file.open("rb") as stream:  # asammdf itself stumbles over what is no MDF at all
        begins = stream.read(_SMALLEST)
    if len(begins) < _SMALLEST or not begins.startswith(_BEGINNINGS):
        raise UserError(f"{file}: is not an MDF file")
    try:
        with asammdf.MDF(file) as mdf:
            input_files.check_unpacked(file, sum(map(_stated, mdf.groups)))
            columns = tuple(c for g, _ in enumerate(mdf.groups) for c in _group(mdf, g))
            of_emulator = OWN_MARK in html.unescape(str(mdf.header.comment))  # within XML
    except UserError:
        raise
    except Exception as error:  # asammdf answers a damaged file with many kinds of exception
        trouble = str(error).partition("\n")[0] or type(error).__name__
        raise UserError(f"{file}: is not a readable MDF file: {trouble}") from None
    return LogTable(columns, set_point_first=of_emulator or None)


def _stated(group: Any) -> int:
    """Return how many bytes the values of a group have as numbers, as the file states it."""
    return 8 * int(group.channel_group.cycles_nr) * (len(group.channels) + 1)


def _group(mdf: Any, group: int) -> list[LogColumn]:
    columns = []
    record = 8 * int(mdf.groups[group].channel_group.samples_byte_nr)
    for channel in mdf.groups[group].channels:
        if _last_bit(channel) > record:  # asammdf would read, and write, beyond its memory
            raise ValueError(f"channel {channel.name} lies outside its records")
    master = mdf.masters_db.get(group)
    time: Any = None
    for index, channel in enumerate(mdf.groups[group].channels):
        if index == master:
            continue
        signal = mdf.get(group=group, index=index, ignore_invalidation_bits=True)
        if channel.name == DATA and signal.samples.ndim == 2:
            columns += [LogColumn(f"{DATA}{i}", "1", byte.astype(np.float64), time)
                      for i, byte in enumerate(signal.samples.T)]  # fmt: skip
        if signal.samples.ndim != 1 or signal.samples.dtype.kind not in "iufb":
            continue
        values = signal.samples.astype(np.float64)
        if signal.invalidation_bits is not None:
            values[np.asarray(signal.invalidation_bits, bool)] = np.nan
        if time is None:  # one object for the group: its channels share their clock
            time = np.asarray(signal.timestamps, np.float64)
        name, unit = label(channel.name)
        columns.append(LogColumn(name, str(signal.unit or "").strip() or unit, values, time))
    return columns


def _last_bit(channel: Any) -> int:
    """Return where a channel ends in a record, of MDF 4 or 3, whose names for that differ."""
    places = {"byte_offset": 8, "bit_offset": 1, "additional_byte_offset": 8, "start_offset": 1}
    first = sum(bits * int(getattr(channel, name, 0)) for name, bits in places.items())
    return first + int(channel.bit_count)
