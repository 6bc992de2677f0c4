"""Read recorded experiments: columns with names and units become channels in SI units."""

import difflib
import hashlib
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hil_emulator import input_files
from hil_emulator.errors import UserError
from hil_emulator.identify.measured import formats
from hil_emulator.identify.measured.experiment import UNITS, Array
from hil_emulator.identify.measured.formats.table import LogColumn, LogTable
from hil_emulator.units import factor

MODEL_PREFIX = "model."
"""Columns that the emulator knows of itself and no sensor reports: never read."""

SET_POINT = "valve_current"

TIME = "time"

KNOWN = {TIME: "s", SET_POINT: "A", **UNITS}
"""Columns that identification uses, with their SI units."""

CLOCK_SLIP = 1e-3
"""How far two columns of time may drift apart within a recording [s]: one sample at 1 kHz."""

_CLOCK = re.compile(r"(^|[ _.-])(time|t|timestamp|clock)([ _.-]|$)", re.IGNORECASE)


@dataclass(frozen=True)
class Series:
    """Values over time, in SI units; channels of one clock hold the same array of times."""

    time: Array
    values: Array


@dataclass(frozen=True)
class MeasuredFile:
    """What a file holds, in SI units.

    Attributes:
        file: where it comes from.
        series: by channel, NaN where a value is missing.
        digest: digest of the file.
        set_point_first: see `formats.table.LogTable`.
        ignored: columns that identification does not know.
        notes: what was found while reading.
        part: which of several experiments in the file it is, such as "#2"; "" for the only one.

    """

    file: Path
    series: dict[str, Series]
    digest: str
    set_point_first: bool | None
    ignored: tuple[str, ...]
    notes: tuple[str, ...] = ()
    part: str = ""

    @property
    def name(self) -> str:
        """The file's name, and which part of it this is."""
        return f"{self.file.name}{self.part}"


def read(
    file: Path, names: Mapping[str, str] | None = None, headings: Sequence[str] = ()
) -> MeasuredFile:
    """Read a recording in one of the formats of `formats`.

    Args:
        file: the file.
        names: channel by the name that the file has for it, where they differ.
        headings: names and units of its columns, if the file does not tell.

    Raises:
        UserError: if the file is missing, damaged, or without a usable column.

    """
    digest = digest_of(file)
    return recording(file, formats.read(file, headings), digest, names)


def digest_of(file: Path) -> str:
    """Return a digest of a file's content.

    Raises:
        UserError: if it cannot be read, is too large or no regular file.

    """
    try:
        input_files.check(file, input_files.RECORDING)
        with file.open("rb") as stream:
            return hashlib.file_digest(stream, "sha256").hexdigest()[:16]
    except (OSError, ValueError) as error:  # a name that Python refuses is a ValueError
        reason = getattr(error, "strerror", None) or error
        raise UserError(f"{file}: cannot be read: {reason}; name a recording") from None


def recording(
    file: Path, table: LogTable, digest: str, names: Mapping[str, str] | None = None
) -> MeasuredFile:
    """Turn a table into channels.

    Raises:
        UserError: if a name, a unit or the time is missing or wrong.

    """
    columns = _renamed(file, table.columns, names or {})
    usable = [c for c in columns if c.name in KNOWN]
    known = [c.name for c in usable]
    if len(set(known)) < len(known):
        twice = sorted({n for n in known if known.count(n) > 1})
        raise UserError(f"{file}: more than one column is called {', '.join(twice)}; keep one")
    si = {c.name: c.values * _factor(file, c) for c in usable}
    common = si.pop(TIME, None)
    series = {}
    for column in usable:
        if column.name == TIME:
            continue
        time = common if column.time is None else column.time
        if time is None:
            raise UserError(f'{file}: no column "time [s]"; its columns are {_listed(columns)}')
        series[column.name] = Series(time, si[column.name])
    if not series:
        raise UserError(_no_channel(file, columns))
    notes = [*table.notes, *_other_clocks(file, columns, common)]
    ignored = [c.name for c in columns if c.name not in KNOWN
               and not c.name.startswith(MODEL_PREFIX)]  # fmt: skip
    return MeasuredFile(file, series, digest, table.set_point_first, tuple(ignored), tuple(notes))


