"""The text of an EDS as sections and keys, in any case of letters, encoding and line ending.

Not `configparser`: it takes an indented line for the continuation of the one before, and refuses
a file in which a key stands twice.
"""

import re
from collections.abc import Iterator, Mapping
from pathlib import Path

from hil_emulator import input_files
from hil_emulator.device.eds.report import Report
from hil_emulator.errors import UserError

OBJECT_SECTION = re.compile(r"^[0-9A-F]{4}(sub[0-9A-F]+)?$", re.IGNORECASE)
"""Name of a section that describes an object or one of its members."""

_HEADER = re.compile(r"\[\s*([^\]]*?)\s*\]")
_COMMENT = re.compile(r"(^|\s);.*$")
_LINE_END = re.compile(r"\r\n|\r|\n")
_UTF16 = (b"\xff\xfe", b"\xfe\xff")


class Section:
    """One section: its name and keys as they are written, found in any case.

    Args:
        name: as it is written.
        keys: text by key.

    """

    def __init__(self, name: str, keys: Mapping[str, str] | None = None) -> None:
        self.name = name
        self._keys: dict[str, tuple[str, str]] = {}
        for key, text in (keys or {}).items():
            self.set(key, text)

    def __contains__(self, key: str) -> bool:
        return key.upper() in self._keys

    @property
    def keys(self) -> dict[str, str]:
        """Text by key."""
        return dict(self._keys.values())

    def get(self, key: str) -> str:
        """Return the text of a key, "" where it is missing or empty."""
        entry = self._keys.get(key.upper())
        return entry[1] if entry else ""

    def set(self, key: str, text: str) -> None:
        """Give a key a text."""
        self._keys[key.upper()] = (key, text)


class Sheet:
    """All sections of a file, by name in any case, sub-indices with zeros in front or without."""

    def __init__(self) -> None:
        self._sections: dict[str, Section] = {}

    def __iter__(self) -> Iterator[Section]:
        return iter(list(self._sections.values()))

    def __contains__(self, name: str) -> bool:
        return _plain(name) in self._sections

    def get(self, name: str) -> Section:
        """Return the section of this name, an empty section if it is missing."""
        return self._sections.get(_plain(name)) or Section(name)

    def add(self, section: Section) -> None:
        """Add a section."""
        self._sections[_plain(section.name)] = section


def _plain(name: str) -> str:
    """Return the normalised spelling of a section's name."""
    if not OBJECT_SECTION.match(name):
        return name.upper()
    index, _, subindex = name.upper().partition("SUB")
    return f"{index}SUB{subindex.lstrip('0') or '0'}" if subindex else index


def read(path: Path) -> str:
    """Return the text of a file: UTF-8 or UTF-16 by its byte order mark or content, else Latin-1.

    Raises:
        UserError: the file cannot be read, is too large or not a regular file.

    """
    try:
        data = input_files.read_bytes(path, input_files.SHEET)
    except (OSError, ValueError) as error:  # a name that Python refuses is a ValueError
        reason = getattr(error, "strerror", None) or error
        raise UserError(f"cannot read the EDS {path}: {reason}") from None
    if data.startswith(_UTF16):
        return data.decode("utf-16", "replace")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("latin-1")


def parse(text: str, report: Report) -> Sheet:
    """Return the sections of a text.

    Raises:
        UserError: two sections describe an object differently.

    """
    sheet, section = Sheet(), Section("")
    for number, line in enumerate(_LINE_END.split(text), 1):
        stripped = _COMMENT.sub("", line.strip("\0\x1a \t")).strip()
        if not stripped or stripped.startswith("#"):
            continue
        header = _HEADER.match(stripped)
        key, equals, value = (part.strip() for part in stripped.partition("="))
        if header:
            _close(sheet, section, report)
            section = Section(header[1])
        elif not equals or not key:
            report.note(section.name, "", f"line {number} is no key with a value; ignored")
        elif key not in section:
            section.set(key, value)
        elif value != section.get(key):
            report.note(section.name, key, f"again in line {number}; the first one counts")
    _close(sheet, section, report)
    return sheet


def _close(sheet: Sheet, section: Section, report: Report) -> None:
    """Add a section that has been read; a second section of an object must have the same keys."""
    if not section.name:
        return
    if section.name not in sheet:
        sheet.add(section)
        return
    first = sheet.get(section.name)
    if OBJECT_SECTION.match(section.name) and section.keys != first.keys:
        raise UserError(
            f"{report.source} describes one object twice: [{first.name}] and [{section.name}]; "
            "keep one of them"
        )
    report.note(section.name, "", "stands there twice; the first one counts")
