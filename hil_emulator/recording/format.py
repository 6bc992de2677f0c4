"""What a format of another tool *is*; each is declared in its file of the folder `formats`."""

import importlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from hil_emulator.errors import UserError

EXTRA = "recording"
"""Extra of this package that brings what formats need."""


@dataclass(frozen=True)
class Format:
    """A format that a journal can be written in.

    Attributes:
        endings: of its files, such as ".csv".
        write: writes a journal (first argument) into a file.
        needs: the module without which it cannot be written, of the extra `recording`.
        companions: the files that `write` makes besides, in the same folder.
        directed: writes the same with the direction of each frame, where that is not usual.

    """

    endings: tuple[str, ...]
    write: Callable[[Path, Path], None]
    needs: str = ""
    companions: Callable[[Path], tuple[Path, ...]] = lambda _: ()
    directed: Callable[[Path, Path], None] | None = None

    def check(self, file: Path) -> None:
        """Refuse a file where what the format needs is not installed.

        Raises:
            UserError: says what to install.

        """
        try:
            if self.needs:
                importlib.import_module(self.needs)
        except ImportError:
            raise UserError(
                f"{file}: needs {self.needs}, which is not installed; "
                f"pip install 'hil-emulator[{EXTRA}]'"
            ) from None
