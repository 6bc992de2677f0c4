"""Text as benches write it: separators, decimal commas, headers, units, clocks, encodings."""

from collections.abc import Sequence
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
import pytest

from hil_emulator.errors import UserError
from hil_emulator.identify.measured import reading
from hil_emulator.identify.measured.data import load_experiments
from hil_emulator.identify.measured.formats import rows

COUNT = 120
TIME = np.arange(COUNT) * 0.01
POSITION = np.round(40.0 + np.sin(3.0 * TIME), 4)
FORCE = np.round(100.0 * np.cos(3.0 * TIME), 2)

Table = list[list[str]]


def cells(times: Sequence[str] | None = None) -> Table:
    """Return rows of time, position [mm] and force [N]."""
    stamps = times or [f"{t:.2f}" for t in TIME]
    return [[t, f"{x:.4f}", f"{f:.2f}"] for t, x, f in zip(stamps, POSITION, FORCE, strict=True)]


def read(file: Path, headings: Sequence[str] = ()) -> tuple[str, ...]:
    """Read a file, compare its values exactly, and return the notes."""
    (e,) = load_experiments([file], headings=headings)
    assert e.period == pytest.approx(0.01)
    np.testing.assert_allclose(e.readings["position"], POSITION * 1e-3, rtol=1e-12)
    np.testing.assert_allclose(e.readings["load_force"], FORCE, rtol=1e-12)
    return e.notes


def lines(head: Sequence[str], separator: str, rows: Table, comma: bool = False) -> str:
    """Return a text with a header."""
    body = [separator.join(row) for row in rows]
    body = [line.replace(".", ",") for line in body] if comma else body
    return "\n".join([*head, *body]) + "\n"


HEADS = ("time [s]", "position [mm]", "load_force [N]")


@pytest.mark.parametrize(("separator", "comma", "words"), [
    ("\t", False, "tabs"), ("\t", True, "tabs, decimal commas"),
    (";", False, "semicolons"), (";", True, "semicolons, decimal commas"),
])  # fmt: skip
def test_separators_and_decimal_commas_are_seen(
    tmp_path: Path, separator: str, comma: bool, words: str
) -> None:
    """Any separator gives the same values, and a note names the assumption."""
    file = tmp_path / "log.txt"
    file.write_text(lines([separator.join(HEADS)], separator, cells(), comma))
    assert f"cells separated by {words}" in read(file)


def test_blanks_between_cells(tmp_path: Path) -> None:
    """Columns of fixed width, as Fortran and older loggers write them."""
    file = tmp_path / "log.txt"
    body = "".join(f"{t:>10}{x:>12}{f:>12}\n" for t, x, f in cells())
    file.write_text("time_s position_mm load_force_N\n" + body)
    assert "cells separated by blanks" in read(file)


def test_a_plain_table_needs_no_assumption(tmp_path: Path) -> None:
    """Commas, points, and units in the header need no assumption and no note."""
    file = tmp_path / "log.csv"
    file.write_text(lines([",".join(HEADS)], ",", cells()))
    assert read(file) == ()


@pytest.mark.parametrize("head", [
    "time (s),position (mm),load_force (N)", "time_s,position_mm,load_force_N",
    "Time [s],Position [mm],Load_Force [N]",
])  # fmt: skip
def test_units_are_written_in_many_ways(tmp_path: Path, head: str) -> None:
    """In brackets, in parentheses, or behind an underscore; with capitals or without."""
    file = tmp_path / "log.csv"
    file.write_text(lines([head], ",", cells()))
    read(file)


@pytest.mark.parametrize("units", ["s,mm,N", "[s],[mm],[N]", "(s),(mm),(N)"])
def test_a_second_row_holds_the_units(tmp_path: Path, units: str) -> None:
    """Names in one row, units in the next."""
    file = tmp_path / "log.csv"
    file.write_text(lines(["time,position,load_force", units], ",", cells()))
    assert "units in row 2" in read(file)


def test_what_stands_above_the_header_is_left_out(tmp_path: Path) -> None:
    """Titles, settings with numbers, empty lines and remarks come before the table."""
    above = ["Bench 7;;", "# a remark", "Operator;N. N.;", "", "% another", ";".join(HEADS)]
    file = tmp_path / "log.csv"
    file.write_text(lines(above, ";", cells()))
    assert any(n.startswith("header in row 3; what is above") for n in read(file))


def test_columns_without_a_header_are_named_by_the_user(tmp_path: Path) -> None:
    """Without names there is one message with the option that states them."""
    file = tmp_path / "log.csv"
    file.write_text(lines([], ",", cells()))
    with pytest.raises(UserError, match=r'has no header.*--columns "time \[s\]'):
        load_experiments([file])
    assert any("--columns" in note for note in read(file, HEADS))
    with pytest.raises(UserError, match="names 2 columns, and the rows have 3 cells"):
        load_experiments([file], headings=HEADS[:2])


