"""Limits of the files that a user gives: checked before anything parses them.

Every reader of the package checks them first. A limit protects the computer: it is far above the
size of real files of its kind, and its message names the remedy for a larger file.
"""

import json
import stat
import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hil_emulator.errors import UserError

MIB, GIB = 2**20, 2**30


@dataclass(frozen=True)
class Limit:
    """What a kind of file may need.

    Attributes:
        what: the kind of file, for messages.
        size: largest size on disk [B].
        remedy: what to do with a larger one.

    """

    what: str
    size: int
    remedy: str


CONFIGURATION = Limit("configuration (TOML)", MIB, "split it, or put courses of values into CSV")
"""The largest one of the package has 12 KiB (assumed)."""

EFFECTS = Limit("effect file (Python)", MIB, "split it")
"""The largest one of the package has 20 KiB (assumed)."""

SHEET = Limit("EDS or DCF", 4 * MIB, "leave out objects that the device does not need")
"""A device with 10,000 objects needs 2 MiB (assumed)."""

DATABASE = Limit("database of messages", 8 * MIB, "keep the messages of the device alone")
"""Databases of whole vehicles have up to 5 MiB; their reader needs 100 times that (assumed)."""

COURSE = Limit("CSV of a course", 16 * MIB, "sample it more slowly, or cut it")
"""A quarter of an hour at 1 kHz, in rows of 16 characters (assumed)."""

LOG = Limit("log", 4 * GIB, "cut it, or leave out columns")
"""Three hours at 1 kHz with 40 columns of 10 characters."""

LABVIEW_TEXT = Limit("LabVIEW measurement (.lvm)", 256 * MIB, "save it as TDMS")
"""An hour at 1 kHz with 7 columns of 10 characters."""

CAPTURE = Limit("CAN capture", GIB, "cut it")
"""Over two hours of 2,000 frames a second with 64 characters each."""

RECORDING = Limit("recording", 8 * GIB, "record less, or with --trigger")
"""Five hours at 1 kHz with 60 columns of 8 bytes."""

RECORDING_IN_PARTS = Limit("recording", 1024 * GIB, "record less, or with --trigger")
"""Of one that is never in memory as a whole: four weeks of the above."""

RESULT = Limit("result of an identification", 16 * MIB, "write it anew with identify --out")
"""A result with twenty logs has 0.3 MiB (assumed)."""

TRACES = Limit("traces of an identification", 4 * GIB, "identify with fewer logs")
"""Seven arrays for each channel of each log: those of 20 min at 1 kHz have 0.3 GiB (assumed)."""

PARAMETERS = Limit("stored parameters", 4 * MIB, "remove it; the node starts with its defaults")
"""10,000 objects of 100 characters, four times (assumed)."""

SEALED = Limit("sealed file", MIB, "hide the effects again")
"""It has 1 KiB (assumed)."""

FMU = Limit("FMU", GIB, "leave its documentation and the libraries of other systems out")
"""Libraries for several systems with their resources (assumed)."""

EXPANSION = 200
"""Unpacked size of a file over its packed size. The times of a log compress by 2, so that one of
100 columns that are all at rest reaches this; noise compresses by less than 10, XML by 50, a zip
bomb by 1,000 (assumed)."""

UNPACKED_ALWAYS = 512 * MIB
"""Unpacked size that any file may have: every computer has that memory (assumed)."""

UNPACKED = 4 * GIB
"""Largest unpacked size: four hours at 1 kHz with 36 channels of 8 bytes."""

MEMBERS = 10_000
"""Files in an archive; a recording has one for each column, an FMU some hundred (assumed)."""

JSON_DEPTH = 64
"""Levels of JSON; the files of this program have 8 (assumed)."""


