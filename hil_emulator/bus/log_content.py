"""Format of a log of frames by its content: endings such as `.asc`, `.csv` and `.dat` mislead."""

import codecs
import gzip
import re
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from hil_emulator import input_files
from hil_emulator.errors import UserError

HEAD = 64 * 1024
"""Bytes of a file's beginning from which its format is recognised (assumed)."""

_LINES = 60  # of the beginning that are examined
_GZIP = b"\x1f\x8b"

_MAGIC = {
    b"LOGG": ".blf",
    b"SQLite format 3\0": ".db",
    b"\x0a\x0d\x0d\x0a": ".pcapng",
}
"""Beginnings of binary logs of frames."""

CANDUMP = re.compile(
    r"^\s*\([\d.]+\)\s+\S+\s+[0-9A-Fa-f]{3,8}#(?:R\d?|(?:#[0-9A-Fa-f])?(?:[0-9A-Fa-f]{2})*)"
    r"(?:\s+[RT])?\s*$"
)
"""A line of `candump -L`."""

SCREEN = re.compile(
    r"^\s*(?:\([\d.: \-]+\)\s+)?\S+\s+(?:[RT]X [B-] [E-]\s+)?[0-9A-F]{3,8}\s+\[\d+\]\s"
)
"""A line of `candump` on the screen."""

_TEXTS = (
    (re.compile(r"^;\$FILEVERSION|^\s*\d+\)\s+[\d.]+\s+"), ".trc"),
    (re.compile(r"^\*\*\*BUSMASTER"), "busmaster"),
    (re.compile(r"^base\s+(hex|dec)\b", re.IGNORECASE), ".asc"),
    (CANDUMP, ".log"),
    (SCREEN, "screen"),
    (re.compile(r"^timestamp,arbitration_id,extended,remote,error,dlc,data$"), ".csv"),
)

_TIME = re.compile(r"^\W*(time|timestamp|time[ _]?stamp|abs\.? time)\b", re.IGNORECASE)
_ID = re.compile(r"^\W*(can[ _-]?)?(id|identifier|arbitration_id)\b(?!.*name)", re.IGNORECASE)
_DATA = re.compile(r"^\W*(data|data ?bytes|d[01]|b[01]|data[01]|payload)\b", re.IGNORECASE)


def content(file: Path) -> str:
    """Return the format of a log of frames; "" if the file is not a log of frames.

    The format is the ending that python-can uses for it, or "screen" (candump without `-L`),
    "busmaster" or "table" (a row for each frame).

    Raises:
        OSError: if the file cannot be read.

    """
    head = beginning(file)
    for magic, kind in _MAGIC.items():
        if head.startswith(magic):
            return kind
    if b"\0" in head and not head.startswith((b"\xff\xfe", b"\xfe\xff")):
        return ""
    lines = [line for line in decoded(head).splitlines() if line.strip()][:_LINES]
    for pattern, kind in _TEXTS:
        if any(pattern.match(line) for line in lines):
            return kind
    return "table" if any(is_frame_header(cells(line)) for line in lines) else ""


def beginning(file: Path) -> bytes:
    """Return the first bytes of a file, unpacked.

    Raises:
        UserError: if the file is not a regular one, or damaged.
        OSError: if the file cannot be read.

    """
    input_files.check(file, input_files.RECORDING)
    with file.open("rb") as stream:
        head = stream.read(HEAD)
    if not head.startswith(_GZIP):
        return head
    try:
        with gzip.open(file) as packed:
            return packed.read(HEAD)
    except (OSError, EOFError, ValueError) as error:
        raise UserError(f"{file}: is not a readable gzip file: {error}") from None


def decoded(head: bytes) -> str:
    """Return a text decoded with `encoding_of`."""
    return head.decode(encoding_of(head), "replace")


def encoding_of(head: bytes) -> str:
    """Return UTF-16 or UTF-8 by the byte order mark or the bytes, else Latin-1."""
    if head.startswith((b"\xff\xfe", b"\xfe\xff")):
        return "utf-16"
    try:
        codecs.getincrementaldecoder("utf-8")().decode(head)
    except UnicodeDecodeError:
        return "latin-1"
    return "utf-8-sig"


def cells(line: str) -> list[str]:
    """Return the cells of a line of a table of frames."""
    separator = max(",;\t", key=line.count)
    return [cell.strip().strip('"') for cell in line.split(separator)]


def is_frame_header(names: list[str]) -> bool:
    """Return whether the columns of a table are those of frames: time, identifier and data."""
    return all(any(p.match(name) for name in names) for p in (_TIME, _ID, _DATA))


def place_of(names: list[str], what: str) -> int:
    """Return the column of "time", "id" or "data"."""
    pattern = {"time": _TIME, "id": _ID, "data": _DATA}[what]
    return next(i for i, name in enumerate(names) if pattern.match(name))


@contextmanager
def plain(file: Path) -> Iterator[Path]:
    """Yield a file; of a packed one (.gz) a temporary file with the unpacked content.

    Raises:
        UserError: if the file is damaged, or unpacks to more than `input_files` allows.

    """
    with file.open("rb") as stream:
        packed = stream.read(len(_GZIP)) == _GZIP
    if not packed:
        yield file
        return
    with tempfile.TemporaryDirectory() as folder:
        inner = Path(folder) / (file.stem if file.suffix.lower() == ".gz" else file.name)
        try:
            with gzip.open(file) as source, inner.open("wb") as target:
                left = input_files.largest_unpacked(file)
                while chunk := source.read(input_files.MIB):
                    left -= len(chunk)
                    if left < 0:
                        raise UserError(f"{file}: unpacks to far more than it has; cut it")
                    target.write(chunk)
        except (OSError, EOFError, ValueError) as error:
            raise UserError(f"{file}: is not a readable gzip file: {error}") from None
        try:
            yield inner
        except UserError as error:
            raise UserError(str(error).replace(str(inner), str(file))) from None