@pytest.mark.parametrize("form", [
    "2026-03-04T05:06:{0:09.6f}", "2026-03-04 05:06:{0:09.6f}+01:00", "05:06:{0:06.3f}",
    "04.03.2026 05:06:{0:06.3f}", "04/03/2026 05:06:{0:06.3f}",
])  # fmt: skip
@pytest.mark.parametrize("name", ["time", "Stamp"])
def test_dates_and_clocks_become_seconds(tmp_path: Path, form: str, name: str) -> None:
    """ISO stamps, times of day and dates with the day first, whatever the column is called."""
    file = tmp_path / "log.csv"
    times = [form.format(t) for t in TIME]
    file.write_text(lines([f"{name},position [mm],load_force [N]"], ",", cells(times)))
    assert any("holds times of day or dates" in note for note in read(file))


def test_a_clock_passes_midnight(tmp_path: Path) -> None:
    """Time goes on at 24:00; the file holds one experiment."""
    file = tmp_path / "log.csv"
    seconds = 86400.0 - 0.6 + TIME
    times = [f"{int(s // 3600) % 24:02d}:{int(s // 60) % 60:02d}:{s % 60:06.3f}" for s in seconds]
    file.write_text(lines(["clock,position [mm],load_force [N]"], ",", cells(times)))
    read(file)


@pytest.mark.parametrize("begin", [
    datetime(2026, 3, 4, 11, 59, 59, 400_000), datetime(2026, 2, 12, 23, 59, 59, 400_000),
    datetime(2026, 2, 28, 23, 59, 59, 400_000), datetime(2026, 3, 4, 12, 59, 59, 400_000),
    datetime(2026, 3, 4, 0, 59, 59, 400_000),
])  # fmt: skip
@pytest.mark.parametrize("form", ["{c} {h}", "{m}/{d}/{y} {c} {h}", "{y}-{m:02d}-{d:02d} {c} {h}"])
def test_clocks_of_twelve_hours_go_on(tmp_path: Path, begin: datetime, form: str) -> None:
    """AM and PM through noon, midnight and the hours after 12; in a US date the month is first."""
    file, times = tmp_path / "log.csv", []
    for t in TIME:
        now = begin + timedelta(seconds=float(t))
        clock = f"{(now.hour - 1) % 12 + 1}:{now:%M:%S}.{now.microsecond // 1000:03d}"
        half = "AM" if now.hour < 12 else "PM"
        times.append(form.format(c=clock, h=half, d=now.day, m=now.month, y=now.year))
    file.write_text(lines(["stamp,position [mm],load_force [N]"], ",", cells(times)))
    read(file)


@pytest.mark.parametrize(
    ("cell", "hour"),
    [("12:30 AM", 0.5), ("12:30 p.m.", 12.5), ("1:30pm", 13.5), ("11:30 A.M.", 11.5),
     ("13:30 PM", 13.5)],
)  # fmt: skip
def test_twelve_oclock_begins_a_half_day(cell: str, hour: float) -> None:
    """12 AM is midnight, 12 PM is noon; a PM after a clock of 24 hours changes nothing."""
    assert rows.moment(cell) == timedelta(hours=hour)
    assert rows.moment(f"3/14/2026 {cell}") == datetime(2026, 3, 14) + timedelta(hours=hour)


@pytest.mark.parametrize("encoding", ["utf-8-sig", "latin-1", "utf-16"])
def test_encodings(tmp_path: Path, encoding: str) -> None:
    """A byte-order mark, Latin-1 and UTF-16 are seen; a degree sign harms nothing."""
    file = tmp_path / "log.csv"
    file.write_bytes(lines(["# Öl 40 °C", ",".join(HEADS)], ",", cells()).encode(encoding))
    read(file)


def test_a_long_table_is_read_in_parts(tmp_path: Path) -> None:
    """Of 20,000 rows times of day are times, and a number among such makes them numbers."""
    rows = 20_000
    clock = [f"{s // 3600:02d}:{s // 60 % 60:02d}:{s % 60:02d}" for s in range(rows)]
    mixed = ["01:00:00"] * 9_000 + ["7"] * 11_000
    lines = [f"{c};{i};{m}" for i, (c, m) in enumerate(zip(clock, mixed, strict=True))]
    file = tmp_path / "long.csv"
    file.write_text("\n".join(["time;position [mm];load_force [N]", *lines]))
    series = reading.read(file).series
    np.testing.assert_array_equal(series["position"].time, np.arange(rows))
    np.testing.assert_allclose(series["position"].values, np.arange(rows) * 1e-3)
    assert np.flatnonzero(np.isfinite(series["load_force"].values)).tolist() == list(
        range(9_000, rows)
    )
