"""Recorded files as tables, and tables as experiments."""

import hashlib
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hil_emulator.api.tables import SET_POINT_FIRST, TIME, UNITS, frame
from hil_emulator.errors import UserError
from hil_emulator.identify.measured import formats
from hil_emulator.identify.measured.channel_names import KNOWN
from hil_emulator.identify.measured.data import experiments
from hil_emulator.identify.measured.experiment import Experiment
from hil_emulator.identify.measured.formats.table import LogColumn, LogTable, label
from hil_emulator.identify.measured.reading import digest_of, recording
from hil_emulator.recording import SUFFIX, journal
from hil_emulator.units import scale_and_offset

if TYPE_CHECKING:
    import pandas


def read(file: str | Path) -> "pandas.DataFrame":
    """Return the signals of a recording (.rec), or of a log in any format of `identify`.

    Returns:
        A table indexed by the time [s]; known channels in SI, others in the unit of the file.
        `attrs["units"]` has the units, `attrs["events"]` of a recording the actions on the rig.

    Raises:
        UserError: if it cannot be read.

    """
    path = Path(file)
    if path.suffix.lower() == SUFFIX:
        kept = journal.read(path)
        about = {"provenance": kept.provenance, "events": kept.events, SET_POINT_FIRST: True}
        return frame(kept.rows, kept.units, name=path.name, **about)
    digest_of(path)  # reports a missing file
    table = formats.read(path)
    if any(column.time is not None for column in table.columns):
        raise UserError(f"{path}: its channels have clocks of their own; give it to identify as is")
    if TIME not in [column.name for column in table.columns]:
        raise UserError(f'{path}: no column "time [s]"')
    columns = [_in_si(path, column) for column in table.columns]
    units = {column.name: column.unit or "" for column in columns}
    values = np.column_stack([column.values for column in columns])
    return frame(values, units, name=path.name, **{SET_POINT_FIRST: table.set_point_first})


def as_experiments(table: "pandas.DataFrame", number: int) -> list[Experiment]:
    """Return a table as an experiment for `identify`.

    Args:
        table: its index, or a column of that name, is the time. Units are in `attrs["units"]`, or
            in the names of the columns: "position [mm]".
        number: of the table, to name one that has no `attrs["name"]`.

    Raises:
        UserError: if names, units or the time are missing.

    """
    flat = table if TIME in table.columns else table.rename_axis(TIME).reset_index()
    units = {TIME: "s", **table.attrs.get(UNITS, {})}
    columns = []
    for heading in flat.columns:
        name, unit = label(str(heading))
        values = flat[heading].to_numpy(float)
        columns.append(LogColumn(name, units.get(name, unit), values))
    digest = hashlib.sha256(b"".join(np.ascontiguousarray(c.values).tobytes() for c in columns))
    held = LogTable(tuple(columns), table.attrs.get(SET_POINT_FIRST))
    file = Path(table.attrs.get("name", f"table {number}"))
    return experiments(recording(file, held, digest.hexdigest()[:16]))


def _in_si(file: Path, column: LogColumn) -> LogColumn:
    """Return a known channel in its SI unit, another column as it is."""
    if column.name not in KNOWN or column.unit is None:
        return column
    unit = KNOWN[column.name]
    try:
        scale, offset = scale_and_offset(unit, column.unit)
    except Exception:  # pint raises many kinds of exception for a wrong or unknown unit
        raise UserError(
            f"{file}: column {column.name}: {column.unit} is no unit of {unit}"
        ) from None
    return LogColumn(column.name, unit, scale * column.values + offset)
