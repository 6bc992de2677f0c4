"""Reading of a TOML file as a table, or one message on its error."""

import re
import tomllib
from pathlib import Path
from typing import Any

from hil_emulator import input_files
from hil_emulator.errors import UserError

DEEPEST = 16
"""Levels of tables and arrays; those of this program need 5 (assumed)."""

_PART = r"""(?:[\w-]+|"[^"\n]*"|'[^'\n]*')"""
_DOTTED = re.compile(rf"""(?<![\w."'-]){_PART}(?:[ \t]*\.[ \t]*{_PART}){{{DEEPEST}}}""")
"""A key with too many parts: `tomllib` needs time and memory by the square of their number."""


def read_toml(file: Path, what: str) -> dict[str, Any]:
    """Return the content of a file.

    Args:
        file: the file.
        what: kind of the file, for the message.

    Raises:
        UserError: if it cannot be read, is not TOML, or nests deeper than `DEEPEST`.

    """
    return parse_toml(file, read_text(file, what))


def read_text(file: Path, what: str) -> str:
    """Return the text of a file.

    Raises:
        UserError: if it cannot be read, is too large or not a regular file.

    """
    try:
        return input_files.read_text(file, input_files.CONFIGURATION)
    except FileNotFoundError:
        raise UserError(f"{file}: no such file; name an existing {what} (TOML)") from None
    except IsADirectoryError:
        raise UserError(f"{file}: is a folder; name a {what} (TOML) in it") from None
    except UnicodeDecodeError:
        raise UserError(f"{file}: is no text in UTF-8; name a {what} (TOML)") from None
    except (OSError, ValueError) as error:  # such as a name that Python refuses
        raise UserError(f"{file}: cannot be read: {error}") from None


def parse_toml(file: Path, text: str) -> dict[str, Any]:
    """Return the content of a file's text.

    Raises:
        UserError: if it is not TOML, or nests deeper than `DEEPEST`.

    """
    if _DOTTED.search(text):
        raise UserError(_too_deep(file))
    try:
        content = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise UserError(f"{file}: not valid TOML: {error}") from None
    except RecursionError:
        raise UserError(_too_deep(file)) from None
    except ValueError as error:  # a number that Python refuses
        raise UserError(f"{file}: cannot be read: {error}") from None
    if input_files.is_deeper(content, DEEPEST):
        raise UserError(_too_deep(file))
    return content


def _too_deep(file: Path) -> str:
    return f"{file}: nested more than {DEEPEST} levels deep; no table of this program is"