def _renamed(
    file: Path, columns: tuple[LogColumn, ...], names: Mapping[str, str]
) -> tuple[LogColumn, ...]:
    for theirs, ours in names.items():
        if ours not in KNOWN:
            raise UserError(f"--channel {ours}={theirs}: no channel is called {ours}; known are "
                            f"{', '.join(KNOWN)}")  # fmt: skip
        if theirs not in [c.name for c in columns]:
            raise UserError(f"{file}: no column is called {theirs}; its columns are "
                            f"{_listed(columns)}")  # fmt: skip
    return tuple(_named(c, names) for c in columns)


def _named(column: LogColumn, names: Mapping[str, str]) -> LogColumn:
    """Return a column by its channel's name: `Position` and `position_mm` are positions."""
    name, unit = names.get(column.name, column.name), column.unit
    if name not in KNOWN and name.lower() in KNOWN:
        name = name.lower()
    head, _, end = name.rpartition("_")
    if name not in KNOWN and head.lower() in KNOWN and unit is None and _is_unit(end, head.lower()):
        name, unit = head.lower(), end
    return LogColumn(name, unit, column.values, column.time)


def _is_unit(text: str, channel: str) -> bool:
    try:
        factor(KNOWN[channel], text)
    except Exception:  # pint answers a wrong or unknown unit with many kinds of exception
        return False
    return True


def _factor(file: Path, column: LogColumn) -> float:
    if column.unit is None:
        raise UserError(
            f'{file}: column "{column.name}" has no unit; write it as '
            f'"{column.name} [{KNOWN[column.name]}]"'
        )
    try:
        return factor(KNOWN[column.name], column.unit)
    except Exception:  # pint answers a wrong or unknown unit with many kinds of exception
        raise UserError(
            f'{file}: column "{column.name} [{column.unit}]": a unit of {KNOWN[column.name]} '
            "is wanted"
        ) from None


def _no_channel(file: Path, columns: tuple[LogColumn, ...]) -> str:
    others = [c.name for c in columns if c.name != TIME]
    near = [m for n in others for m in difflib.get_close_matches(n, KNOWN, n=1) if m != TIME]
    hint = f"; did you mean {near[0]}" if near else ""
    return (
        f"{file}: no known channel among {_listed(columns)}; known are {', '.join(KNOWN)}{hint}; "
        "rename a column, or tell its meaning with --channel position=NAME"
    )


def _listed(columns: tuple[LogColumn, ...]) -> str:
    names = [c.name for c in columns]
    more = f" and {len(names) - 20} more" if len(names) > 20 else ""
    return ", ".join(names[:20]) + more


def _other_clocks(file: Path, columns: tuple[LogColumn, ...], common: Array | None) -> list[str]:
    """Refuse a second column of time that does not keep step with the first.

    Which channels belong to which clock, the file does not say.
    """
    notes = []
    for column in columns:
        if column.name in KNOWN or common is None or not _tells_time(column):
            continue
        own = column.values * factor("s", column.unit or "s")
        good = np.isfinite(own) & np.isfinite(common)
        if good.sum() < 2:
            continue
        apart = (own - common)[good]
        if np.ptp(apart) > CLOCK_SLIP:
            raise UserError(
                f'{file}: two clocks: "{column.name}" and "{TIME}" drift apart by '
                f"{np.ptp(apart) * 1e3:.3g} ms; put all channels on one clock, or keep the "
                f'channels of one and remove the column "{column.name}"'
            )
        notes.append(f"{column.name} keeps step with {TIME}, {np.median(apart):.6g} s apart")
    return notes


def _tells_time(column: LogColumn) -> bool:
    if not _CLOCK.search(column.name):
        return False
    try:
        factor("s", column.unit or "s")
    except Exception:  # pint answers a wrong or unknown unit with many kinds of exception
        return False
    return True
