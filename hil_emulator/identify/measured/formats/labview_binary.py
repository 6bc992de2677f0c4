"""Binary files of LabVIEW and DIAdem (.tdms): channels with units, in groups, and their times."""

from pathlib import Path
from typing import Any

import numpy as np

from hil_emulator import input_files
from hil_emulator.errors import UserError
from hil_emulator.identify.measured.experiment import Array
from hil_emulator.identify.measured.formats.table import NPTDMS, LogColumn, LogTable, label, module

UNITS = ("unit_string", "NI_UnitDescription", "unit")
"""Properties that state a channel's unit, the first one there counts."""


def read(file: Path) -> LogTable:
    """Read every channel of numbers or times.

    Raises:
        UserError: if it is no such file, or npTDMS is not installed.

    """
    library = module(NPTDMS, file)
    try:
        with library.TdmsFile.open(file) as source:
            clocks: dict[tuple[float, float, int], Array] = {}
            stated = sum(len(c) for g in source.groups() for c in g.channels())
            input_files.check_unpacked(file, 8 * stated)
            read_columns = [_column(c, clocks) for g in source.groups() for c in g.channels()]
    except UserError:
        raise
    except Exception as error:  # npTDMS answers a damaged file with many kinds of exception
        raise UserError(f"{file}: is not a readable TDMS file: {error}") from None
    columns = tuple(c for c in read_columns if c is not None)
    by_rate = [c.name for c in columns if c.time is not None]
    notes = (f"time from the sample rate of {', '.join(by_rate)}",) if by_rate else ()
    return LogTable(columns, notes=notes)


def _column(channel: Any, clocks: dict[tuple[float, float, int], Array]) -> LogColumn | None:
    values = np.asarray(channel[:])
    name, unit = label(channel.name)
    if values.dtype.kind == "M":
        whole = values.astype("datetime64[ns]").astype(np.int64)
        return LogColumn(name, "s", np.asarray((whole - whole[:1]) * 1e-9)) if len(whole) else None
    if values.dtype.kind not in "iufb":
        return None
    stated = next((str(channel.properties[u]) for u in UNITS if channel.properties.get(u)), None)
    step = float(channel.properties.get("wf_increment", 0.0))
    if step <= 0.0:
        return LogColumn(name, unit or stated, values.astype(np.float64))
    key = (float(channel.properties.get("wf_start_offset", 0.0)), step, len(values))
    if key not in clocks:  # one object for all channels of one clock
        clocks[key] = np.asarray(key[0] + step * np.arange(key[2]))
    return LogColumn(name, unit or stated, values.astype(np.float64), clocks[key])
