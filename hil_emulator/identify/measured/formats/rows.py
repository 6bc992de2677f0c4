"""Rows of cells, as text files and spreadsheets hold them: header, units, times and numbers."""

import itertools
import math
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np

from hil_emulator import input_files
from hil_emulator.errors import UserError
from hil_emulator.identify.measured.experiment import Array
from hil_emulator.identify.measured.formats.table import LogColumn, LogTable, label

Row = Sequence[str]

BATCH = 4096
"""Rows that are in memory as text at a time (assumed)."""

HEADER_ROWS = 1000
"""Rows above the first row of numbers, at most (assumed)."""

WIDEST = 10_000
"""Columns of a table, at most (assumed)."""

DAY = 86400.0
"""Length of a day [s]: a clock without a date begins again after it."""

_CLOCK = re.compile(r"^(\d{1,2}):(\d{2})(?::(\d{2}(?:[.,]\d+)?))?$")
_HALF_DAY = re.compile(r"(.*?\d)\s*([AaPp])\.?[Mm]\.?")
_HOUR = re.compile(r"(?:^|[\sT])(\d{1,2}):\d{2}")
_SLASHED = re.compile(r"^(\d{1,2})/(\d{1,2})/(?=\d{4}\D)")
_SHORT_HOUR = re.compile(r"^(\d{4}-\d{2}-\d{2})[ T]+(\d):")
_MILLISECONDS = re.compile(r"(:\d{2}:\d{2}):(\d{1,6})$")
_DAY_FIRST = re.compile(
    r"^(\d{1,2})[./](\d{1,2})[./](\d{4})[ T]+(\d{1,2})(:\d{2}(?::\d{2}(?:[.,]\d+)?)?)$"
)
_MISSING = ("", "nan", "n/a", "na", "#n/a", "null", "none", "-", "inf", "-inf")
"""Texts that stand for a missing value, in lower case."""

_GROUPS = re.compile(r"^[-+]?\d{1,3}(?:([.,'’\s])\d{3})(?:\1\d{3})*(?:[.,]\d*)?$")
"""A number whose thousands may be separated; `_grouped` decides."""

_UNIT = re.compile(r"^[\[(]?\s*([^\d\s\[\]()][^\s\[\]()]*(?:\([ga]\))?|-|1)?\s*[\])]?$")


@dataclass(frozen=True)
class Layout:
    """Layout of the rows.

    Attributes:
        heads: name and unit of each column.
        first: the first row of numbers.
        notes: what was assumed.

    """

    heads: list[tuple[str, str | None]]
    first: int
    notes: list[str]


def table(
    file: Path, rows: Iterable[Row], decimal_comma: bool = False, headings: Sequence[str] = ()
) -> LogTable:
    """Return the columns of rows, which are read once.

    Args:
        file: where they come from, for messages.
        rows: cells as text; an empty one is missing.
        decimal_comma: whether numbers have a comma for a point.
        headings: names and units of the columns, in place of those in the file.

    Raises:
        UserError: if there is no header, a row is longer than it, or they need too much memory.

    """
    left = iter(rows)
    top = _top(left, decimal_comma)
    layout = _located(file, top, decimal_comma, headings)
    width = len(layout.heads)
    if width > WIDEST:
        raise UserError(f"{file}: has {width} columns; at most {WIDEST} are read")
    columns = [_Cells(*head) for head in layout.heads]
    count, below = layout.first, itertools.chain(top[layout.first :], left)
    while batch := list(itertools.islice(below, BATCH)):
        for i, row in enumerate(batch):
            if len(row) > width and any(cell.strip() for cell in row[width:]):
                raise UserError(
                    f"{file}: row {count + i + 1} has {len(row)} cells, the header has {width}"
                )
        count += len(batch)
        input_files.check_unpacked(file, count * width * 8)
        for i, column in enumerate(columns):
            column.take([row[i] if i < len(row) else "" for row in batch], decimal_comma)
    made = [column.column(layout.notes) for column in columns]
    return LogTable(_with_time(made, layout.notes), notes=tuple(layout.notes))


def _top(rows: Iterator[Row], decimal_comma: bool) -> list[Row]:
    """Return the first rows, up to one of numbers."""
    top = []
    for row in itertools.islice(rows, HEADER_ROWS):
        top.append(row)
        if _holds_numbers(row, decimal_comma):
            break
    return top


