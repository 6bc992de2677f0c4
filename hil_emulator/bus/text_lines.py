"""The lines of a text log in any usual encoding, numbered, for python-can's readers."""

import re
from collections.abc import Callable, Iterator
from pathlib import Path

from hil_emulator.bus.log_content import CANDUMP, beginning, encoding_of
from hil_emulator.errors import UserError

REMARKS = ("#", ";", "//", "%")
"""Beginnings of a remark line."""

_STAMP = re.compile(r"^\s*(\d+\.\d+)")
_RELATIVE = re.compile(r"^base\s+\w+\s+timestamps\s+relative", re.IGNORECASE)


class Lines:
    """The lines of a text, as python-can reads them from a stream.

    Args:
        file: text file.
        kept: returns a line in the reader's form, "" to leave it out; raises ValueError for a line
            that cannot be read.

    Attributes:
        number: number of the last line, from 1.
        line: last line.

    """

    def __init__(self, file: Path, kept: Callable[[str], str] = lambda line: line) -> None:
        encoding = encoding_of(beginning(file))
        self._stream = file.open(encoding=encoding, errors="replace")
        self._file, self._kept = file, kept
        self.number, self.line = 0, ""

    def __iter__(self) -> Iterator[str]:
        return self

    def __next__(self) -> str:
        while True:
            self.line = next(self._stream)
            self.number += 1
            try:
                if kept := self._kept(self.line):
                    return kept
            except ValueError as error:
                raise self.trouble(str(error)) from None

    def trouble(self, why: str) -> UserError:
        """Return an error that names the last line."""
        text = self.line.strip()[:60]
        return UserError(f"{self._file}: line {self.number}: {why}: {text!r}")

    def close(self) -> None:
        """Close the file."""
        self._stream.close()


def candump_line(line: str) -> str:
    """Return a line of candump's log; "" for a remark.

    Raises:
        ValueError: if the line is neither.

    """
    if not line.strip() or line.lstrip().startswith(REMARKS):
        return ""
    if not CANDUMP.match(line):
        raise ValueError("is no frame of candump -L")
    return line


class Cumulated:
    """Converts time stamps of Vector's ASC from time since the last event to absolute time."""

    def __init__(self) -> None:
        self._relative, self._sum = False, 0.0

    def __call__(self, line: str) -> str:
        """Return a line with the time since the first one."""
        self._relative = self._relative or bool(_RELATIVE.match(line.strip()))
        stamp = _STAMP.match(line) if self._relative else None
        if stamp is None:
            return line
        self._sum += float(stamp[1])
        return f"{self._sum:.6f}{line[stamp.end() :]}"
