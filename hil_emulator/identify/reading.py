"""Read recorded experiments: tables whose columns carry their names and units."""

import csv
import difflib
import hashlib
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hil_emulator.errors import UserError
from hil_emulator.identify.experiment import UNITS, Array
from hil_emulator.units import factor

MODEL_PREFIX = "model."
"""Columns that the emulator knows of itself and no sensor reports: never read."""

SET_POINT = "valve_current"

KNOWN = {"time": "s", SET_POINT: "A", **UNITS}
"""Columns that identification uses, with their SI units."""

_HEADER = re.compile(r"^\s*(?P<name>[^\[\]]+?)\s*\[\s*(?P<unit>[^\[\]]*)\s*\]\s*$")


@dataclass(frozen=True)
class Recording:
    """A table as it was written, in SI units.

    Attributes:
        file: where it comes from.
        columns: values by name, NaN where a cell was empty.
        digest: digest of the file.
        emulated: whether the emulator recorded it: its set point acts before the row's readings.
        ignored: columns that identification does not know.

    """

    file: Path
    columns: dict[str, Array]
    digest: str
    emulated: bool
    ignored: tuple[str, ...]


def read(file: Path) -> Recording:
    """Read a CSV with a header such as `time [s],position [mm]`, or an emulator's recording.

    Raises:
        UserError: if the file is missing, no table, or without a usable column.

    """
    try:
        content = file.read_bytes()
    except OSError as error:
        raise UserError(f"{file}: cannot be read: {error.strerror}; name a recording") from None
    digest = hashlib.sha256(content).hexdigest()[:16]
    if file.suffix == ".npz":
        return _read_npz(file, digest)
    if file.suffix not in {".csv", ".txt"}:
        raise UserError(f"{file}: unknown ending; a recording ends in .csv or .npz")
    return _read_csv(file, content.decode("utf-8", errors="replace"), digest)


def _read_csv(file: Path, text: str, digest: str) -> Recording:
    lines = text.splitlines()
    emulated = any(line.startswith("# hil-emulator") for line in lines[:20])
    rows = list(csv.reader(line for line in lines if line.strip() and not line.startswith("#")))
    if not rows:
        raise UserError(f"{file}: empty; a recording begins with a header of names and units")
    names, factors = _header(file, rows[0])
    values = np.full((len(rows) - 1, len(names)), np.nan)
    for i, row in enumerate(rows[1:]):
        if len(row) > len(names):
            raise UserError(
                f"{file}: row {i + 2} has {len(row)} cells, the header has {len(names)}"
            )
        values[i, : len(row)] = [_number(cell) for cell in row]
    return _recording(file, names, values * np.array(factors), digest, emulated)


def _header(file: Path, cells: Sequence[str]) -> tuple[list[str], list[float]]:
    names, factors = [], []
    for cell in cells:
        match = _HEADER.match(cell)
        if match is None:
            raise UserError(
                f'{file}: column "{cell.strip()}" has no unit; write it as "position [mm]"'
            )
        name, unit = match["name"].strip(), match["unit"].strip() or "1"
        names.append(name)
        factors.append(_factor(file, name, unit) if name in KNOWN else 1.0)
    if len(set(names)) < len(names):
        twice = sorted({n for n in names if names.count(n) > 1})
        raise UserError(f"{file}: more than one column is called {', '.join(twice)}; keep one")
    return names, factors


def _factor(file: Path, name: str, unit: str) -> float:
    try:
        return factor(KNOWN[name], unit)
    except Exception:  # pint answers a wrong or unknown unit with many kinds of exception
        raise UserError(
            f'{file}: column "{name} [{unit}]": a unit of {KNOWN[name]} is wanted'
        ) from None


def _number(cell: str) -> float:
    try:
        return float(cell)
    except ValueError:
        return float("nan")


def _read_npz(file: Path, digest: str) -> Recording:
    try:
        with np.load(file, allow_pickle=False) as archive:
            units = dict(archive["units"].tolist())
            columns = {n: archive[n].astype(np.float64) for n in units if n in archive.files}
    except (OSError, ValueError, KeyError) as error:
        raise UserError(f"{file}: is not a recording of the emulator: {error}") from None
    names = list(columns)
    values = np.column_stack([columns[n] * (_factor(file, n, units[n]) if n in KNOWN else 1.0)
                              for n in names])  # fmt: skip
    return _recording(file, names, values, digest, emulated=True)


def _recording(
    file: Path, names: Sequence[str], values: Array, digest: str, emulated: bool
) -> Recording:
    usable = [n for n in names if n in KNOWN]
    if "time" not in usable:
        raise UserError(f'{file}: no column "time [s]"; its columns are {", ".join(names)}')
    if len(usable) < 2:
        near = [m for n in names for m in difflib.get_close_matches(n, KNOWN, n=1) if m != "time"]
        hint = f"; did you mean {near[0]}" if near else ""
        raise UserError(
            f"{file}: no known channel among {', '.join(names)}; known are {', '.join(KNOWN)}{hint}"
        )
    ignored = tuple(n for n in names if n not in KNOWN and not n.startswith(MODEL_PREFIX))
    columns = {n: values[:, i].copy() for i, n in enumerate(names) if n in KNOWN}
    return Recording(file, columns, digest, emulated, ignored)
