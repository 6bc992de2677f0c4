"""Courses of values over time, as a configuration or a CSV file gives them."""

import csv
import itertools
import math
from collections.abc import Iterable
from pathlib import Path

from hil_emulator import input_files
from hil_emulator.errors import UserError
from hil_emulator.units import to_si

NS_PER_S = 1e9

LATEST_S = 1e9
"""Longest course [s]: thirty years (assumed)."""

Points = tuple[tuple[int, float], ...]
"""Time [ns] and value [digits] of each corner of a course."""


def points(rows: object) -> Points:
    """Return the corners of a table such as `[["0 s", 20], ["5 s", 60]]`.

    Raises:
        ValueError: it is not such a table.

    """
    if not isinstance(rows, list) or not all(isinstance(r, list) and len(r) == 2 for r in rows):
        raise ValueError(
            'a table is a list of times and values: table = [["0 s", 20], ["5 s", 60]]'
        )
    return _checked((to_si(time, "s", "2 s"), value) for time, value in rows)


def column(file: Path, name: str) -> Points:
    """Return the corners of a course in a CSV file: time [s] in its first column.

    Args:
        file: the file; its first row names the columns.
        name: the column of the values; "" is the second one.

    Raises:
        UserError: names file and line.

    """
    try:
        input_files.check(file, input_files.COURSE)
        with file.open(newline="", encoding="utf-8-sig") as text:
            header, *rows = list(csv.reader(text))
    except (OSError, UnicodeDecodeError, ValueError, csv.Error) as error:
        raise UserError(f"{file}: cannot be read as a CSV of time and values: {error}") from None
    names = [title.strip() for title in header]
    if (name not in names[1:]) if name else len(names) < 2:
        raise UserError(f"{file}: no column {name!r}; it has {', '.join(names[1:]) or 'no other'}")
    at = names.index(name, 1) if name else 1
    try:
        return _checked((float(row[0]), float(row[at])) for row in rows if row)
    except (ValueError, IndexError) as error:
        raise UserError(f"{file}: {error}") from None


def _checked(rows: Iterable[tuple[float, float]]) -> Points:
    """Return the corners of a course.

    Args:
        rows: times [s] and values.

    Raises:
        ValueError: there is no row, a value is not a number, or the times do not rise from 0 to
            `LATEST_S`.

    """
    given = list(rows)
    for number in itertools.chain.from_iterable(given):
        if not isinstance(number, int | float) or not math.isfinite(number):
            raise ValueError(f"{number!r} is no number of a course")
    if any(abs(time) > LATEST_S for time, _ in given):
        raise ValueError(f"a time of a course is later than {LATEST_S:g} s")
    corners = tuple((round(time * NS_PER_S), float(value)) for time, value in given)
    times = [time for time, _ in corners]
    if not times or times[0] < 0 or any(b <= a for a, b in itertools.pairwise(times)):
        raise ValueError("times of a course begin at 0 s or later and rise from row to row")
    return corners
