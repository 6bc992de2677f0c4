"""Text in columns: commas, semicolons, tabs or blanks between cells, points or decimal commas."""

import codecs
import csv
import itertools
from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from hil_emulator import input_files
from hil_emulator.errors import UserError
from hil_emulator.identify.measured.formats import rows
from hil_emulator.identify.measured.formats.table import LogTable

OWN_MARK = "# hil-emulator"
"""How a table begins that the emulator has written."""

REMARKS = ("#", "%", "//")
"""How a line begins that is a remark."""

LONGEST_LINE = input_files.MIB
"""Of a text [B]: a row of 100,000 cells (assumed)."""

_COMMENTS = 20  # lines in which that mark may stand
_LOOKED_AT = 200  # lines at the end of a file from which the separator is determined


@dataclass(frozen=True)
class _Style:
    separator: str  # "" for blanks
    decimal_comma: bool

    @property
    def words(self) -> str:
        names = {",": "commas", ";": "semicolons", "\t": "tabs", "": "blanks"}
        comma = ", decimal commas" if self.decimal_comma else ""
        return f"cells separated by {names[self.separator]}{comma}"


_STYLES = (
    _Style(",", False), _Style(";", False), _Style(";", True), _Style("\t", False),
    _Style("\t", True), _Style("", False), _Style("", True),
)  # fmt: skip
_USUAL = _STYLES[0]


def read(file: Path, headings: Sequence[str] = ()) -> LogTable:
    """Read a table; its last lines determine the separator.

    Args:
        file: the file.
        headings: names and units of its columns, where it has no header.

    Raises:
        UserError: if it is empty, too large, without a header, or a row is longer than that.

    """
    input_files.check(file, input_files.LOG)
    _check_lines(file)
    encoding, note = encoding_of(file)
    last = list(deque(_rows(file, encoding), _LOOKED_AT))
    if not last:
        raise UserError(f"{file}: empty; a recording begins with a header of names and units")
    style = max(_STYLES, key=lambda s: _fit(last, s))
    try:
        cells = _cells(_rows(file, encoding), style, quotes=True)
        table = rows.table(file, cells, style.decimal_comma, headings)
    except csv.Error:  # an unclosed quotation mark
        cells = _cells(_rows(file, encoding), style, quotes=False)
        table = rows.table(file, cells, style.decimal_comma, headings)
    notes = [note] if note else []
    notes += [style.words] if style != _USUAL else []
    first = _is_own(file, encoding) or None
    return replace(table, set_point_first=first, notes=(*notes, *table.notes))


def encoding_of(file: Path) -> tuple[str, str]:
    """Return the encoding of a text, and in words one that is not UTF-8."""
    if next(_chunks(file), b"").startswith((b"\xff\xfe", b"\xfe\xff")):
        return "utf-16", "encoded in UTF-16"
    decoder = codecs.getincrementaldecoder("utf-8")()
    try:
        for chunk in _chunks(file):
            decoder.decode(chunk)
        decoder.decode(b"", final=True)
    except UnicodeDecodeError:
        return "latin-1", "encoded in Latin-1"
    return "utf-8-sig", ""


def _check_lines(file: Path) -> None:
    """Refuse a text with a line that would be a table by itself."""
    for chunk in _chunks(file):
        if len(chunk) == LONGEST_LINE and b"\n" not in chunk and b"\r" not in chunk:
            raise UserError(
                f"{file}: has a line of more than {LONGEST_LINE} characters; it is no table"
            )


def _chunks(file: Path) -> Iterator[bytes]:
    with file.open("rb") as stream:
        while chunk := stream.read(LONGEST_LINE):
            yield chunk


def _lines(file: Path, encoding: str) -> Iterator[str]:
    with file.open(encoding=encoding, errors="replace") as stream:
        yield from stream


def _rows(file: Path, encoding: str) -> Iterator[str]:
    """Yield the lines of a text that are neither empty nor remarks."""
    for line in _lines(file, encoding):
        if line.strip() and not line.startswith(REMARKS):
            yield line.rstrip("\n")


def _is_own(file: Path, encoding: str) -> bool:
    first = itertools.islice(_lines(file, encoding), _COMMENTS)
    return any(line.startswith(OWN_MARK) for line in first)


def _cells(lines: Iterable[str], style: _Style, *, quotes: bool) -> Iterator[list[str]]:
    if not style.separator:
        return (line.split() for line in lines)
    if not quotes:
        return (line.split(style.separator) for line in lines)
    return csv.reader(lines, delimiter=style.separator, skipinitialspace=True)


def _fit(lines: Sequence[str], style: _Style) -> float:
    """Return how well a style fits: the share of numbers, and of rows with equally many cells."""
    try:
        split = list(_cells(lines, style, quotes=True))
    except csv.Error:
        split = list(_cells(lines, style, quotes=False))
    widths, counts = np.unique([len(row) for row in split], return_counts=True)
    width = int(widths[np.argmax(counts)])
    if width < 2:
        return 0.0
    filled = [c for row in split for c in row if c.strip()]
    good = sum(rows.number(c, style.decimal_comma) == rows.number(c, style.decimal_comma)
               or rows.moment(c) is not None for c in filled)  # fmt: skip
    return float(counts.max() / len(split) * (0.1 + good / max(len(filled), 1)))
