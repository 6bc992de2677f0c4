"""Checks and writes output files, for every command that writes files.

Output files are written into a hidden folder next to their final place and moved there when all
of them are complete. A command that fails half way therefore leaves the files that were there.
"""

import filecmp
import os
import shutil
import stat
import tempfile
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from hil_emulator.errors import UserError

_ANOTHER = "choose another name"

WAY_OUT = f"{_ANOTHER}, or add --overwrite to replace it"
"""Way out for the command line if an output file exists."""

FROM_PYTHON = f"{_ANOTHER}, or pass overwrite=True to replace it"
"""Way out for the Python interface if an output file exists."""

_WRITABLE = 0o222
"""Write permission bits of a file's mode."""

_PREFIX = ".hil-emulator-"
"""Begin of the name of the folder that holds incomplete files."""


def refuse_existing(
    files: Iterable[Path], *, overwrite: bool = False, way_out: str = WAY_OUT
) -> None:
    """Refuse output files that exist, and two output files of one name.

    A symbolic link exists even if its target does not. Links, folders, devices and read-only files
    are never replaced.

    Args:
        files: files to write.
        overwrite: whether regular, writable files may be replaced.
        way_out: what the user can do about a regular file.

    Raises:
        UserError: names the file, the reason and the way out.

    """
    names: set[Path] = set()
    for file in files:
        _add(file, names)
        try:
            mode = file.lstat().st_mode
        except (FileNotFoundError, NotADirectoryError):
            continue
        except OSError as error:
            raise UserError(f"{file}: cannot be written: {error.strerror}; {_ANOTHER}") from None
        if stat.S_ISLNK(mode):
            raise UserError(f"{file}: is a symbolic link, which is not followed; {_ANOTHER}")
        if not stat.S_ISREG(mode):
            raise UserError(f"{file}: exists and is not a regular file; {_ANOTHER}")
        if not mode & _WRITABLE:
            raise UserError(f"{file}: exists and is read-only; {_ANOTHER}")
        if not overwrite:
            raise UserError(f"{file}: exists already; {way_out}")


@contextmanager
def new_files(*, overwrite: bool = False) -> Iterator["Staging"]:
    """Yield a `Staging`; its output files appear together at the end of the block.

    An existing file of the same content stays and is no reason to refuse.

    Args:
        overwrite: whether existing regular files are replaced, each in one step.

    Raises:
        UserError: if a file exists or cannot be written; see `refuse_existing`.

    """
    staging = Staging(overwrite=overwrite)
    try:
        yield staging
        staging.publish()
    except OSError as error:
        if error.filename is not None and not staging.is_of(error):
            raise
        reason = error.strerror or error
        raise UserError(
            f"{staging.file}: cannot be written: {reason}; choose another place"
        ) from None
    finally:
        staging.remove()


def write_texts(
    texts: Mapping[Path, str], *, overwrite: bool = False, encoding: str = "utf-8",
    newline: str | None = None,
) -> None:  # fmt: skip
    """Write all texts, or no file if one fails; see `new_files`.

    Args:
        texts: content by file.
        overwrite: whether existing regular files are replaced.
        encoding: encoding of the files.
        newline: as the argument of `open`.

    Raises:
        UserError: if a file exists or cannot be written.

    """
    with new_files(overwrite=overwrite) as staged:
        for file, text in texts.items():
            staged(file).write_text(text, encoding=encoding, newline=newline)


class Staging:
    """Holds output files until they are complete.

    Args:
        overwrite: whether existing regular files are replaced.

    Attributes:
        file: the output file that was handled last.

    """

    def __init__(self, *, overwrite: bool) -> None:
        self.file = Path()
        self._overwrite = overwrite
        self._folders: dict[Path, Path] = {}
        self._files: set[Path] = set()

    def __call__(self, file: Path) -> Path:
        """Return a temporary path for a file, with the file's name.

        Files of one folder are in one folder here, too. Further files next to the returned path
        are moved along with it.

        Raises:
            UserError: if the file was requested before.
            OSError: if nothing can be written there.

        """
        self.file = file
        _add(file, self._files)
        folder = file.parent
        if folder not in self._folders:
            there = next((f for f in (folder, *folder.parents) if f.exists()), folder)
            self._folders[folder] = Path(tempfile.mkdtemp(prefix=_PREFIX, dir=there))
        return self._folders[folder] / file.name

    def publish(self) -> None:
        """Move all files to their places; if that fails, remove the moved files."""
        moves = [
            (staged, folder / staged.name)
            for folder, meanwhile in self._folders.items()
            for staged in sorted(meanwhile.iterdir())
        ]
        moves = [(staged, file) for staged, file in moves if not _is_same(staged, file)]
        refuse_existing((file for _, file in moves), overwrite=self._overwrite)
        made: list[Path] = []
        try:
            for staged, file in moves:
                self.file = file
                file.parent.mkdir(parents=True, exist_ok=True)
                if not (self._overwrite and file.exists()):
                    file.open("xb").close()  # O_EXCL: fails if it has appeared meanwhile
                    made.append(file)
                os.replace(staged, file)
        except BaseException:
            for file in made:
                file.unlink(missing_ok=True)
            raise

    def is_of(self, error: OSError) -> bool:
        """Return whether an error is one of writing these files."""
        place = Path(str(error.filename))
        return _PREFIX in str(place) or place in (self.file, *self.file.parents)

    def remove(self) -> None:
        """Remove the files that were not moved."""
        for folder in self._folders.values():
            shutil.rmtree(folder, ignore_errors=True)


def _add(file: Path, files: set[Path]) -> None:
    if file in files:
        raise UserError(f"{file}: named for two outputs; choose another name for one of them")
    files.add(file)


def _is_same(staged: Path, file: Path) -> bool:
    """Return whether a regular file has the content of the staged file."""
    regular = file.is_file() and not file.is_symlink()
    return regular and filecmp.cmp(staged, file, shallow=False)
