"""Comma-separated text with a header such as `time [s],position [mm]`."""

import csv
from pathlib import Path

import numpy as np

from hil_emulator.errors import UserError
from hil_emulator.identify.measured.formats.table import LogColumn, LogTable, label

OWN_MARK = "# hil-emulator"
"""How a table begins that the emulator has written."""

_COMMENTS = 20  # lines in which that mark may stand


def read(file: Path) -> LogTable:
    """Read a table; lines that begin with # are remarks.

    Raises:
        UserError: if it is empty or a row is longer than the header.

    """
    lines = file.read_text(encoding="utf-8-sig", errors="replace").splitlines()
    own = any(line.startswith(OWN_MARK) for line in lines[:_COMMENTS])
    kept = (line for line in lines if line.strip() and not line.startswith("#"))
    try:
        rows = list(csv.reader(kept))
    except csv.Error as error:  # a cell of more than 131,072 characters
        raise UserError(f"{file}: not comma-separated text: {error}") from None
    if not rows:
        raise UserError(f"{file}: empty; a recording begins with a header of names and units")
    heads = [label(cell) for cell in rows[0]]
    if len(heads) == 1 and any(mark in rows[0][0] for mark in ";\t"):
        raise UserError(
            f"{file}: the cells are not separated by commas; export it with commas and "
            "decimal points"
        )
    values = np.full((len(rows) - 1, len(heads)), np.nan)
    for i, row in enumerate(rows[1:]):
        if len(row) > len(heads):
            raise UserError(
                f"{file}: row {i + 2} has {len(row)} cells, the header has {len(heads)}"
            )
        values[i, : len(row)] = [_number(cell) for cell in row]
    columns = (LogColumn(n, u, values[:, i].copy()) for i, (n, u) in enumerate(heads))
    return LogTable(tuple(columns), set_point_first=own)


def _number(cell: str) -> float:
    try:
        return float(cell)
    except ValueError:
        return float("nan")
