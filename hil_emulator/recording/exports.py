"""A journal in the formats of other tools, by the ending of the file.

`.rec` is the journal itself, which holds everything and is read by this program. Each file of the
folder `formats` declares another format: the folder is the list.
"""

import functools
import importlib
import pkgutil
import shutil
from collections.abc import Sequence
from pathlib import Path

from hil_emulator.errors import UserError
from hil_emulator.platform.output_files import WAY_OUT, new_files, refuse_existing
from hil_emulator.recording import SUFFIX, formats, journal_of
from hil_emulator.recording.format import Format


@functools.cache
def formats_by_ending() -> dict[str, Format]:
    """Return the formats of other tools by the endings of their files."""
    names = sorted(module.name for module in pkgutil.iter_modules(formats.__path__))
    modules = [importlib.import_module(f"{formats.__name__}.{name}") for name in names]
    return {ending: module.FORMAT for module in modules for ending in module.FORMAT.endings}


def check_file(file: Path) -> None:
    """Refuse a file that cannot be written, before the run.

    Raises:
        UserError: for an unknown ending, a missing folder or a missing extra.

    """
    endings = (SUFFIX, *formats_by_ending())
    if file.suffix not in endings:
        raise UserError(f"{file}: unknown ending; a recording ends in {', '.join(endings)}")
    if not file.parent.is_dir():
        raise UserError(f"{file}: the folder {file.parent} does not exist; make it first")
    if file.suffix != SUFFIX:
        formats_by_ending()[file.suffix].check(file)


def check_files(files: Sequence[Path], *, overwrite: bool = False, way_out: str = WAY_OUT) -> None:
    """Refuse files that exist or cannot be written, with the companions of their formats.

    Args:
        files: to write.
        overwrite: whether existing files are replaced.
        way_out: see `refuse_existing`.

    Raises:
        UserError: names the file, the reason and the way out.

    """
    for file in files:
        check_file(file)
    refuse_existing(files, overwrite=overwrite, way_out=way_out)
    companions = [
        c for f in files if f.suffix != SUFFIX for c in formats_by_ending()[f.suffix].companions(f)
    ]
    refuse_existing(dict.fromkeys(companions), overwrite=overwrite, way_out=way_out)


def check_recording(
    files: Sequence[Path], *, overwrite: bool = False, way_out: str = WAY_OUT
) -> None:
    """Refuse files as `check_files` does, and an existing journal, which is never replaced.

    Raises:
        UserError: names the file, the reason and the way out.

    """
    check_files(files, overwrite=overwrite, way_out=way_out)
    journal = journal_of(files)
    rescue = f"move it away; if it is from an interrupted run, convert {journal} first"
    refuse_existing([journal], way_out=rescue)


def export(source: Path, *files: Path, overwrite: bool = False, directions: bool = False) -> None:
    """Write a journal in the formats of the files' endings: all files, or no file.

    Args:
        source: the journal.
        files: to write.
        overwrite: whether existing files are replaced.
        directions: whether candump's log states the direction of each frame.

    Raises:
        UserError: if the journal cannot be read, or a file exists or cannot be written.

    """
    check_files(files, overwrite=overwrite)
    with new_files(overwrite=overwrite) as staged:
        for file in files:
            write(source, staged(file), directions=directions)


def write(source: Path, file: Path, *, directions: bool = False) -> None:
    """Write a journal in the format of the file's ending; the caller checks existing files.

    Raises:
        UserError: if the journal cannot be read.
        OSError: if the file cannot be written.

    """
    if file.suffix == SUFFIX:
        shutil.copyfile(source, file)
    else:
        form = formats_by_ending()[file.suffix]
        writer = form.directed if directions and form.directed else form.write
        writer(source, file)
