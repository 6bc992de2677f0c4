"""A journal in the formats of other tools, by the ending of the file.

`.rec` is the journal itself, which holds everything and is read by this program. Each file of the
folder `formats` declares another format: the folder is the list.
"""

import functools
import importlib
import pkgutil
from pathlib import Path

from hil_emulator.errors import UserError
from hil_emulator.recording import SUFFIX, formats
from hil_emulator.recording.format import Format


@functools.cache
def known() -> dict[str, Format]:
    """Return the formats of other tools by the endings of their files."""
    names = sorted(module.name for module in pkgutil.iter_modules(formats.__path__))
    modules = [importlib.import_module(f"{formats.__name__}.{name}") for name in names]
    return {ending: module.FORMAT for module in modules for ending in module.FORMAT.endings}


def check_file(file: Path) -> None:
    """Refuse a file that cannot be written, before the run.

    Raises:
        UserError: for an unknown ending, a folder that is not there or a missing extra.

    """
    endings = (SUFFIX, *known())
    if file.suffix not in endings:
        raise UserError(f"{file}: unknown ending; a recording ends in {', '.join(endings)}")
    if not file.parent.is_dir():
        raise UserError(f"{file}: the folder {file.parent} does not exist; make it first")
    if file.suffix != SUFFIX:
        known()[file.suffix].check(file)


def export(source: Path, file: Path) -> None:
    """Write a journal in the format of the file's ending.

    Raises:
        UserError: if the journal cannot be read or the file cannot be written.

    """
    check_file(file)
    try:
        if file.suffix != SUFFIX:
            known()[file.suffix].write(source, file)
        elif file != source:
            file.write_bytes(source.read_bytes())
    except OSError as error:
        raise UserError(f"{file}: cannot be written: {error.strerror or error}") from None