def _located(
    file: Path, rows: Sequence[Row], decimal_comma: bool, headings: Sequence[str]
) -> Layout:
    """Find the header: the row above the numbers, or above a row of units."""
    notes: list[str] = []
    numeric = (i for i, row in enumerate(rows) if _holds_numbers(row, decimal_comma))
    first = next(numeric, len(rows))
    if headings:
        heads = [label(h) for h in headings]
        if first < len(rows) and len(rows[first]) != len(heads):
            raise UserError(
                f"{file}: --columns names {len(heads)} columns, and the rows have "
                f"{len(rows[first])} cells"
            )
        return Layout(heads, first, [f"columns by --columns, numbers from row {first + 1} on"])
    if first == 0:
        raise UserError(
            f"{file}: has no header; name its {len(rows[0])} columns in their order, such as "
            '--columns "time [s],position [mm]"'
        )
    if first == len(rows):  # names, and nothing below them
        first = 1
    at = first - 1
    units: Row = ()
    if at > 0 and _holds_units(rows[at], rows[at - 1]):
        units, at = rows[at], at - 1
        notes.append(f"units in row {at + 2}")
    if at > 0:
        notes.append(f"header in row {at + 1}; what is above it is left out")
    heads = [label(cell) for cell in rows[at]]
    while heads and not heads[-1][0]:  # rows that end in a separator
        heads.pop()
    if units:
        heads = [(name, unit or _unit(cell))
                 for (name, unit), cell in zip(heads, units, strict=False)]  # fmt: skip
    return Layout(heads, first, notes)


def _holds_numbers(row: Row, decimal_comma: bool) -> bool:
    """Return whether at least half of a row's cells are numbers or times."""
    filled = [cell for cell in row if cell.strip()]
    good = [c for c in filled if math.isfinite(number(c, decimal_comma)) or moment(c) is not None]
    return bool(filled) and 2 * len(good) >= len(filled)


def _holds_units(row: Row, above: Row) -> bool:
    """Return whether a row holds units for the names above it, which have no units."""
    filled = [cell for cell in row if cell.strip()]
    return (
        len(filled) > 0
        and len([c for c in above if c.strip()]) >= len(filled)
        and all(_UNIT.match(cell.strip()) for cell in filled)
        and not any(label(cell)[1] for cell in above)
    )


def _unit(cell: str) -> str | None:
    match = _UNIT.match(cell.strip())
    text = match[1] if match else None
    return "1" if text == "-" else text


def number(cell: str, decimal_comma: bool = False) -> float:
    """Return the number in a cell; NaN if there is no number."""
    text = cell.strip()
    if _grouped(text, decimal_comma):
        text = _without_groups(text, decimal_comma)
    try:
        return float(text.replace(",", ".") if decimal_comma else text)
    except ValueError:
        return math.nan


def _grouped(text: str, decimal_comma: bool) -> bool:
    """Return whether thousands are separated for sure: `3.605` alone may be a small number."""
    match, decimal = _GROUPS.match(text), "," if decimal_comma else "."
    if match is None or match[1] == decimal:
        return False
    return match[1] not in ".," or decimal in text or text.count(match[1]) > 1


def _without_groups(text: str, decimal_comma: bool) -> str:
    match, decimal = _GROUPS.match(text), "," if decimal_comma else "."
    return text if match is None or match[1] == decimal else text.replace(match[1], "")


def moment(cell: str) -> datetime | timedelta | None:
    """Return a date with its time, or the time of some day; None for anything else."""
    text = cell.strip()
    if ":" not in text:
        return None
    if half := _HALF_DAY.fullmatch(text):
        return _of_half_day(half[1], afternoon=half[2] in "pP")
    text = _MILLISECONDS.sub(r"\1.\2", text)
    if clock := _CLOCK.match(text):
        hours, minutes, seconds = (float((g or "0").replace(",", ".")) for g in clock.groups())
        return timedelta(hours=hours, minutes=minutes, seconds=seconds)
    if date := _DAY_FIRST.match(text):
        day, month, year, hour, rest = date.groups()
        day, month = (month, day) if int(month) > 12 else (day, month)
        text = f"{year}-{int(month):02d}-{int(day):02d}T{int(hour):02d}{rest}"
    text = _SHORT_HOUR.sub(r"\1T0\2:", text)
    try:
        return datetime.fromisoformat(text.replace(",", "."))
    except ValueError:
        return None