def check(file: Path, limit: Limit) -> int:
    """Return the size of a file [B]; a folder is left to its reader.

    Raises:
        UserError: if it is too large for its kind, or no regular file: a device or a pipe may never
            end.
        OSError, ValueError: as `Path.stat` does, such as for a file that is missing.

    """
    status = file.stat()
    if not stat.S_ISREG(status.st_mode) and not stat.S_ISDIR(status.st_mode):
        raise UserError(
            f"{file}: is a device or a pipe, not a regular file; save what it gives as a file first"
        )
    if status.st_size > limit.size and not stat.S_ISDIR(status.st_mode):
        raise UserError(
            f"{file}: has {_size(status.st_size)}; a {limit.what} may have {_size(limit.size)}: "
            f"{limit.remedy}"
        )
    return status.st_size


def read_bytes(file: Path, limit: Limit) -> bytes:
    """Return the content of a file.

    Raises:
        UserError: see `check`.
        OSError, ValueError: it cannot be read.

    """
    check(file, limit)
    return file.read_bytes()


def read_text(file: Path, limit: Limit) -> str:
    """Return the text of a file in UTF-8.

    Raises:
        UserError: see `check`.
        OSError, ValueError: it cannot be read, or is not UTF-8.

    """
    return read_bytes(file, limit).decode("utf-8")


def read_json(file: Path, limit: Limit) -> Any:
    """Return the content of a JSON file.

    Raises:
        UserError: see `check`.
        OSError, ValueError: it cannot be read, is not JSON, or nests deeper than `JSON_DEPTH`.

    """
    return parse_json(read_text(file, limit))


def parse_json(text: str | bytes) -> Any:
    """Return the content of a JSON text.

    Raises:
        ValueError: it is not JSON, or nests deeper than `JSON_DEPTH`.

    """
    try:
        content = json.loads(text)
        deep = is_deeper(content, JSON_DEPTH)
    except RecursionError:
        content, deep = None, True
    if deep:
        raise ValueError(f"nested more than {JSON_DEPTH} levels deep")
    return content


def is_deeper(content: Any, levels: int) -> bool:
    """Return whether tables and arrays nest deeper than so many levels."""
    level = [content]
    for _ in range(levels):
        level = [inner for outer in level for inner in _inside(outer)]
    return bool(level)


def _inside(value: Any) -> list[Any]:
    if isinstance(value, dict):
        return list(value.values())
    return value if isinstance(value, list) else []


def largest_unpacked(file: Path) -> int:
    """Return how large the content of a compressed file may be [B]."""
    return min(UNPACKED, max(UNPACKED_ALWAYS, EXPANSION * file.stat().st_size))


def check_unpacked(file: Path, size: int) -> None:
    """Refuse a file whose content is too large for memory, or for the file.

    Args:
        file: the file.
        size: of what is in it, as the file states it [B].

    Raises:
        UserError: if it is.

    """
    most = largest_unpacked(file)
    if size > most:
        raise UserError(
            f"{file}: states {_size(size)} of content, and a file of its size may hold "
            f"{_size(most)}: it is damaged, or has to be cut"
        )


def check_archive(file: Path, limit: Limit) -> None:
    """Check a zip archive and the sizes that it states; `zipfile` unpacks no more than these.

    Raises:
        UserError: see `check` and `check_unpacked`; or it has more than `MEMBERS` members.
        OSError, ValueError: it cannot be read, or is no archive.

    """
    check(file, limit)
    try:
        with zipfile.ZipFile(file) as archive:
            members = archive.infolist()
    except (zipfile.BadZipFile, NotImplementedError, RuntimeError) as error:
        raise ValueError(str(error)) from None
    if len(members) > MEMBERS:
        raise UserError(f"{file}: has {len(members)} members; at most {MEMBERS} are read")
    check_unpacked(file, sum(member.file_size for member in members))


def _size(size: float) -> str:
    """Return a size with a binary prefix."""
    for unit, value in (("GiB", GIB), ("MiB", MIB), ("KiB", 1024)):
        if size >= value:
            return f"{size / value:.3g} {unit}"
    return f"{size:.0f} bytes"
