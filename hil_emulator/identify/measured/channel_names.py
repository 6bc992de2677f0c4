"""Usual names of channels in the columns of logs."""

import difflib
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace

from hil_emulator.identify.measured.experiment import UNITS
from hil_emulator.identify.measured.formats.table import LogColumn
from hil_emulator.units import scale_and_offset

SET_POINT = "valve_current"

TIME = "time"

KNOWN = {TIME: "s", SET_POINT: "A", **UNITS}
"""Columns that identification uses, with their SI units."""

_BETWEEN = re.compile(r"[\s_.\-]+")

_SHORT = {"pa": "pressure_a", "pb": "pressure_b", "ps": "supply_pressure"}
"""Usual symbols, without characters between their letters."""

_PLAIN = {_BETWEEN.sub("", name): name for name in KNOWN} | _SHORT
"""Channels by their names without underscores."""


def fits(channel: str, unit: str) -> bool:
    """Return whether a unit has the dimension of a channel."""
    try:
        scale_and_offset(KNOWN[channel], unit)
    except Exception:  # pint answers a wrong or unknown unit with many kinds of exception
        return False
    return True


def channel_columns(
    columns: Sequence[LogColumn], names: Mapping[str, str], units: Mapping[str, str]
) -> list[LogColumn]:
    """Return columns by their channels' names, with the units that are stated for them.

    `Pressure A`, `pressureA`, `PRESSURE-A`, `p_A` and `pressure_a_bar` are `pressure_a`, unless
    another column has exactly this name.

    Args:
        columns: of a log.
        names: channel by name, as the user states it.
        units: unit by name, as the user states it.

    """
    stated = [_stated(c, names, units) for c in columns]
    taken = {c.name for c in stated if c.name in KNOWN}
    return [c if c.name in KNOWN else _alike(c, taken) for c in stated]


def near(names: Sequence[str], missing: Sequence[str]) -> dict[str, str]:
    """Return the missing channel with the most similar name, by the name of a column."""
    plain = {_plain(name): name for name in missing if name != TIME}
    return {
        name: plain[alike[0]] for name in names
        if (alike := difflib.get_close_matches(_plain(name), plain, n=1, cutoff=0.75))
    }  # fmt: skip


def _plain(name: str) -> str:
    return _BETWEEN.sub("", name).lower()


def _stated(column: LogColumn, names: Mapping[str, str], units: Mapping[str, str]) -> LogColumn:
    name, unit = names.get(column.name, column.name), units.get(column.name, column.unit)
    end = column.name.rpartition("_")[2]
    if column.name in names and unit is None and fits(name, end):
        unit = end
    return replace(column, name=name, unit=unit)


def _alike(column: LogColumn, taken: set[str]) -> LogColumn:
    """Return a column, renamed to the channel whose name it resembles, if there is one."""
    head, _, end = column.name.rpartition("_")
    short = _PLAIN.get(_plain(head), "")
    if short and short not in taken and column.unit is None and fits(short, end):
        return replace(column, name=short, unit=end)
    channel = _PLAIN.get(_plain(column.name), "")
    if not channel or channel in taken:
        return column
    if column.unit is None or fits(channel, column.unit) or channel == column.name.lower():
        return replace(column, name=channel)
    return column