def _of_half_day(text: str, *, afternoon: bool) -> datetime | timedelta | None:
    """Return a time of day with AM or PM; a date with slashes has its month first, as in the US."""
    begun, hour = moment(_SLASHED.sub(r"\2.\1.", text)), _HOUR.search(text)
    if begun is None or hour is None:
        return None
    if afternoon:
        return begun + timedelta(hours=12 * (int(hour[1]) < 12))
    return begun - timedelta(hours=12 * (int(hour[1]) == 12))


class _Cells:
    """The cells of a column, in batches: as numbers, or else as times.

    Args:
        name: of the column.
        unit: as it stands in the file.

    """

    def __init__(self, name: str, unit: str | None) -> None:
        self._name, self._unit = name, unit
        self._numbers: list[Array] = []
        self._moments: list[datetime | timedelta | None] | None = []
        self._texts, self._filled, self._example = 0, 0, ""

    def take(self, cells: Sequence[str], decimal_comma: bool) -> None:
        """Take the cells of further rows."""
        values = _numbers(cells, decimal_comma)
        self._numbers.append(values)
        self._filled += sum(bool(cell.strip()) for cell in cells)
        others = [cells[i].strip() for i in np.flatnonzero(np.isnan(values)).tolist()]
        texts = [cell for cell in others if cell.lower() not in _MISSING]
        self._texts += len(texts)
        self._example = self._example or next(iter(texts), "")
        if self._moments is not None:
            self._moments += map(moment, cells)
            times = any(m is not None for m in self._moments)
            if not times or np.isfinite(values).any():
                self._moments = None  # the first rows show what a column holds

    def column(self, notes: list[str]) -> LogColumn:
        """Return the column."""
        if self._moments:
            notes.append(f'"{self._name}" holds times of day or dates; counted in s from the first')
            return LogColumn(self._name, "s", _seconds(self._moments))
        values = np.concatenate([np.zeros(0), *self._numbers])
        text = self._example if 2 * self._texts > self._filled else ""
        return LogColumn(self._name, self._unit, values, text=text)


def _numbers(cells: Sequence[str], decimal_comma: bool) -> Array:
    """Return the number in each cell; NaN if there is no number."""
    try:
        if not decimal_comma:  # most columns hold nothing else, and there are many cells
            return np.array(list(map(float, cells)))
    except ValueError:
        pass
    texts = [cell.strip() for cell in cells]
    if any(_grouped(text, decimal_comma) for text in texts):  # then `3.605` is a large one, too
        texts = [_without_groups(text, decimal_comma) for text in texts]
    return np.array([number(text, decimal_comma) for text in texts])


def _seconds(moments: Sequence[datetime | timedelta | None]) -> Array:
    """Return seconds since the first moment; clocks without a date pass midnight."""
    first = next((m for m in moments if m is not None), None)
    out = np.full(len(moments), np.nan)
    for i, m in enumerate(moments):
        if isinstance(m, datetime) and isinstance(first, datetime):
            if (m.tzinfo is None) == (first.tzinfo is None):
                out[i] = (m - first).total_seconds()
        elif isinstance(m, timedelta) and isinstance(first, timedelta):
            out[i] = (m - first).total_seconds()
    good = np.flatnonzero(np.isfinite(out))
    if isinstance(first, timedelta):
        out[good] += DAY * np.cumsum(np.diff(out[good], prepend=0.0) < -0.5 * DAY)
    return out


def _with_time(columns: list[LogColumn], notes: list[str]) -> tuple[LogColumn, ...]:
    """Return columns in which the only column of dates or clocks is named `time`."""
    dated = [i for i, c in enumerate(columns) if any(f'"{c.name}" holds times' in n for n in notes)]
    if len(dated) == 1 and not any(c.name.lower() == "time" for c in columns):
        one = columns[dated[0]]
        columns[dated[0]] = LogColumn("time", one.unit, one.values)
        notes.append(f'"{one.name}" is taken for the time')
    return tuple(columns)
