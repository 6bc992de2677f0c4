"""Machine code in files with a checksum, which is compared before loading.

A loss of power leaves incomplete files, and damaged machine code ends the process. Files that do
not match their checksum are deleted, and the function is compiled again. Numba writes each file
under another name first and then renames it; the checksum is written last, in the same way.
"""

import glob
import hashlib
import os
import shutil
import tempfile
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any, Self

from numba.core import caching

_Cache: Any = caching.FunctionCache
"""Numba has no types for it."""


class CheckedCache(_Cache):  # type: ignore[misc]
    """Numba's cache of one function, with a checksum of its files.

    Attributes:
        lock: file to lock while machine code is loaded or saved.

    """

    def __init__(self, function: Callable[..., Any]) -> None:
        super().__init__(function)
        self._stem = Path(self.cache_path) / self._impl.filename_base
        self.lock = Path(f"{self._stem}.lock")
        self._checksum = Path(f"{self._stem}.sha256")

    @classmethod
    def of(cls, function: Callable[..., Any]) -> Self | None:
        """Return the cache of a function; None if no folder is writable."""
        try:
            return cls(function)
        except (OSError, RuntimeError):  # numba raises the latter if it can write in no folder
            return None

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return the machine code for a signature; None if it has to be compiled."""
        try:
            if self._checksum.read_text() == self._digest():
                return super().load_overload(sig, target_context)
        except Exception:  # unpickling a changed class may raise any exception
            pass
        self._discard()
        return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Store the machine code for a signature, if that is possible."""
        try:
            super().save_overload(sig, data)
            write_whole(self._checksum, self._digest())
        except Exception:  # a full disk, or a damaged index that could not be deleted
            self._discard()

    def _files(self) -> list[Path]:
        """Return the function's index and data files."""
        return sorted(map(Path, glob.glob(f"{glob.escape(str(self._stem))}.*nb[ic]")))

    def _digest(self) -> str:
        digest = hashlib.sha256()
        for file in self._files():
            content = file.read_bytes()
            digest.update(f"{file.name} {len(content)} ".encode() + content)
        return digest.hexdigest()

    def _discard(self) -> None:
        """Delete the files, or folders in their places."""
        for file in (self._checksum, *self._files()):
            if file.is_dir() and not file.is_symlink():
                shutil.rmtree(file, ignore_errors=True)
            with suppress(OSError):
                file.unlink()


def write_whole(file: Path, text: str) -> None:
    """Write a file atomically: no other process reads a part of it.

    Raises:
        OSError: if it cannot be written; then there is no file, or the former one.

    """
    with tempfile.NamedTemporaryFile("w", dir=file.parent, delete=False) as part:
        try:
            part.write(text)
            part.close()
            os.replace(part.name, file)
        except OSError:
            os.unlink(part.name)
            raise
