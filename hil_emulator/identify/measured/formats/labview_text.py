"""LabVIEW's measurement files (.lvm): a header, and one or more segments of columns."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from hil_emulator import input_files
from hil_emulator.errors import UserError
from hil_emulator.identify.measured.formats.delimited_text import encoding_of
from hil_emulator.identify.measured.formats.rows import number
from hil_emulator.identify.measured.formats.table import LogColumn, LogTable, label

BEGINNING = "LabVIEW Measurement"
"""How such a file begins."""

END = "***End_of_Header***"
"""What ends the header of the file, and of each segment."""

Cells = list[list[str]]
Header = Mapping[str, list[str]]


def read(file: Path) -> LogTable:
    """Read every segment; segments of the same channels follow each other.

    Raises:
        UserError: if it is no such file, or its segments have different channels.

    """
    encoding, _ = encoding_of(file)
    text = input_files.read_bytes(file, input_files.LABVIEW_TEXT).decode(encoding, "replace")
    if not text.startswith(BEGINNING):
        raise UserError(f'{file}: is not a LabVIEW measurement file; it begins "{BEGINNING}"')
    lines = [line for line in text.splitlines() if line.strip()]
    ends = [i for i, line in enumerate(lines) if line.startswith(END)]
    if not ends:
        raise UserError(f"{file}: its header does not end in {END}")
    if len(ends) == 1:
        raise UserError(f"{file}: holds no segment of measured values")
    comma = any(line.startswith("Separator") and "Comma" in line for line in lines[: ends[0]])
    separator = "," if comma else "\t"
    cells = [line.split(separator) for line in lines]
    head = _header(cells[: ends[0]])
    point = head.get("Decimal_Separator", ["."])[0] == ","
    segments = _segments(cells, ends)
    names = segments[0][1]
    if any(other != names for _, other, _ in segments):
        raise UserError(f"{file}: its segments hold different channels; export them one by one")
    columns = head.get("X_Columns", ["One"])[0].strip()
    parts = [_values(header, rows, len(names), columns, point) for header, names, rows in segments]
    time = np.concatenate([t for t, _ in parts], axis=0)
    values = np.concatenate([v for _, v in parts], axis=0)
    units = segments[0][0].get("Y_Unit_Label", [])
    note = f"LabVIEW measurement, {len(segments)} segments, time from " + (
        "its rate" if columns == "No" else "its X columns"
    )
    made = []
    for i, name in enumerate(names):
        name_without_unit, unit = label(name)
        stated = units[i].strip() if i < len(units) else ""
        place = i if columns == "Multi" else 0
        made.append(
            LogColumn(name_without_unit, unit or stated or None, values[:, i], time[:, place])
        )
    return LogTable(_one_clock(made), notes=(note,))


def _header(cells: Cells) -> dict[str, list[str]]:
    return {row[0].strip(): row[1:] or [""] for row in cells if row[0].strip()}


def _segments(cells: Cells, ends: Sequence[int]) -> list[tuple[Header, list[str], Cells]]:
    """Return header, names and rows of each segment."""
    segments: list[tuple[Header, list[str], Cells]] = []
    for before, at, following in zip(ends, ends[1:], [*ends[2:], len(cells)], strict=False):
        header = _header(cells[_next_segment(cells, before + 1, at) : at])
        count = int(np.nan_to_num(number(header.get("Channels", ["0"])[0])))
        heads, *rows = cells[at + 1 : _next_segment(cells, at + 1, following)] or [[]]
        names = [c for c in heads if c.strip() not in ("X_Value", "Comment", "")]
        segments.append((header, names[:count], rows))
    return segments


def _next_segment(cells: Cells, first: int, end: int) -> int:
    """Return the first row, if any before `end`, that begins the header of a segment."""
    return next((i for i in range(first, end) if cells[i][0].strip() == "Channels"), end)


def _values(
    header: Header, rows: Cells, count: int, columns: str, point: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Return times, shape (rows, clocks), and values, shape (rows, channels)."""
    clocks = {"No": 0, "Multi": count}.get(columns, 1)
    width = clocks + count
    # without X columns a row still begins with the separator
    skip = 1 if columns == "No" and rows and not rows[0][0].strip() else 0
    table = np.array([[number(c, point) for c in (row[skip:] + [""] * width)[:width]]
                      for row in rows]).reshape(len(rows), width)  # fmt: skip
    if clocks == 0:
        start, step = (number(header.get(k, ["0"])[0], point) for k in ("X0", "Delta_X"))
        return (start + step * np.arange(len(rows)))[:, None], table
    if clocks == 1:
        return table[:, :1], table[:, 1:]
    return table[:, ::2], table[:, 1::2]


def _one_clock(columns: list[LogColumn]) -> tuple[LogColumn, ...]:
    """Return columns whose equal times are one object."""
    kept: list[np.ndarray] = []
    out = []
    for c in columns:
        time = np.zeros(0) if c.time is None else c.time
        same = next((t for t in kept if np.array_equal(t, time, equal_nan=True)), time)
        kept.append(same)
        out.append(LogColumn(c.name, c.unit, c.values, same))
    return tuple(out)
