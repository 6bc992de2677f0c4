"""Excel workbooks (.xlsx): the first sheet that holds a table."""

import contextlib
import itertools
from collections.abc import Iterator, Sequence
from dataclasses import replace
from datetime import datetime, time
from pathlib import Path
from typing import Any

from hil_emulator import input_files
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
        input_files.check_archive(file, input_files.LOG)
        book = library.load_workbook(file, read_only=True, data_only=True)
        with contextlib.closing(book):
            sheets = book.worksheets
            for sheet in sheets:
                filled = _filled(file, sheet)
                first = list(itertools.islice(filled, 2))
                if len(first) > 1:
                    table = rows.table(file, itertools.chain(first, filled), headings=headings)
                    break
            else:
                raise UserError(f"{file}: no sheet holds a table")
    except UserError:
        raise
    except Exception as error:  # openpyxl answers a damaged file with many kinds of exception
        raise UserError(f"{file}: is not a readable Excel workbook: {error}") from None
    others = f", of {len(sheets)} the first one with a table" if len(sheets) > 1 else ""
    return replace(table, notes=(f'sheet "{sheet.title}"{others}', *table.notes))


def _filled(file: Path, sheet: Any) -> Iterator[list[str]]:
    """Yield the rows of a sheet that hold something.

    Raises:
        UserError: one is too wide.

    """
    sheet.reset_dimensions()  # a sheet may state more cells than it has
    for row in sheet.iter_rows(values_only=True):
        if len(row) > rows.WIDEST:
            raise UserError(f"{file}: has {len(row)} columns; at most {rows.WIDEST} are read")
        texts = [_text(cell) for cell in row]
        if any(texts):
            yield texts


def _text(cell: object) -> str:
    if cell is None:
        return ""
    if isinstance(cell, datetime | time):
        return cell.isoformat()
    return repr(cell) if isinstance(cell, float) else str(cell)
