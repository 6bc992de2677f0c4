"""Excel workbooks (.xlsx): the first sheet that holds a table."""

from collections.abc import Sequence
from dataclasses import replace
from datetime import datetime, time
from pathlib import Path

from hil_emulator.errors import UserError
from hil_emulator.identify.measured.formats import rows
from hil_emulator.identify.measured.formats.table import OPENPYXL, LogTable, module


def read(file: Path, headings: Sequence[str] = ()) -> LogTable:
    """Read the values of a sheet; formulas count with what they gave when it was saved.

    Args:
        file: the file.
        headings: names and units of its columns, where it has no header.

    Raises:
        UserError: if it is no such file, holds no table, or openpyxl is not installed.

    """
    library = module(OPENPYXL, file)
    try:
        book = library.load_workbook(file, read_only=True, data_only=True)
        sheets = {s.title: [[_text(c) for c in row] for row in s.iter_rows(values_only=True)]
                  for s in book.worksheets}  # fmt: skip
        book.close()
    except Exception as error:  # openpyxl answers a damaged file with many kinds of exception
        raise UserError(f"{file}: is not a readable Excel workbook: {error}") from None
    for title, cells in sheets.items():
        filled = [row for row in cells if any(row)]
        if len(filled) > 1:
            found = rows.table(file, filled, headings=headings)
            others = f", of {len(sheets)} the first one with a table" if len(sheets) > 1 else ""
            return replace(found, notes=(f'sheet "{title}"{others}', *found.notes))
    raise UserError(f"{file}: no sheet holds a table")


def _text(cell: object) -> str:
    if cell is None:
        return ""
    if isinstance(cell, datetime | time):
        return cell.isoformat()
    return repr(cell) if isinstance(cell, float) else str(cell)
