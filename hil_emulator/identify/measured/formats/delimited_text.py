"""Text in columns: commas, semicolons, tabs or blanks between cells, points or decimal commas."""

import csv
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from hil_emulator.errors import UserError
from hil_emulator.identify.measured.formats import rows
from hil_emulator.identify.measured.formats.table import LogTable

OWN_MARK = "# hil-emulator"
"""How a table begins that the emulator has written."""

REMARKS = ("#", "%", "//")
"""How a line begins that is a remark."""

_COMMENTS = 20  # lines in which that mark may stand
_LOOKED_AT = 200  # lines at the end of a file that tell how its cells are separated


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
    """Read a table; how its cells are separated is seen from its last lines.

    Args:
        file: the file.
        headings: names and units of its columns, where it has no header.

    Raises:
        UserError: if it is empty, without a header, or a row is longer than that.

    """
    text, encoding = decoded(file.read_bytes())
    lines = text.splitlines()
    own = any(line.startswith(OWN_MARK) for line in lines[:_COMMENTS])
    kept = [line for line in lines if line.strip() and not line.startswith(REMARKS)]
    if not kept:
        raise UserError(f"{file}: empty; a recording begins with a header of names and units")
    style = max(_STYLES, key=lambda s: _fit(kept[-_LOOKED_AT:], s))
    found = rows.table(file, _cells(kept, style), style.decimal_comma, headings)
    notes = [encoding] if encoding else []
    notes += [style.words] if style != _USUAL else []
    return replace(found, set_point_first=own, notes=(*notes, *found.notes))


def decoded(content: bytes) -> tuple[str, str]:
    """Return text, and in words an encoding that is not UTF-8."""
    if content.startswith((b"\xff\xfe", b"\xfe\xff")):
        return content.decode("utf-16", errors="replace"), "encoded in UTF-16"
    try:
        return content.decode("utf-8-sig"), ""
    except UnicodeDecodeError:
        return content.decode("latin-1"), "encoded in Latin-1"


def _cells(lines: Sequence[str], style: _Style) -> list[list[str]]:
    if not style.separator:
        return [line.split() for line in lines]
    try:
        return list(csv.reader(lines, delimiter=style.separator, skipinitialspace=True))
    except csv.Error:  # an unclosed quotation mark
        return [line.split(style.separator) for line in lines]


def _fit(lines: Sequence[str], style: _Style) -> float:
    """Return how well a style fits: the numbers it finds, where rows have equally many cells."""
    found = _cells(lines, style)
    widths, counts = np.unique([len(row) for row in found], return_counts=True)
    width = int(widths[np.argmax(counts)])
    if width < 2:
        return 0.0
    filled = [c for row in found for c in row if c.strip()]
    good = sum(rows.number(c, style.decimal_comma) == rows.number(c, style.decimal_comma)
               or rows.moment(c) is not None for c in filled)  # fmt: skip
    return float(counts.max() / len(found) * (0.1 + good / max(len(filled), 1)))
