"""Read recorded experiments: columns with names and units become channels in SI units."""

import hashlib
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hil_emulator import input_files
from hil_emulator.errors import UserError
from hil_emulator.identify.measured import formats
from hil_emulator.identify.measured.channel_names import (
    KNOWN,
    SET_POINT,
    TIME,
    channel_columns,
    near,
)
from hil_emulator.identify.measured.experiment import Array
from hil_emulator.identify.measured.formats.table import LogColumn, LogTable
from hil_emulator.identify.measured.stated import NOTHING_STATED, Stated
from hil_emulator.units import factor, scale_and_offset

MODEL_PREFIX = "model."
"""Prefix of the columns that the emulator records of its model; they are not read."""

_USUAL = {"Pa": "bar", "m": "mm", "A": "mA", "m^3/s": "l/min"}
"""Usual unit in logs by SI unit, where they differ."""

CLOCK_SLIP = 1e-3
"""Largest drift between two columns of time in a recording [s]: one sample at 1 kHz."""

_CLOCK = re.compile(r"(^|[ _.-])(time|t|timestamp|clock)([ _.-]|$)", re.IGNORECASE)


@dataclass(frozen=True)
class Series:
    """Values over time, in SI units; channels of one clock hold the same array of times."""

    time: Array
    values: Array


@dataclass(frozen=True)
class MeasuredFile:
    """Content of a file, in SI units.

    Attributes:
        file: its path.
        series: by channel, NaN where a value is missing.
        digest: digest of the file.
        set_point_first: see `formats.table.LogTable`.
        ignored: names of columns that are not used.
        notes: remarks on the data.
        part: number of the experiment in the file, such as "#2"; "" for the only one.

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
        """Name of the file, with the part."""
        return f"{self.file.name}{self.part}"


def read(file: Path, stated: Stated = NOTHING_STATED, headings: Sequence[str] = ()) -> MeasuredFile:
    """Read a recording in one of the formats of `formats`.

    Args:
        file: the file.
        stated: statements of the user about it.
        headings: names and units of the columns of a file without a header.

    Raises:
        UserError: if the file is missing, damaged, or without a usable column.

    """
    digest = digest_of(file)
    return recording(file, formats.read(file, headings), digest, stated)


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
    file: Path, table: LogTable, digest: str, stated: Stated = NOTHING_STATED
) -> MeasuredFile:
    """Turn a table into channels.

    Args:
        file: its path.
        table: its columns.
        digest: of the file.
        stated: statements of the user about it.

    Raises:
        UserError: if a name, a unit or the time is missing or wrong.

    """
    columns = _named(file, table.columns, stated)
    usable = [c for c in columns if c.name in KNOWN]
    used = [c.name for c in usable]
    if len(set(used)) < len(used):
        twice = sorted({n for n in used if used.count(n) > 1})
        raise UserError(f"{file}: more than one column is called {', '.join(twice)}; keep one")
    si = {c.name: _in_si(file, c) for c in usable}
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
    notes = [*table.notes, *_near_misses(columns), *_other_clocks(file, columns, common)]
    ignored = [c.name for c in columns if c.name not in KNOWN
               and not c.name.startswith(MODEL_PREFIX)]  # fmt: skip
    return MeasuredFile(file, series, digest, table.set_point_first, tuple(ignored), tuple(notes))


def _named(file: Path, columns: tuple[LogColumn, ...], stated: Stated) -> list[LogColumn]:
    """Return columns by their channels' names."""
    for theirs, ours in stated.names.items():
        if ours not in KNOWN:
            raise UserError(f"--channel {ours}={theirs}: no channel is called {ours}; known are "
                            f"{', '.join(KNOWN)}")  # fmt: skip
        if theirs not in [c.name for c in columns]:
            raise UserError(f"{file}: no column is called {theirs}; its columns are "
                            f"{_listed(columns)}")  # fmt: skip
    named = channel_columns(columns, stated.names, stated.units)
    try:
        return [stated.current(c) if c.name == SET_POINT else c for c in named]
    except UserError as error:
        raise UserError(f"{file}: {error}") from None


def _in_si(file: Path, column: LogColumn) -> Array:
    """Return the values of a channel in its SI unit."""
    if column.text:
        raise UserError(
            f'{file}: column "{column.name}" holds text in most of its rows, such as '
            f'"{column.text}"; write numbers such as 3605.0 there'
        )
    unit = KNOWN[column.name]
    if column.unit is None:
        usual = _USUAL.get(unit, unit)
        raise UserError(
            f'{file}: "{column.name}" has no unit; state it with '
            f'--channel "{column.name}={column.name} [{usual}]"'
        )
    try:
        scale, offset = scale_and_offset(unit, column.unit)
    except Exception:  # pint answers a wrong or unknown unit with many kinds of exception
        raise UserError(
            f'{file}: column "{column.name} [{column.unit}]": a unit of {unit} is wanted'
        ) from None
    return np.asarray(scale * column.values + offset)


def _no_channel(file: Path, columns: Sequence[LogColumn]) -> str:
    others = [c.name for c in columns if c.name != TIME]
    alike = near(others, list(KNOWN))
    hint = f"; did you mean {next(iter(alike.values()))}" if alike else ""
    return (
        f"{file}: no known channel among {_listed(columns)}; known are {', '.join(KNOWN)}{hint}; "
        'rename a column, or state its meaning with --channel "position=NAME [mm]"'
    )


def _near_misses(columns: Sequence[LogColumn]) -> list[str]:
    """Return notes on unused columns whose names resemble a missing channel."""
    names = [c.name for c in columns]
    others = [n for n in names if n not in KNOWN and not n.startswith(MODEL_PREFIX)]
    missing = [n for n in KNOWN if n not in names]
    return [f'column "{n}" is not used; if it is {ours}, give --channel "{ours}={n}"'
            for n, ours in near(others, missing).items()]  # fmt: skip


def _listed(columns: Sequence[LogColumn]) -> str:
    names = [c.name for c in columns]
    more = f" and {len(names) - 20} more" if len(names) > 20 else ""
    return ", ".join(names[:20]) + more


def _other_clocks(file: Path, columns: Sequence[LogColumn], common: Array | None) -> list[str]:
    """Refuse a second column of time that drifts from the first.

    A file does not state which channels belong to which clock.
    """
    notes = []
    for column in columns:
        if column.name in KNOWN or common is None or not _is_time(column):
            continue
        time = column.values * factor("s", column.unit or "s")
        good = np.isfinite(time) & np.isfinite(common)
        if good.sum() < 2:
            continue
        apart = (time - common)[good]
        if np.ptp(apart) > CLOCK_SLIP:
            raise UserError(
                f'{file}: two clocks: "{column.name}" and "{TIME}" drift apart by '
                f"{np.ptp(apart) * 1e3:.3g} ms; put all channels on one clock, or keep the "
                f'channels of one and remove the column "{column.name}"'
            )
        notes.append(f"{column.name} is {TIME} shifted by {np.median(apart):.6g} s")
    return notes


def _is_time(column: LogColumn) -> bool:
    if not _CLOCK.search(column.name):
        return False
    try:
        factor("s", column.unit or "s")
    except Exception:  # pint answers a wrong or unknown unit with many kinds of exception
        return False
    return True
